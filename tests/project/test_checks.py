"""Style, types, the import table and the list of phrases to avoid hold for the whole project."""

import re
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
ROOMS = ("hsm", "skills", "perception", "machines", "transport", "sim", "maze_machine")

CHECKS = {
    "style": ["-m", "ruff", "check", "--no-cache", "."],
    "format": ["-m", "ruff", "format", "--no-cache", "--check", "."],
    "types": ["-m", "mypy"],
    "prose": ["scripts/prose.py"],
    "imports": ["-c", "from importlinter.cli import lint_imports_command; lint_imports_command()", "--no-cache"],
}


@pytest.mark.parametrize("check", CHECKS)
def test_the_project_passes(check):
    if check == "types" and tuple(map(int, np.__version__.split(".")[:2])) < (2, 4):
        pytest.skip("numpy before 2.4 declares less precise types")
    ended = subprocess.run(
        [sys.executable, *CHECKS[check]], cwd=ROOT, capture_output=True, text=True, timeout=300, check=False
    )
    assert ended.returncode == 0, ended.stdout + ended.stderr


def tracked_files():
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=False)
    if listed.returncode != 0:
        pytest.skip("not a git checkout")
    return [ROOT / name for name in listed.stdout.split("\0") if name and (ROOT / name).is_file()]


def test_no_file_names_a_place_on_somebodys_machine():
    place = re.compile(rb"(?<![\w.])/(?:home|root|Users|work|tmp)/\w")
    own = (path for path in tracked_files() if path.parent.name != "vendor")  # others' files are kept as they are
    assert [path for path in own if place.search(path.read_bytes())] == []


def test_every_package_of_a_room_is_shipped():
    """A folder without ``__init__.py`` would be left out of the wheel."""
    folders = {path.parent for room in ROOMS for path in (ROOT / room).rglob("*.py")}
    assert [str(folder) for folder in sorted(folders) if not (folder / "__init__.py").is_file()] == []


def test_a_module_stays_small_enough_to_be_read():
    longest = {
        str(path.relative_to(ROOT)): lines
        for room in ROOMS
        for path in (ROOT / room).rglob("*.py")
        if (lines := len(path.read_text(encoding="utf-8").splitlines())) > 600
    }
    assert longest == {}


def test_a_public_class_name_is_used_once():
    """One name for one concept, in the whole project."""
    places = defaultdict(list)
    for room in ROOMS:
        for path in sorted((ROOT / room).rglob("*.py")):
            for name in re.findall(r"^class ([A-Za-z]\w*)", path.read_text(encoding="utf-8"), re.MULTILINE):
                places[name].append(str(path.relative_to(ROOT)))
    assert {name: files for name, files in places.items() if len(files) > 1} == {}


@pytest.mark.parametrize(
    ("name", "text", "found"),
    [
        ("a.py", '"""The robot is told to move."""\nTOLD = "findings"\n', 1),
        ("a.py", "# what stands behind it\nstands = 1\n", 1),
        ("a.md", "The robot stands.\n\n```text\nThe robot stands.\n```\n\n`stands` is code.\n", 1),
        ("a.maze-machine", "# it stands there\nmachine stands\n", 1),
        ("a.md", "The robot stops, and the command reports why.\n", 0),
    ],
)
def test_phrases_are_found_in_prose_only(name, text, found, tmp_path):
    (tmp_path / name).write_text(text, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "scripts/prose.py", str(tmp_path / name)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert (bool(done.stdout), done.returncode) == (bool(found), int(bool(found))), done.stdout
