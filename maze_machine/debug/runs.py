"""The interface of a run for a debugger: a growing list of steps, independent of the debugger's position."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from maze_machine.debug.chart import Chart
from maze_machine.debug.steps import Step


class RunError(Exception):
    """A request that a run cannot execute, or a fault in it; the message says what."""


class Run(Protocol):
    """One run of a machine so far."""

    @property
    def chart(self) -> Chart:
        """The machine."""
        ...

    @property
    def steps(self) -> Sequence[Step]:
        """Its steps so far; there is at least one once ``advance`` has given one."""
        ...

    @property
    def quiet(self) -> bool:
        """Whether it waits for a change."""
        ...

    @property
    def fixed(self) -> str:
        """Why nothing in it can be changed; empty where it can."""
        ...

    @property
    def over(self) -> str:
        """Why no more steps come; empty while they may."""
        ...

    def advance(self) -> bool:
        """Compute one more step, if there is one now.

        Raises:
            RunError: the machine failed.
        """
        ...

    def forget(self) -> int:
        """Drop old steps if there are too many; return how many were dropped."""
        ...

    def pending(self) -> Mapping[str, str]:
        """Signals that get another value in the next step."""
        ...

    def change(self, step: int, name: str, value: str) -> None:
        """Give a signal or a variable another value, from a step on; later steps are dropped.

        Raises:
            RunError: it cannot be changed, or not to that.
        """
        ...

    def tell(self, step: int, line: str) -> str:
        """Execute a typed line, and return the result.

        Raises:
            RunError: it is not possible.
        """
        ...

    def hold(self) -> None:
        """Pause the run itself, if it runs by itself and can be paused."""
        ...

    def go(self, ticks: int | None) -> None:
        """Resume a run that runs by itself, for some ticks or until it is paused."""
        ...

    def close(self) -> None:
        """Release everything."""
        ...
