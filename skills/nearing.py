"""Whether what is ahead comes nearer by itself."""

from __future__ import annotations

import math
from collections import deque

NOTICED, LONGEST = 0.4, 1.0
"""The time over which it is measured, at least and at most, s."""
SLOWEST = 0.05
"""What seems to come nearer slower than this is noise, m/s."""
FASTEST = 0.6
"""What comes nearer faster than this share of the robot's top speed is something else that has come into view."""


class Nearing:
    """How fast something ahead comes nearer to a robot that may move itself.

    Attributes:
        watched: whether it has been examined for long enough.
    """

    def __init__(self, top_speed: float) -> None:
        """Args: the robot's top speed, m/s."""
        self._fastest = FASTEST * top_speed
        self.watched = False
        self._seen: deque[tuple[float, float]] = deque()

    def update(self, time: float, place: float) -> float:
        """Take in where it is now, and return its speed towards the robot, m/s; 0 where that is not known or noise.

        Args:
            time: s.
            place: on the robot's line, in a frame that does not move, m; infinite where there is nothing.
        """
        if not math.isfinite(place):
            self._seen.clear()
            self.watched = False
            return 0.0
        self._seen.append((time, place))
        while self._seen[0][0] < time - LONGEST:
            self._seen.popleft()
        before, there = self._seen[0]
        self.watched = time - before >= NOTICED
        if not self.watched:
            return 0.0
        speed = (there - place) / (time - before)
        return speed if SLOWEST < speed < self._fastest else 0.0
