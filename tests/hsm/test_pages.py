"""The examples on the engine's pages do what they show."""

import doctest
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"


@pytest.mark.parametrize("page", ["reference/engine.md", "explanation/engine.md"])
def test_the_examples_of_a_page(page):
    failed, tried = doctest.testfile(str(DOCS / page), module_relative=False, optionflags=doctest.ELLIPSIS)
    assert not failed
    assert tried
