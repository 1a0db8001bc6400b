"""A new project: the template's files with the machine's name filled in."""

from __future__ import annotations

import re
from importlib.resources import files
from pathlib import Path

from maze_machine.errors import FileError, UsageError
from transport.files import write_text

_PLACES = {
    "maze-machine.toml": "maze-machine.toml",
    "machine.maze-machine": "@NAME@.maze-machine",
    "machine.maze-test": "@NAME@.maze-test",
    "robot.py": "@PACKAGE@.py",
    "drive.py": "drive.py",
    "README.md": "README.md",
    "editor/settings.json": ".vscode/settings.json",
    "ci/machines.yml": ".github/workflows/machines.yml",
}
"""Where each file of the template goes."""
_NAME = re.compile(r"[a-z][a-z0-9_]*")


def make_project(name: str, folder: Path) -> list[Path]:
    """Write a project with a machine, its tests, and the library of a small robot.

    Args:
        name: the machine's.
        folder: where to; made if it is missing.

    Returns:
        The files that were written.

    Raises:
        UsageError: the name is not a valid machine name. FileError: one of the files exists already, or cannot be
            written; nothing is overwritten.
    """
    if not _NAME.fullmatch(name):
        raise UsageError(f"`{name}` cannot name a machine", "use lower-case letters, digits and underscores: my_robot")
    words = {"@NAME@": name, "@PACKAGE@": f"{name}_robot"}
    texts = {folder / _filled(place, words): _filled(_text(source), words) for source, place in _PLACES.items()}
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
    return (files("maze_machine.templates") / "project" / f"{source}.in").read_text(encoding="utf-8")


def _filled(text: str, words: dict[str, str]) -> str:
    for word, value in words.items():
        text = text.replace(word, value)
    return text
