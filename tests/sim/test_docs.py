"""The pages about mazes and the simulator say what is so: their files are read, their commands run."""

import contextlib
import io
import os
import re
import shlex
from pathlib import Path

import pytest
from typer.testing import CliRunner

from maze_machine.cli import app
from sim.faults import parse_fault

DOCS = Path(__file__).parents[2] / "docs"
PAGES = {name: (DOCS / name).read_text(encoding="utf-8") for name in ("reference/mazes.md", "explanation/simulator.md")}
BLOCK = re.compile(r"^```(\w+)(?: title=\"(\S+)\")?\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def matches(expected, actual):
    """Whether a text is as expected, where ``...`` stands for anything."""
    pattern = ".*".join(re.escape(part) for part in expected.strip().split("..."))
    return re.fullmatch(pattern, actual.strip(), re.DOTALL) is not None


def test_every_command_of_the_page_about_mazes_prints_what_it_says(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    ran = 0
    for kind, file, body in BLOCK.findall(PAGES["reference/mazes.md"]):
        if file:
            Path(file).write_text(body, encoding="utf-8")
        if kind == "console":
            for command, expected in re.findall(r"^\$ maze-machine (.*)\n((?:(?!\$ ).*\n)*)", body, re.MULTILINE):
                ended = CliRunner().invoke(app, shlex.split(command), env={**os.environ, "COLUMNS": "200"})
                assert matches(expected, ended.output), ended.output
                ran += 1
    assert ran == 7
    assert Path("yard.maze").exists()
    assert CliRunner().invoke(app, ["maze", "show", "yard.maze", "--no-picture"]).exit_code == 0


def test_the_example_in_python_runs():
    (program,) = [body for kind, _, body in BLOCK.findall(PAGES["explanation/simulator.md"]) if kind == "python"]
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(program, "simulator.md", "exec"), {})
    assert printed.getvalue().startswith("unfinished: still inside after 5.0 s, path 1.9")


@pytest.mark.parametrize("line", re.findall(r"^\| `(\w+)` \|(.*?)\|", PAGES["explanation/simulator.md"], re.MULTILINE))
def test_every_kind_of_fault_in_the_table_can_be_ordered(line):
    kind, keys = line
    values = {
        "FIRST,LAST": "-0.1,0.1",
        "FORWARD,LEFT,TURN": "0.1,0,0",
        "N": "2",
        "NAME": "front",
        "X,Y,HEADING": "1,2,0",
    }
    details = [f"{key}={values[value]}" for key, value in re.findall(r"`(\w+)=([A-Z,]+)`", keys)]
    assert parse_fault(" ".join([kind, *details])).kind == kind


def test_the_options_for_users_of_the_courses_simulator_are_taken(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    section = PAGES["explanation/simulator.md"].partition("## For users")[2].partition("\n## ")[0]
    options = [word for code in re.findall(r"`(--[^`]+=[^`]+)`", section) for word in code.split()]
    assert len(options) == 12
    ended = CliRunner().invoke(app, ["run", "pledge", "--no-picture", "--time-limit", "2", *options])
    assert "time limit" in ended.output
