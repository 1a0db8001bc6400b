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
    """A periodic timer without drift: a period that the caller misses is counted and skipped.

    Attributes:
        overruns: how many periods were missed.
    """

    def __init__(self, period: float, clock: Clock) -> None:
        self.overruns = 0
        self._period, self._clock = period, clock
        self._next = clock.now()

    def due(self) -> float:
        """Time until the next period, s; not positive if it has begun."""
        return self._next - self._clock.now()

    def beat(self) -> None:
        """Start the current period, and skip those that are over already."""
        missed = max(0, int(-self.due() / self._period))
        self.overruns += missed
        self._next += (missed + 1) * self._period

    def wait(self) -> None:
        """Wait for the next period and start it."""
        while (left := self.due()) > 0:
            self._clock.wait(left)
        self.beat()
