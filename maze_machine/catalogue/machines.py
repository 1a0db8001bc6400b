"""Where machines are found: the shipped ones by name, others by file."""

from __future__ import annotations

from pathlib import Path

import machines
from maze_machine.catalogue.shipped import find_file

SUFFIX = ".maze-machine"
SHIPPED = Path(next(iter(machines.__path__)))
"""The folder of the machines that come with the project."""


def shipped_machines() -> dict[str, Path]:
    """The machines that come with the project, by name."""
    return {path.name.removesuffix(SUFFIX): path for path in sorted(SHIPPED.glob(f"*{SUFFIX}"))}


def find_machine(name: str) -> Path:
    """The file of a machine.

    Args:
        name: a file, or the name of a shipped machine.

    Raises:
        FileError: there is neither.
    """
    return find_file("machine", name, shipped_machines())
