"""check, fmt and list as a user meets them."""

import json

import pytest
from typer.testing import CliRunner

from hsm.model.codes import CODES
from hsm.model.types import UNITS
from maze_machine.catalogue.library import robot_library
from maze_machine.catalogue.machines import shipped_machines
from maze_machine.cli import app

GOOD = "machine good\n\nstate a\n    do rotate(90 deg)\n    on done, blocked -> b\n\nfinal b\n"
BAD = "machine bad\nparam idle : time = 1 s\nstate a\n    do rotat(90 deg)\n    on done -> c\n\nfinal b\n"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "good.maze-machine").write_text(GOOD)
    (tmp_path / "bad.maze-machine").write_text(BAD)
    return tmp_path


def run(*arguments, **given):
    return CliRunner().invoke(app, arguments, **given)


def test_check_of_a_good_machine(folder):
    result = run("check", "good.maze-machine")
    assert (result.exit_code, result.output) == (0, "1 file checked: no problems found\n")


def test_check_tells_all_faults_with_the_line_underlined(folder):
    result = run("check", "bad.maze-machine", "good.maze-machine")
    assert result.exit_code == 1
    assert "error[E0204]: there is no activity `rotat`\n --> bad.maze-machine:4:8\n" in result.output
    assert "4 |     do rotat(90 deg)\n  |        ^^^^^\n  = help: did you mean `rotate`?" in result.output
    assert "error[E0201]: there is no state `c`" in result.output
    assert result.output.endswith("2 files checked: 2 errors, 1 warning\n")


def test_check_without_warnings(folder):
    result = run("check", "bad.maze-machine", "--ignore", "W")
    assert (result.exit_code, "W0602" in result.output) == (1, False)


def test_check_for_programs(folder):
    result = run("check", "bad.maze-machine", "--json")
    assert result.exit_code == 1
    document = json.loads(result.output)
    assert document["version"] == 1
    assert [(one["code"], one["severity"], one["place"]["line"]) for one in document["findings"]] == [
        ("W0602", "warning", 2),
        ("E0204", "error", 4),
        ("E0201", "error", 5),
    ]


def test_check_as_sarif(folder):
    result = run("check", "bad.maze-machine", "good.maze-machine", "--sarif")
    assert result.exit_code == 1
    document = json.loads(result.output)
    assert document["version"] == "2.1.0"
    (one_run,) = document["runs"]
    rules = one_run["tool"]["driver"]["rules"]
    assert [rule["id"] for rule in rules] == list(CODES)
    for found in one_run["results"]:
        assert rules[found["ruleIndex"]]["id"] == found["ruleId"]
        location = found["locations"][0]["physicalLocation"]
        assert location["artifactLocation"]["uri"] == "bad.maze-machine"
        assert location["region"]["startLine"] <= location["region"]["endLine"]


@pytest.mark.parametrize("name", ["nowhere.maze-machine", ".", "bytes.maze-machine"])
def test_what_cannot_be_read_ends_with_status_3(folder, name):
    (folder / "bytes.maze-machine").write_bytes(b"machine m\n\xff\xfe")
    for command in ("check", "fmt"):
        result = run(command, name, "good.maze-machine")
        assert result.exit_code == 3
        assert "E0107" in result.output
        assert "cannot be read" in result.output


def test_a_file_that_is_not_there_may_be_the_one_beside_it(folder):
    result = run("check", "godo.maze-machine")
    assert (result.exit_code, "did you mean `good.maze-machine`?" in result.output) == (3, True)


@pytest.mark.parametrize("name", sorted(shipped_machines()))
def test_a_shipped_machine_has_neither_errors_nor_warnings(name):
    result = run("check", name, "--ignore", "N")
    assert (result.exit_code, result.output) == (0, "1 file checked: no problems found\n")


def test_fmt_writes_the_canonical_form(folder):
    untidy = folder / "good.maze-machine"
    untidy.write_text(GOOD.replace("    ", "  ").replace(" -> ", "->"))
    result = run("fmt", "--check", "good.maze-machine")
    assert (result.exit_code, result.output) == (1, "good.maze-machine: would be formatted\n")
    result = run("fmt", "good.maze-machine")
    assert (result.exit_code, result.output) == (0, "good.maze-machine: formatted\n")
    assert untidy.read_text() == GOOD
    result = run("fmt", "--check", "good.maze-machine")
    assert (result.exit_code, result.output) == (0, "")


def test_fmt_refuses_files_that_are_no_machines(folder):
    (folder / "good.maze-test").write_text("test good\nscenario s\n    expect a\n")
    result = run("fmt", "good.maze-test", "good.maze-machine")
    assert (result.exit_code, result.output.count("\n")) == (2, 1)
    assert "good.maze-test: only .maze-machine files can be formatted" in result.output


def test_fmt_leaves_what_it_cannot_read(folder):
    broken = folder / "bad.maze-machine"
    broken.write_text("machine bad\n  state a\n   on ->\n")
    result = run("fmt", "bad.maze-machine")
    assert result.exit_code == 1
    assert "E0101" in result.output
    assert broken.read_text() == "machine bad\n  state a\n   on ->\n"


def test_fmt_of_standard_input():
    result = run("fmt", "-", input="machine   m\nstate a\n  on go->a\n")
    assert (result.exit_code, result.output) == (0, "machine m\nstate a\n    on go -> a\n")


def listed(subject):
    result = run("list", subject, "--json")
    assert result.exit_code == 0
    return json.loads(result.output)


def test_list_shows_all_there_is():
    library = robot_library()
    assert [row["name"].partition("(")[0] for row in listed("signals")] == list(library.signals)
    assert [row["name"].partition("(")[0] for row in listed("activities")] == list(library.activities)
    assert [row["name"].partition("(")[0] for row in listed("actions")] == list(library.actions)
    assert [row["name"] for row in listed("events")] == list(library.events)
    assert [row["name"] for row in listed("codes")] == list(CODES)
    assert [row["name"] for row in listed("units")] == list(UNITS)
    assert {row["name"] for row in listed("machines")} == set(shipped_machines())
    assert {"bool", "int", "speed", *library.enumerations} <= {row["name"] for row in listed("types")}


def test_list_gives_types_units_and_documentation():
    (signal,) = (row for row in listed("signals") if row["name"] == "distance.front")
    assert signal["type"] == "length in m"
    assert signal["about"]
    (activity,) = (row for row in listed("activities") if row["name"].startswith("drive("))
    assert "speed : speed = 0.5 m/s" in activity["name"]
    assert "base" in activity["holds"]


@pytest.mark.parametrize(
    "subject", ["machines", "signals", "activities", "actions", "events", "types", "units", "codes"]
)
def test_list_for_people(subject):
    result = run("list", subject)
    assert result.exit_code == 0
    assert len(result.output.splitlines()) == len(listed(subject))


def test_list_of_nothing_known():
    assert run("list", "sensors").exit_code == 2
