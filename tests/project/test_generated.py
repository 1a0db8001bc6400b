"""Files that repeat the code are up to date."""

import runpy
from pathlib import Path

import pytest

GENERATED = runpy.run_path(str(Path(__file__).parents[2] / "docs" / "generate.py"))["GENERATED"]


@pytest.mark.parametrize("path", GENERATED, ids=lambda path: path.name)
def test_a_generated_file_is_what_the_code_says(path):
    assert path.read_text(encoding="utf-8") == GENERATED[path](), "run: python docs/generate.py"
