"""Machines for another robot, with a library of one's own: scenarios, properties, generated tests, mutants."""

import pytest
from typer.testing import CliRunner

from hsm import Library
from maze_machine.catalogue.library import named_library
from maze_machine.cli import app
from maze_machine.errors import UsageError

LIBRARY = """
from hsm import Library

LIBRARY = Library("sweeper")


@LIBRARY.signal("bumped")
def bumped(facts) -> bool:
    return facts.bumped


@LIBRARY.activity("sweep", outcomes=("done",), holds=("wheels",))
class Sweep:
    def tick(self, facts): ...


def library():
    return LIBRARY


def nothing():
    return None
"""

MACHINE = """machine sweeper

property returns : always eventually not in(backing) within 5 s

initial sweeping

state sweeping
    do sweep()
    when bumped -> backing
    on done     -> home

state backing
    after {pause} -> home

final home
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    (tmp_path / "my_sweeper.py").write_text(LIBRARY, encoding="utf-8")
    (tmp_path / "sweeper.maze-machine").write_text(MACHINE.format(pause="1 s"), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    return tmp_path


def run(*arguments):
    done = CliRunner().invoke(
        app, ["test", "sweeper.maze-machine", "--library", "my_sweeper:library", *map(str, arguments)]
    )
    return done.exit_code, done.stdout


def test_scenarios_are_found_for_it_and_fail_on_a_changed_machine(folder):
    assert run("--generate", "--output", folder / "sweeper.maze-test")[0] == 0
    status, told = run("--coverage", "--fail-under", 100)
    assert (status, "returns: proved" in told) == (0, True), told
    assert run("--mutate") == (0, "9 mutants, 9 killed: mutation score 100.0%\n")
    (folder / "sweeper.maze-machine").write_text(MACHINE.format(pause="6 s"), encoding="utf-8")
    status, told = run()
    assert status == 1
    assert "FAILED" in told
    assert "scenario counterexample to returns" in told


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("my_sweeper", "names no library"),
        ("my_sweepr:library", "there is no module `my_sweepr`"),
        ("my_sweeper:librar", "has no `librar`"),
        ("my_sweeper:nothing", "returns no library but None"),
        ("my_sweeper:bumped", "returns no library"),
    ],
)
def test_a_library_that_cannot_be_had_is_told_in_words(folder, name, message):
    with pytest.raises(UsageError, match=message):
        named_library(name)


def test_a_library_may_be_named_itself(folder):
    assert isinstance(named_library("my_sweeper:LIBRARY"), Library)
