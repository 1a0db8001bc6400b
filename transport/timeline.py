"""The time of a run on a robot whose own clock may be set back, jump or stand still."""

from __future__ import annotations

from collections import Counter

from transport.messages import NANOSECONDS

JUMP = NANOSECONDS
"""A step of the robot's stamps that differs by more than this from the time that has passed here is a jump, ns."""


class Timeline:
    """Makes stamps of ticks from a robot's stamps: they never go back, and never jump.

    While the robot's clock runs normally, its stamps are used unchanged. If it is set back, jumps by more than a second
    or stops, the time that has passed on this side is added instead, and the robot's stamps count from there. Without
    messages, time continues by this side's clock, so that time limits apply.

    Attributes:
        faults: how often the robot's clock misbehaved, by what it did.
    """

    def __init__(self, patience: float) -> None:
        """Args: the silence after which time continues by this side's clock, s."""
        self.faults: Counter[str] = Counter()
        self._patience = patience
        self._time: int | None = None
        self._stamp = self._offset = 0
        self._now = self._moved_at = 0.0

    def tick(self, stamp: int, now: float, *, fresh: bool) -> int:
        """The stamp of a tick, ns.

        Args:
            stamp: the robot's newest stamp, ns.
            now: this side's monotonic clock, s.
            fresh: whether anything has come since the last tick.
        """
        if self._time is None:
            self._time, self._moved_at = stamp, now
        else:
            expected = self._time + round((now - self._now) * NANOSECONDS)
            if stamp != self._stamp:
                self._time = self._followed(stamp, expected)
            elif now - self._moved_at > self._patience:
                self._time = expected
                # A stopped clock is detected at every tick but counts as one fault.
                self.faults.update(["stood still"] if fresh and "stood still" not in self.faults else [])
        if stamp != self._stamp:
            self._stamp, self._moved_at = stamp, now
        self._now = now
        return self._time

    def _followed(self, stamp: int, expected: int) -> int:
        assert self._time is not None
        time = stamp + self._offset
        back = stamp < self._stamp
        if back or abs(time - expected) > JUMP:
            self.faults["was set back" if back else "jumped"] += 1
            self._offset, time = expected - stamp, expected
        return max(time, self._time)
