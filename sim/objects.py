"""A moving object at work: it waits, goes along its path, comes back or stays."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from sim.geometry import edges
from sim.maze import MovingObject, Point, Segments
from transport.arithmetic import distance_between


class MovingObstacle:
    """The running state of one moving object."""

    def __init__(self, thing: MovingObject) -> None:
        self.thing = thing
        self.halted = False
        self._outline = np.asarray(thing.outline, dtype=np.float64)
        self._lengths = [distance_between(*leg) for leg in pairwise(thing.path)]
        self._way = math.fsum(self._lengths)
        self._travelled = 0.0
        self._direction = 1
        self._waiting = math.isfinite(thing.near)
        self.place: Point = thing.path[0]
        """Where its origin is, m."""

    def velocity(self, duration: float, robots: Sequence[Point]) -> Point:
        """Move for a while and return the velocity.

        Args:
            duration: how long, s.
            robots: where the robots are; one near enough sets it off.

        Returns:
            Its mean velocity along x and y, m/s.
        """
        if self._waiting:
            self._waiting = all(distance_between(self.place, robot) > self.thing.near for robot in robots)
        if self._waiting or self.halted or self._way == 0.0:
            return 0.0, 0.0
        self._travelled += self._direction * self.thing.speed * duration
        if not 0.0 <= self._travelled <= self._way:
            end = self._way if self._direction > 0 else 0.0
            # A distance beyond the end of the path is already travelled back.
            self._travelled = 2 * end - self._travelled if self.thing.returns else end
            self._direction = -self._direction if self.thing.returns else 0
            if not 0.0 <= self._travelled <= self._way:  # the step is longer than the whole path
                lap = math.fmod(abs(self._travelled), 2 * self._way)
                self._travelled = min(lap, 2 * self._way - lap)
        before, self.place = self.place, self._at(self._travelled)
        return (self.place[0] - before[0]) / duration, (self.place[1] - before[1]) / duration

    def _at(self, travelled: float) -> Point:
        for leg, length in enumerate(self._lengths):
            if travelled <= length:
                (ax, ay), (bx, by) = self.thing.path[leg], self.thing.path[leg + 1]
                part = travelled / length
                return ax + part * (bx - ax), ay + part * (by - ay)
            travelled -= length
        return self.thing.path[-1]

    def sides(self) -> Segments:
        """Its sides where it is now, shape (corners, 4)."""
        return edges(self._outline + np.asarray(self.place))
