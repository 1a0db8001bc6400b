"""Every code has a section with a wrong example, its message and a right one; all of them are run here."""

import re
from pathlib import Path

import pytest

from hsm.dsl import check_file, check_text
from hsm.dsl.codes import CODES
from hsm.dsl.render import as_text

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "reference" / "diagnostics.md").read_text(encoding="utf-8")
SECTIONS = {match[1]: match[0] for match in re.finditer(r"### ([EWN]\d{4}): .*?(?=\n##|\Z)", PAGE, re.DOTALL)}
BLOCK = re.compile(r"```(maze-machine wrong|maze-machine|text)\n(.*?)```", re.DOTALL)


@pytest.fixture(autouse=True)
def among_other_machines(monkeypatch):
    monkeypatch.chdir(Path(__file__).parent / "machines")


def test_every_code_has_its_section():
    assert list(SECTIONS) == list(CODES)
    for code, section in SECTIONS.items():
        assert section.startswith(f"### {code}: {CODES[code].title}\n")


@pytest.mark.parametrize("code", sorted(CODES.keys() - {"E0107"}))
def test_the_examples_of_a_code(code, library):
    blocks = dict(BLOCK.findall(SECTIONS[code]))
    wrong = check_text(blocks["maze-machine wrong"], library, "example.maze-machine")
    assert {found.code for found in wrong.diagnostics} == {code}
    assert as_text(wrong.diagnostics, wrong.sources) + "\n" == blocks["text"]
    assert (wrong.model is None) == code.startswith("E")
    right = check_text(blocks["maze-machine"], library, "example.maze-machine")
    assert right.model is not None
    assert right.diagnostics == ()


def test_a_file_that_is_not_there(library):
    checked = check_file("example.maze-machine", library)
    assert as_text(checked.diagnostics, checked.sources) + "\n" == dict(BLOCK.findall(SECTIONS["E0107"]))["text"]


def test_the_example_of_an_accepted_note(library):
    text = BLOCK.search(PAGE)[2]
    assert check_text(text, library).diagnostics == ()
    unaccepted = text.replace("# accept N0701", "# expect N0701")
    assert [found.code for found in check_text(unaccepted, library).diagnostics] == ["N0701"]
