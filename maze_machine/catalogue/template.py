"""A new project: the template's files with the machine's name filled in."""

from __future__ import annotations

import re
from pathlib import Path

from hsm.dsl.syntax.lexer import RESERVED
from maze_machine.catalogue.machines import shipped_machines
from maze_machine.errors import FileError, UsageError
from maze_machine.installation import HOME
from transport.files import write_text

_PROJECT = {
    "project/maze-machine.toml": "maze-machine.toml",
    "project/machine.maze-machine": "@NAME@.maze-machine",
    "project/machine.maze-test": "@NAME@.maze-test",
    "project/robot.py": "@PACKAGE@.py",
    "project/drive.py": "drive.py",
    "project/README.md": "README.md",
    "project/editor/settings.json": ".vscode/settings.json",
    "project/ci/machines.yml": ".github/workflows/machines.yml",
}
"""Where each file goes of a project for a robot of any kind."""
_ROBOT = {
    "robot/maze-machine.toml": "maze-machine.toml",
    "robot/machine.maze-machine": "@NAME@.maze-machine",
    "robot/machine.maze-test": "@NAME@.maze-test",
    "robot/robot.py": "@PACKAGE@.py",
    "robot/robot.toml": "robot.toml",
    "robot/room.maze": "room.maze",
    "robot/README.md": "README.md",
    "project/editor/settings.json": ".vscode/settings.json",
    "robot/ci/machines.yml": ".github/workflows/machines.yml",
}
"""The same for a robot with a laser that the shipped skills drive."""
_NAME = re.compile(r"[a-z][a-z0-9_]*")


def make_project(name: str, folder: Path, *, robot: bool = False) -> list[Path]:
    """Write a project with a machine, its tests, and a library of its own.

    Args:
        name: the machine's.
        folder: where to; made if it is missing.
        robot: whether the machine drives a robot with a laser, by the shipped skills too; else a toy of another kind,
            with a loop of its own.

    Returns:
        The files that were written.

    Raises:
        UsageError: no machine can have the name, or a shipped one has it.
        FileError: one of the files exists already, or cannot be written; nothing is overwritten.
    """
    if not _NAME.fullmatch(name) or name in RESERVED:
        raise UsageError(f"`{name}` cannot name a machine", "use lower-case letters, digits and underscores: my_robot")
    if name in shipped_machines():
        raise UsageError(f"`{name}` names a machine that comes with the program", "choose another name")
    words = {"@NAME@": name, "@PACKAGE@": f"{name}_robot"}
    places = _ROBOT if robot else _PROJECT
    texts = {folder / _filled(place, words): _filled(_text(source), words) for source, place in places.items()}
    for path in texts:
        if path.exists():
            raise FileError(f"{path} exists already", "choose another name or folder; nothing was written")
    for path, text in texts.items():
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            write_text(path, text)
        except OSError as error:
            raise FileError(f"{path} cannot be written: {error.strerror or error}") from None
    return list(texts)


def _text(source: str) -> str:
    return (HOME / "maze_machine" / "templates" / f"{source}.in").read_text(encoding="utf-8")


def _filled(text: str, words: dict[str, str]) -> str:
    for word, value in words.items():
        text = text.replace(word, value)
    return text
