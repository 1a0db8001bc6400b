"""The progress line on a terminal while a machine drives."""

from __future__ import annotations

from time import perf_counter
from types import TracebackType

from rich.console import Console
from rich.live import Live
from rich.text import Text

from maze_machine.drive.tick import Tick

REFRESH = 0.1
"""Time between two updates, s of the wall clock."""


NAME = 28
"""The longest part of a state's name that keeps the line below 80 characters."""


def cut(name: str, longest: int) -> str:
    """A state's name, or the end of one that is too long."""
    return name if len(name) <= longest else f"...{name[3 - longest :]}"


class ProgressDisplay:
    """Shows simulated time, state path, position and the speed of the simulation; a watcher of ticks.

    Where the console is not a terminal, nothing is shown.
    """

    def __init__(self, console: Console) -> None:
        self._shown = console.is_terminal
        self._live = Live(console=console, auto_refresh=False, transient=True)
        self._first: tuple[float, float] | None = None
        self._due = 0.0

    def __enter__(self) -> ProgressDisplay:
        if self._shown:
            self._live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        if self._shown:
            self._live.stop()

    def __call__(self, tick: Tick) -> None:
        """Receive a tick; the display is updated a few times a second."""
        now = perf_counter()
        if self._first is None:
            self._first = tick.time, now
        if self._shown and now >= self._due:
            self._due = now + REFRESH
            self._live.update(self._line(tick, now), refresh=True)

    def _line(self, tick: Tick, now: float) -> Text:
        started, began = self._first or (tick.time, now)
        simulated = tick.time - started
        speed = simulated / (now - began) if now > began else 0.0
        pose = tick.pose
        return Text.assemble(
            (f"{simulated:7.1f} s  ", "bold"),
            (f"{cut(tick.doing, NAME):<{NAME}}", "cyan"),
            f"  at {pose.x:6.2f}, {pose.y:6.2f} m  ",
            (f"{speed:5.0f} x real time", "dim"),
        )
