"""Every code has a section with a wrong example, its message and a right one; all of them are run here."""

import re
from pathlib import Path

import pytest

from hsm import MachineError, build, to_transitions
from hsm.dsl import check_file, check_text
from hsm.dsl.reporting.render import as_text
from hsm.interchange.scxml import differences, read_text
from hsm.interchange.scxml.translation import to_machine_text
from hsm.model.codes import CODES

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "reference" / "diagnostics.md").read_text(encoding="utf-8")
SECTIONS = {match[1]: match[0] for match in re.finditer(r"### ([EWN]\d{4}): .*?(?=\n##|\Z)", PAGE, re.DOTALL)}
BLOCK = re.compile(r"```(maze-machine title=\"wrong\"|xml title=\"wrong\"|maze-machine|xml|text)\n(.*?)```", re.DOTALL)
OF_CHARTS = {code for code in CODES if code.startswith("E090") or code in ("E0910", "E0911", "E0922")}
OF_ENGINES = {"E0921"}
OF_FILES = {"E0107"}
OF_EXPORTS = {"W0923"}


@pytest.fixture(autouse=True)
def among_other_machines(monkeypatch):
    monkeypatch.chdir(Path(__file__).parent / "machines")


def test_every_code_has_its_section():
    assert list(SECTIONS) == list(CODES)
    for code, section in SECTIONS.items():
        assert section.startswith(f"### {code}: {CODES[code].title}\n")


@pytest.mark.parametrize("code", sorted(CODES.keys() - OF_CHARTS - OF_ENGINES - OF_FILES - OF_EXPORTS))
def test_the_examples_of_a_code(code, library):
    blocks = dict(BLOCK.findall(SECTIONS[code]))
    wrong = check_text(blocks['maze-machine title="wrong"'], library, "example.maze-machine")
    assert {found.code for found in wrong.diagnostics} == {code}
    assert as_text(wrong.diagnostics, wrong.sources) + "\n" == blocks["text"]
    assert (wrong.model is None) == code.startswith("E")
    right = check_text(blocks["maze-machine"], library, "example.maze-machine")
    assert right.model is not None
    assert right.diagnostics == ()


@pytest.mark.parametrize("code", sorted(OF_CHARTS))
def test_the_charts_of_a_code(code):
    blocks = dict(BLOCK.findall(SECTIONS[code]))
    with pytest.raises(MachineError) as raised:
        use_chart(code, blocks['xml title="wrong"'])
    assert {found.code for found in raised.value.diagnostics} == {code}
    assert as_text(raised.value.diagnostics, {"example.scxml": blocks['xml title="wrong"']}) + "\n" == blocks["text"]
    use_chart(code, blocks["xml"])


def use_chart(code, text):
    """Read a chart; where the code is about its translation, translate it too."""
    model = build(read_text(text, "example.scxml")).model
    if code == "E0922":
        to_machine_text(model)


@pytest.mark.parametrize("code", sorted(OF_ENGINES))
def test_the_machines_of_a_code(code, library):
    blocks = dict(BLOCK.findall(SECTIONS[code]))
    wrong = check_text(blocks['maze-machine title="wrong"'], library, "example.maze-machine")
    assert wrong.diagnostics == ()
    with pytest.raises(MachineError) as raised:
        to_transitions(build(wrong.model))
    assert {found.code for found in raised.value.diagnostics} == {code}
    assert as_text(raised.value.diagnostics, wrong.sources) + "\n" == blocks["text"]
    right = check_text(blocks["maze-machine"], library, "example.maze-machine")
    assert to_transitions(build(right.model)).active() == {"a"}


@pytest.mark.parametrize("code", sorted(OF_EXPORTS))
def test_the_exports_of_a_code(code, library):
    blocks = dict(BLOCK.findall(SECTIONS[code]))
    wrong = check_text(blocks['maze-machine title="wrong"'], library, "example.maze-machine")
    found = differences(wrong.model)
    assert {one.code for one in found} == {code}
    assert as_text(found, wrong.sources) + "\n" == blocks["text"]
    assert differences(check_text(blocks["maze-machine"], library, "example.maze-machine").model) == []


def test_a_file_that_is_not_there(library, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    checked = check_file("example.maze-machine", library)
    assert as_text(checked.diagnostics, checked.sources) + "\n" == dict(BLOCK.findall(SECTIONS["E0107"]))["text"]


def test_the_example_of_an_accepted_note(library):
    text = BLOCK.search(PAGE)[2]
    assert check_text(text, library).diagnostics == ()
    unaccepted = text.replace("# accept N0701", "# expect N0701")
    assert [found.code for found in check_text(unaccepted, library).diagnostics] == ["N0701"]
