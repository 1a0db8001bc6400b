"""Every complete machine on every page passes the command that a reader would type; the page's words exist."""

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from hsm.dsl.format.formatter import format_text
from hsm.dsl.syntax.lexer import STATEMENTS
from hsm.model.codes import CODES
from hsm.model.types import QUANTITY_NAMES, UNITS
from maze_machine.cli import app

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
PAGE = (ROOT / "docs" / "reference" / "language.md").read_text(encoding="utf-8")
BLOCK = re.compile(
    r"```maze-machine(?: title=\"\S+\")?\n(machine (\w+)\n.*?|#[^\n]*\nmachine (\w+)\n.*?)```", re.DOTALL
)
OWN_LIBRARY = {"diagnostics.md", "examples.md", "from-behavior-trees.md", "own-robot.md", "python.md"}
"""Their machines name libraries of their own; other tests check them."""

MACHINES = [
    pytest.param(match[1], match[2] or match[3], id=f"{page.name}-{match[2] or match[3]}")
    for page in PAGES
    if page.name not in OWN_LIBRARY
    for match in BLOCK.finditer(page.read_text(encoding="utf-8"))
]

OF_REFERENCE = {one.values[1]: one.values[0] for one in MACHINES if one.id.startswith("language.md")}


def check(folder, name, text):
    for imported in re.findall(r"^import (\w+)", text, re.MULTILINE):
        if imported in OF_REFERENCE:
            (folder / f"{imported}.maze-machine").write_text(OF_REFERENCE[imported], encoding="utf-8")
    path = folder / f"{name}.maze-machine"
    path.write_text(text, encoding="utf-8")
    return CliRunner().invoke(app, ["check", str(path)])


@pytest.mark.parametrize(("text", "name"), MACHINES)
def test_an_example_passes_check(text, name, tmp_path):
    result = check(tmp_path, name, text)
    if "rihgt" in text:  # the tutorial's own mistake, which it continues to explain
        assert result.exit_code == 1
        return
    assert result.exit_code == 0, result.output
    assert "warning" not in result.output, result.output


@pytest.mark.parametrize(("text", "name"), [one for one in MACHINES if one.id.startswith("language.md")])
def test_an_example_of_the_reference_is_in_canonical_form(text, name):
    assert format_text(text) == text


def test_the_pages_have_machines():
    assert {one.values[1] for one in MACHINES} >= {"pledge", "arrows", "two_doors", "watchful", "caller", "second"}


def test_all_words_types_units_and_codes_of_the_page_exist():
    listed = re.search(r"begin with \(`([a-z ]+?)`\)", PAGE.replace("\n", " "))[1]
    assert set(listed.split()) == STATEMENTS
    for name in (*QUANTITY_NAMES.values(), *UNITS):
        assert re.search(rf"\b{re.escape(name)}", PAGE), name
    assert set(re.findall(r"\b[EWN]\d{4}\b", PAGE)) <= CODES.keys()
