"""Find machines: the shipped ones by name, others by file."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path

import machines
from maze_machine.catalogue.project import find_project
from maze_machine.catalogue.shipped import find_file
from maze_machine.errors import FileError, UsageError

SUFFIX = ".maze-machine"
SHIPPED = Path(next(iter(machines.__path__)))
"""The folder of the machines that come with the project."""


def shipped_machines() -> dict[str, Path]:
    """The machines that come with the project, by name."""
    return {path.name.removesuffix(SUFFIX): path for path in sorted(SHIPPED.glob(f"*{SUFFIX}"))}


def project_machines() -> dict[str, Path]:
    """The machines in the folders of the project around the present folder, by name.

    Raises:
        FileError: the project's settings are wrong.
    """
    project = find_project(Path.cwd())
    folders = () if project is None else project.machines
    return {path.name.removesuffix(SUFFIX): path for folder in folders for path in sorted(folder.glob(f"*{SUFFIX}"))}


def find_machine(name: str) -> Path:
    """The file of a machine.

    Args:
        name: a file, the name of a shipped machine, or that of a machine of the present project.

    Raises:
        FileError: there is neither.
    """
    return find_file("machine", name, project_machines() | shipped_machines())


def named_files(names: Sequence[str]) -> list[str]:
    """The machines that a command is given: a folder means all machines in it and below it.

    Hidden folders, virtual environments and `node_modules` are left out.

    Args:
        names: files, folders and names of machines; without any, those of the project around the present folder.

    Raises:
        UsageError: nothing is named, and there is no project.
        FileError: a folder has no machine, or the project's settings are wrong.
    """
    return [file for name in names or _project_folders() for file in (_below(name) if Path(name).is_dir() else [name])]


def _project_folders() -> list[str]:
    project = find_project(Path.cwd())
    if project is None:
        raise UsageError(
            "no file is named, and this folder has no project",
            "name files, folders or machines, or run the command in a folder with a `maze-machine.toml`",
        )
    return [os.path.relpath(folder) for folder in project.machines or (project.folder,)]


def _below(folder: str) -> list[str]:
    found = list(_walk(Path(folder)))
    if not found:
        raise FileError(f"{folder} has no `{SUFFIX}` file", "name a file, or a folder that has one")
    return found


def _walk(folder: Path) -> Iterator[str]:
    for place, below, files in os.walk(folder):
        below[:] = sorted(name for name in below if not _foreign(Path(place, name)))
        yield from (str(Path(place, name)) for name in sorted(files) if name.endswith(SUFFIX))


def _foreign(folder: Path) -> bool:
    return folder.name.startswith(".") or folder.name == "node_modules" or (folder / "pyvenv.cfg").exists()
