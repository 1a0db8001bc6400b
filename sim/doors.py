"""A door at work: shut, sliding open, open, sliding shut."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from sim.maze import MazeDoor, Segments


class SlidingDoor:
    """The running state of one door."""

    def __init__(self, door: MazeDoor) -> None:
        self.door = door
        self.stuck = False
        """Whether it is stuck."""
        self.shift = 0.0
        """How far it has slid, m: from zero, shut, to its length, open."""
        self.has_opened = False
        """Whether it was ever wide open."""
        self._opening = False
        self._closes_in = math.inf
        (ax, ay), (bx, by) = door.leaf
        self._leaf = np.array([[ax, ay, bx, by]])
        self._axis = ((bx - ax) / door.length, (by - ay) / door.length)

    def ask(self) -> None:
        """A valid ring: it opens, and then stays open for its full time."""
        self._opening = True
        self._closes_in = self.door.stays

    def velocity(self, duration: float, occupied: Callable[[], bool]) -> tuple[float, float]:
        """Slide for a while and return the velocity.

        Args:
            duration: how long, s.
            occupied: whether the doorway is occupied; an open door waits for that before it closes.

        Returns:
            The leaf's mean velocity along x and y, m/s.
        """
        if self.stuck:
            return 0.0, 0.0
        before = self.shift
        travel = self.door.speed * duration
        if self._opening:
            self.shift = min(self.shift + travel, self.door.length)
            if self.door.length - self.shift < 1e-9:
                self.shift = self.door.length
                self.has_opened = True
                self._closes_in -= duration
                if self._closes_in <= 0.0 and not occupied():
                    self._opening = False
        else:
            self.shift = self.shift - travel if self.shift - travel > 1e-9 else 0.0
        speed = (self.shift - before) / duration
        return speed * self._axis[0], speed * self._axis[1]

    @property
    def at_rest(self) -> bool:
        """Whether nothing will change without a ring."""
        shut = not self._opening and self.shift == 0.0
        wide_open = self._opening and self.shift == self.door.length
        return self.stuck or shut or (wide_open and math.isinf(self._closes_in))

    def leaf(self) -> Segments:
        """Where the leaf is now, shape (1, 4)."""
        dx, dy = self.shift * self._axis[0], self.shift * self._axis[1]
        moved: Segments = self._leaf + np.array([dx, dy, dx, dy])
        return moved

    def doorway(self) -> Segments:
        """Where the leaf is when it is shut, shape (1, 4)."""
        return self._leaf
