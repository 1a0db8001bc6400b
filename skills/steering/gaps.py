"""The way to a point for a base that cannot move aside: towards the direction in which the way is free for longest."""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from perception.facts import Facts, turned
from skills.passage import off_the_walls, passage_of
from skills.settings import SkillSettings
from skills.surroundings import Points
from transport.arithmetic import atan2, cosines_and_sines, norm, norms
from transport.description import RobotDescription
from transport.messages import Twist
from transport.section import Point

DIRECTIONS = np.radians(np.arange(-130, 131, 5))
_COSINES, _SINES = cosines_and_sines(DIRECTIONS)
"""The directions that are compared, from that to the target, rad."""
SHUT = 3.0
"""As much as a direction is worse which is not free at all, it may be off the target, rad."""
TIGHT = 0.5
"""The same of one where the robot fits but cannot keep its distance from the walls, rad."""
OTHER_SIDE = 2.0
"""The same of one that rounds something by the other side than before, rad."""


class Along(Protocol):
    """A law that drives along a course."""

    def along(self, error: float, speed: float, aside: float, ahead: float) -> Twist:
        """The velocity along a course that lies so far (rad) to the left of the heading."""
        ...


class GapSeeker:
    """Compares directions by how far the robot's lane is free in each, and drives along the best one.

    A potential field does for a base that can follow the sum of its forces at once; this one would have turned only
    when the sum points elsewhere. The side by which something is rounded is kept until the way to the target is free.
    """

    def __init__(self, robot: RobotDescription, settings: SkillSettings, law: Along, speed: float) -> None:
        self._robot, self._settings, self._law, self._speed = robot, settings, law, speed
        self._side = 0.0

    def towards(self, facts: Facts, target: Point) -> Twist:
        """The next velocity on the way to a target in the robot's frame, m."""
        distance, bearing = norm(*target), atan2(target[1], target[0])
        settings, target_settings = self._settings, self._settings.target
        horizon = min(distance, target_settings.horizon)
        points = facts.points[norms(*facts.points.T) < target_settings.horizon + self._robot.radius]
        course = bearing + self._detour(turned(points, -bearing), horizon)
        passage = passage_of(turned(points, -course), self._robot, settings.motion.look_ahead, settings.passage)
        aside = min(1.0, distance / target_settings.near) * off_the_walls(passage, settings)
        speed = min(self._speed, max(target_settings.arrival, settings.motion.lateral_gain * distance))
        return self._law.along(math.remainder(course, math.tau), speed, aside, passage.ahead)

    def _detour(self, points: Points, horizon: float) -> float:
        """How far off the target to drive, rad, by points in a frame with x to the target."""
        half, margin = self._robot.half_width, self._settings.safety.margin
        free = free_ways(points, half + self._settings.passage.spare, horizon)
        roomy = free_ways(points, half + margin, horizon)
        cost = np.abs(DIRECTIONS) + SHUT * (1 - free / horizon) + TIGHT * (1 - roomy / horizon)
        cost = cost + OTHER_SIDE * (np.sign(DIRECTIONS) * self._side < 0)
        best = int(cost.argmin())
        straight = len(DIRECTIONS) // 2
        if free[straight] >= horizon:
            self._side = 0.0
        elif best != straight:
            self._side = float(np.sign(DIRECTIONS[best]))
        return float(DIRECTIONS[best])


def free_ways(points: Points, half_width: float, horizon: float) -> NDArray[np.float64]:
    """How far a lane of some width is free in each of the directions, up to the horizon, m.

    Args:
        points: hits in a frame at the robot with x to the target, m, shape (n, 2).
        half_width: of the lane, m.
        horizon: m.
    """
    cos, sin = _COSINES[:, None], _SINES[:, None]
    x = cos * points[:, 0] + sin * points[:, 1]
    y = cos * points[:, 1] - sin * points[:, 0]
    ahead = np.where((np.abs(y) < half_width) & (x > 0), x, horizon)
    return np.asarray(np.minimum(ahead.min(axis=1, initial=horizon), horizon))
