"""A run that a person follows and operates in the terminal where the command was given."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from importlib.util import find_spec
from typing import TYPE_CHECKING

from maze_machine.errors import UsageError, missing_package

if TYPE_CHECKING:
    from maze_machine.drive.attempts import Attempt
    from maze_machine.remote.operated import OperatedRun
    from maze_machine.report.terminal import TerminalRun
    from maze_machine.simulated.world import SimulatedWorld


def terminal_run(*, view: bool) -> TerminalRun:
    """What a terminal shows of a run.

    Raises:
        UsageError: Textual is not installed, there is no terminal, or a page is asked for, too.
    """
    if view:
        raise UsageError(
            "--tui cannot be combined with --view", "open the run with --open, and use `maze-machine view`"
        )
    if find_spec("textual") is None:
        raise missing_package("--tui", "Textual", "tui")
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        raise UsageError("--tui needs a terminal", "by ssh give it one: ssh -t HOST maze-machine run ... --tui")
    from maze_machine.report.terminal import TerminalRun

    return TerminalRun()


def in_terminal(
    name: str, shown: TerminalRun, world: SimulatedWorld | None, operated: OperatedRun, attempts: Iterable[Attempt]
) -> list[Attempt]:
    """Make attempts while the terminal shows them, until a person leaves it.

    Args:
        name: the machine's name.
        shown: the watcher of the ticks.
        world: where it takes place, if that is in this process: its walls are drawn.
        operated: the run's operator.
        attempts: makes each attempt when it is asked for.
    """
    from maze_machine.report.terminal import RunTerminal

    made: list[Attempt] = []
    walls = [] if world is None else world.maze.barriers.tolist()
    terminal = RunTerminal(name, shown, walls, operated.answer, lambda: made.extend(attempts))
    terminal.run()
    if terminal.failure is not None:
        raise terminal.failure
    return made
