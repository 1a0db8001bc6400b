"""Which projects may run their own Python code here: a project file names code, and opening a folder must not run it.

A person trusts a folder once, with ``maze-machine trust``; the decision is stored in the user's configuration folder. A
library that is named on the command line needs no trust, since the user names it. A program that has asked the person
itself, such as an editor with its trusted workspaces, says so in ``MAZE_MACHINE_TRUSTED`` for what it starts.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from pathlib import Path

import typer

from maze_machine.catalogue.project import Project
from maze_machine.errors import FileError, UsageError
from transport.files import write_text

VOUCHED = "MAZE_MACHINE_TRUSTED"
"""The variable of the environment with folders that the caller vouches for, with all in them; separated as in PATH."""


def trust_file() -> Path:
    """The file that lists trusted folders."""
    return Path(typer.get_app_dir("maze-machine")) / "trusted.json"


def trusted_folders() -> frozenset[Path]:
    """The folders that the user trusts.

    Raises:
        FileError: the file that lists them is damaged.
    """
    file = trust_file()
    try:
        found = json.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return frozenset()
    except OSError as error:
        raise FileError(f"{file} cannot be read: {error.strerror or error}") from None
    except (ValueError, RecursionError):
        raise FileError(f"{file} is damaged", "delete it and trust your folders again") from None
    if not isinstance(found, list) or not all(isinstance(one, str) for one in found):
        raise FileError(f"{file} is damaged", "delete it and trust your folders again")
    return frozenset(map(Path, found))


def trust(folder: Path) -> None:
    """Record that a folder's project may run its code.

    Raises:
        FileError: the decision cannot be written.
    """
    _write(trusted_folders() | {folder.resolve()})


def distrust(folder: Path) -> None:
    """Forget that a folder's project may run its code.

    Raises:
        FileError: the decision cannot be written.
    """
    _write(trusted_folders() - {folder.resolve()})


def is_trusted(project: Project) -> bool:
    """Whether a project's code may run."""
    if project.library is None:
        return True
    vouched = [Path(one).resolve() for one in os.environ.get(VOUCHED, "").split(os.pathsep) if Path(one).is_absolute()]
    return any(project.folder.is_relative_to(one) for one in vouched) or project.folder in trusted_folders()


def require_trust(project: Project, ask: Callable[[str], bool] | None = None) -> None:
    """Let a project's code run only if the user trusts its folder.

    Args:
        project: the project.
        ask: asks a person; by default a question on the terminal where there is one.

    Raises:
        UsageError: the user does not trust it; the message says what to do.
    """
    if is_trusted(project):
        return
    question = f"{project.file} names Python code ({project.library}). Run it, and trust this folder from now on?"
    if ask is None and sys.stdin.isatty() and sys.stderr.isatty():
        ask = _on_terminal
    if ask is not None and ask(question):
        trust(project.folder)
        return
    raise UsageError(
        f"{project.file} names Python code ({project.library}), and the folder is not trusted",
        f"read the code, then run `maze-machine trust {project.folder}`",
    )


def _on_terminal(question: str) -> bool:
    return typer.confirm(question, err=True)


def _write(folders: frozenset[Path]) -> None:
    file = trust_file()
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        write_text(file, json.dumps(sorted(map(str, folders)), indent=2))
    except OSError as error:
        raise FileError(f"{file} cannot be written: {error.strerror or error}") from None
