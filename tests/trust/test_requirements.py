"""Requirements: which properties, scenarios and states cover them, and what is uncovered."""

import json

import pytest
from typer.testing import CliRunner

from hsm.testing.scenarios.reading import parse_suite
from hsm.testing.scenarios.writing import Writer
from maze_machine.cli import app

MACHINE = """machine gate

property quiet : never in(open) and in(shut)
property again : always eventually in(open) or in(shut) within 3 s

state shut
    when door.near -> open

state open
    after 2 s -> shut

state never
    when door.near -> shut
"""

STATED = """test gate

requirement R1 it opens for a robot   # not for a cat
requirement R2: it does not stay open
requirement ISO-1.2 <it> & nothing else
"""

COVERED = """
property again covers R2
property quiet covers ISO-1.2, R2

scenario it opens
    covers R1,
        R2
    when door.near
    expect open

scenario nothing to do
    expect shut
"""


@pytest.fixture
def run_test(tmp_path, monkeypatch):
    """Runs ``maze-machine test --requirements`` beside some scenario files; the exit status and what was printed."""
    monkeypatch.chdir(tmp_path)

    def run(*texts, arguments=()):
        (tmp_path / "gate.maze-machine").write_text(MACHINE, encoding="utf-8")
        for number, text in enumerate(texts):
            (tmp_path / f"some{number}.maze-test").write_text(text, encoding="utf-8")
        done = CliRunner().invoke(app, ["test", "gate.maze-machine", "--requirements", *arguments])
        return done.exit_code, done.output

    return run


def test_the_matrix_names_what_covers_each_requirement_and_what_covers_none(run_test):
    status, told = run_test(STATED + COVERED)
    assert status == 0, told
    assert "gate: 3 requirements, 3 covered" in told
    assert "  R1 it opens for a robot: covered\n      scenario it opens: passed\n      states shut, open\n" in told
    assert "  R2 it does not stay open: covered\n      property quiet: proved\n      property again: proved\n" in told
    assert "  ISO-1.2 <it> & nothing else: covered\n      property quiet: proved\n      states shut, open\n" in told
    assert "  without a requirement: 1 scenario; 1 state (never)\n" in told


def test_a_requirement_that_nothing_covers_fails(run_test):
    status, told = run_test(STATED, "test gate\n" + COVERED.replace(" ISO-1.2,", ""))
    assert status == 1
    assert "ISO-1.2 <it> & nothing else: NOT COVERED" in told


def test_a_requirement_whose_scenario_fails_or_whose_property_is_violated_is_not_covered(run_test):
    wrong = COVERED.replace("expect open", "expect never")
    status, told = run_test(STATED + wrong)
    assert status == 1
    assert "R1 it opens for a robot: FAILED\n      scenario it opens: FAILED" in told
    assert "ISO-1.2 <it> & nothing else: covered" in told


def test_requirements_need_not_be_stated(run_test):
    status, told = run_test("test gate\n" + COVERED)
    assert status == 0, told
    assert "gate: 3 requirements, 3 covered" in told
    assert "\n  R1: covered\n" in told


def test_the_matrix_is_written_as_json_and_as_a_page(run_test, tmp_path):
    status, told = run_test(STATED, "test gate\n" + COVERED.replace(" ISO-1.2,", ""), arguments=("--json",))
    found = json.loads(told)["requirements"]
    assert status == 1
    assert [one["name"] for one in found["requirements"]] == ["R1", "R2", "ISO-1.2"]
    assert found["requirements"][0]["scenarios"] == [{"name": "it opens", "passed": True}]
    assert found["requirements"][1]["properties"][0] == {"name": "quiet", "verdict": "proved"}
    assert found["requirements"][1]["states"] == ["shut", "open"]
    assert found["uncovered"] == {
        "requirements": ["ISO-1.2"], "properties": [], "scenarios": ["nothing to do"], "states": ["never"],
    }  # fmt: skip
    assert not found["covered"]
    run_test(arguments=("--html", str(tmp_path / "pages")))
    page = (tmp_path / "pages" / "requirements.html").read_text(encoding="utf-8")
    assert "&lt;it&gt; &amp; nothing else" in page
    assert "it opens: passed" in page
    assert "NOT COVERED" in page
    assert (tmp_path / "pages" / "index.html").is_file()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (STATED + COVERED.replace("covers R1,", "covers R11,"), "there is no requirement `R11`"),
        (STATED + COVERED.replace("property again", "property agian"), "did you mean `again`"),
        (STATED + "requirement R1 again\n" + COVERED, "requirement `R1` is stated twice"),
        (STATED + "requirement R3\n" + COVERED, "requirement `R3` has no text"),
        (STATED + "requirement R!3 stops\n" + COVERED, "`R!3` cannot be the name of a requirement"),
        (STATED + COVERED.replace("    expect open\n", "    expect open\n    covers ISO-1.2\n"), "must come directly"),
        (STATED + COVERED.replace("quiet covers", "quiet cover"), "expected `covers`, found `cover`"),
        (STATED + COVERED.replace("    covers R1", "    covers 'R1'"), "the name of a requirement"),
        (STATED + "covers R1\n" + COVERED, "is indented under its scenario"),
        ("test gate\nscenario it opens\n    expect shut\n", "no .maze-test file names one"),
    ],
)
def test_a_wrong_line_has_a_message_with_its_place(run_test, text, words):
    status, told = run_test(text)
    assert status in (2, 3)
    assert words in told


def test_a_requirement_is_stated_in_one_file_only(run_test):
    status, told = run_test(STATED + COVERED, STATED)
    assert status == 3
    assert "requirement `R1` is stated in some0.maze-test as well" in told


def test_a_scenario_is_written_with_what_it_covers(machine_of, library):
    machine = machine_of("state a\n    when space.left -> b\nstate b\n    when space.right -> a\n")
    text = "test m\n\nscenario s\n    covers R1, R-2.b\n    given space.left\n    expect b\n"
    suite = parse_suite(text, machine.model, library)
    assert Writer(machine.model).suite(suite.scenarios) == text
