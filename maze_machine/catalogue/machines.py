"""Find machines: those of the present project and the shipped ones by name, others by file."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import machines
from hsm.dsl.syntax.sources import SUFFIX, files_in
from maze_machine.catalogue.project import find_project
from maze_machine.catalogue.shipped import find_file
from maze_machine.errors import FileError, UsageError

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


def named_machines() -> dict[str, Path]:
    """The machines that have a name: the shipped ones, and those of the present project, which come first.

    Raises:
        FileError: the project's settings are wrong.
    """
    return shipped_machines() | project_machines()


def find_machine(name: str) -> Path:
    """The file of a machine.

    Args:
        name: a file, the name of a machine of the present project, or that of a shipped one.

    Raises:
        FileError: there is neither.
    """
    return find_file("machine", name, named_machines())


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
    found = [str(path) for path in files_in(Path(folder), SUFFIX)]
    if not found:
        raise FileError(f"{folder} has no `{SUFFIX}` file", "name a file, or a folder that has one")
    return found
