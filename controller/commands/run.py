"""``maze-machine run``: a machine drives a robot."""

from __future__ import annotations

from typing import Annotated

import typer


def run(
    machine: Annotated[str, typer.Argument(help="A .maze-machine file, or the name of a shipped machine.")],
) -> None:
    """Run a machine on a robot until it ends.

    Example: `maze-machine run pledge --seed 3`
    """
    raise NotImplementedError(machine)
