"""Files that repeat the code are up to date."""

import re
import runpy
from pathlib import Path

import pytest

import hsm

ROOT = Path(__file__).parents[2]
DOCS, SCRIPTS = ROOT / "docs", ROOT / "scripts"
GENERATED = runpy.run_path(str(SCRIPTS / "generate.py"))["GENERATED"]


@pytest.mark.parametrize("path", GENERATED, ids=lambda path: path.name)
def test_a_generated_file_is_what_the_code_says(path):
    assert path.read_text(encoding="utf-8") == GENERATED[path](), "run: python scripts/generate.py"


def test_the_page_of_the_python_interface_has_every_public_name():
    page = (DOCS / "reference" / "python.md").read_text(encoding="utf-8")
    assert sorted(re.findall(r"^::: hsm\.(\w+)$", page, re.MULTILINE)) == sorted(hsm.__all__)


def test_the_animation_of_the_readme_is_what_the_script_draws(tmp_path):
    main = runpy.run_path(str(SCRIPTS / "readme_animation.py"))["main"]
    main.__globals__["IMAGES"] = tmp_path
    main()
    shown = re.findall(r'"docs/images/([^"]+)"', (ROOT / "README.md").read_text(encoding="utf-8"))
    assert {path.name for path in tmp_path.iterdir()} == set(shown)
    for path in tmp_path.iterdir():
        assert path.read_text(encoding="utf-8") == (DOCS / "images" / path.name).read_text(encoding="utf-8")
