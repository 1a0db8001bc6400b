"""Where machines are found: the shipped ones by name, others by file."""

from __future__ import annotations

from difflib import get_close_matches
from pathlib import Path

import machines
from controller.errors import FileError

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
    shipped = shipped_machines()
    if name in shipped:
        return shipped[name]
    path = Path(name)
    if path.is_file():
        return path
    if path.suffix == SUFFIX or path.parent != Path():
        raise FileError(f"there is no machine file {name}")
    raise FileError(f"there is no machine `{name}`", _suggestion(name, shipped))


def _suggestion(name: str, shipped: dict[str, Path]) -> str:
    close = get_close_matches(name, shipped, n=1)
    listed = f"shipped machines: {', '.join(shipped)}"
    return f"did you mean `{close[0]}`? ({listed})" if close else f"give a {SUFFIX} file or a name; {listed}"
