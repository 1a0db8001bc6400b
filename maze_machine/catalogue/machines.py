"""Find machines: the shipped ones by name, others by file."""

from __future__ import annotations

from pathlib import Path

import machines
from maze_machine.catalogue.project import find_project
from maze_machine.catalogue.shipped import find_file

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
