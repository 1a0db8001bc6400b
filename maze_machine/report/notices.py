"""What a person is told at once while a machine drives: that the robot was stopped because of its sensors, and why."""

from __future__ import annotations

from rich.console import Console

from maze_machine.drive.loop import Tick


class Notices:
    """Prints a line when the loop stops the base, and one when it lets it go on; a watcher of ticks."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._began: float | None = None
        self._blind = False

    def __call__(self, tick: Tick) -> None:
        """Take in a tick."""
        self._began = tick.time if self._began is None else self._began
        if bool(tick.blind) != self._blind:
            self._blind = bool(tick.blind)
            what = f"the base was stopped: {tick.blind}" if self._blind else "the base may move again"
            self._console.print(f"{tick.time - self._began:.1f} s: {what}", highlight=False, soft_wrap=True)
