"""What a debugger asks of a run: a list of steps that grows; where the debugger is in it, it does not know."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from maze_machine.debug.chart import Chart
from maze_machine.debug.steps import Step


class RunError(Exception):
    """Something that a run cannot do, or that went wrong in it; the message says what."""


class Run(Protocol):
    """One run of a machine, as far as it has come."""

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
        """Whether nothing more happens in it until somebody changes something."""
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
        """Have one more step, if there is one now.

        Raises:
            RunError: the machine failed.
        """
        ...

    def forget(self) -> int:
        """Drop old steps where they become too many; how many were dropped."""
        ...

    def pending(self) -> Mapping[str, str]:
        """Signals that are given another value in the next step."""
        ...

    def change(self, step: int, name: str, value: str) -> None:
        """Give a signal or a variable another value, from a step on: what came after it is gone.

        Raises:
            RunError: it cannot be changed, or not to that.
        """
        ...

    def tell(self, step: int, line: str) -> str:
        """Do a line that a person has typed, and say what came of it.

        Raises:
            RunError: it cannot be done.
        """
        ...

    def hold(self) -> None:
        """Have the run itself stand still, where it continues by itself and can stand still."""
        ...

    def go(self, ticks: int | None) -> None:
        """Have a run that is still running by itself do so, for some ticks or until it is held."""
        ...

    def close(self) -> None:
        """Release everything."""
        ...
