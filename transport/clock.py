"""Monotonic time, and a schedule kept on it."""

from __future__ import annotations

import time
from typing import Protocol


class Clock(Protocol):
    """Time that never goes back."""

    def now(self) -> float:
        """Seconds since some moment."""
        ...

    def wait(self, seconds: float) -> None:
        """Let this much time pass."""
        ...


class MonotonicClock:
    """The computer's own."""

    def now(self) -> float:
        """Seconds since some moment."""
        return time.monotonic()

    def wait(self, seconds: float) -> None:
        """Sleep."""
        time.sleep(seconds)


class Pace:
    """A beat that does not drift: a caller that is too late for one beat is counted, and continues with the next.

    Attributes:
        overruns: how many beats were missed.
    """

    def __init__(self, period: float, clock: Clock) -> None:
        self.overruns = 0
        self._period, self._clock = period, clock
        self._next = clock.now()

    def due(self) -> float:
        """Time until the next beat, s; not positive where it has come."""
        return self._next - self._clock.now()

    def beat(self) -> None:
        """Take the present beat, and drop those that are over already."""
        missed = max(0, int(-self.due() / self._period))
        self.overruns += missed
        self._next += (missed + 1) * self._period

    def wait(self) -> None:
        """Wait for the next beat and take it."""
        while (left := self.due()) > 0:
            self._clock.wait(left)
        self.beat()
