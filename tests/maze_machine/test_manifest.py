"""The names of the shipped library are those of its code, and what only needs names imports no code."""

import inspect
import json
import subprocess
import sys
from importlib.resources import files

import pytest

from hsm.dsl import check_file
from maze_machine.catalogue.library import robot_library, robot_names
from maze_machine.catalogue.machines import shipped_machines
from maze_machine.catalogue.manifest import FILE, library_of, manifest_of, text_of

WRITE = "write it anew: python -m maze_machine.catalogue"


def test_the_file_says_what_the_library_declares():
    written = (files("maze_machine.catalogue") / FILE).read_text(encoding="utf-8")
    assert written == text_of(manifest_of(robot_library())), WRITE


def test_names_survive_the_way_through_the_file(tmp_path):
    manifest = json.loads(text_of(manifest_of(robot_library())))
    library = library_of(manifest, tmp_path)
    for name, one in robot_library().activities.items():
        other = library.activities[name]
        assert (other.outcomes, other.holds, other.doc) == (one.outcomes, one.holds, one.doc)
        assert other.parameters == one.parameters
    for name, one in robot_library().signals.items():
        assert (library.signals[name].type, library.signals[name].parameters) == (one.type, one.parameters)
    assert library.events == robot_library().events


@pytest.mark.parametrize("name", shipped_machines())
def test_a_machine_is_the_same_to_both(name):
    file = shipped_machines()[name]
    one, other = check_file(file, robot_library()), check_file(file, robot_names())
    assert one.diagnostics == other.diagnostics
    assert [state.name for state in one.model.states] == [state.name for state in other.model.states]


def test_what_a_name_stands_for_is_found():
    names, library = robot_names(), robot_library()
    for name, one in library.signals.items():
        assert inspect.unwrap(names.signals[name].function) == one.function
    for name, activity in names.activities.items():
        assert issubclass(library.activities[name].factory, inspect.unwrap(activity.factory))


@pytest.mark.parametrize(
    "command", [["check", "pledge"], ["fmt", "--check", "FILE"], ["list", "signals"], ["export", "door"]]
)
def test_commands_about_text_import_neither_numpy_nor_pydantic_nor_the_robot(command):
    file = str(shipped_machines()["pledge"])
    heavy = ["numpy", "pydantic", "rich", "matplotlib", "zenoh", "pymunk", "perception", "skills", "sim"]
    code = (
        f"import sys; sys.argv = ['maze-machine', *{[file if one == 'FILE' else one for one in command]!r}]\n"
        "from maze_machine.cli import main\n"
        "try: main()\n"
        "except SystemExit as ended: assert not ended.code, ended.code\n"
        f"print([one for one in {heavy!r} if one in sys.modules], file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False)
    assert done.stderr.strip().splitlines()[-1] == "[]", done.stderr
