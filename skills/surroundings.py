"""Points near the robot on all sides: from the newest scan, and behind it from earlier scans."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from perception.facts import Facts
from perception.sweep import ScanPoints
from skills.frames import Frame
from transport.arithmetic import cos_sin, norms
from transport.messages import Pose

Points = NDArray[np.float64]

STRIDE = 3  # at the distances that matter the beams are far denser than any wall is thin, unless it points at the robot
REMEMBERED = 400  # points; a full turn in a narrow corridor leaves fewer


class Surroundings:
    """Points near the robot, kept by odometry while they are in the laser's blind sector.

    The laser sees two radians to either side. A wall that leaves its view does not go away: the robot's rear corners
    sweep past it when the robot turns. Over the metre or so for which a point is kept, odometry is far more exact than
    the margins that the points are needed for. A laser that sees all round has no blind sector, and nothing is kept.
    """

    def __init__(self, reach: float) -> None:
        self._reach = reach
        self._last: tuple[Pose, Points] | None = None

    def update(self, facts: Facts) -> Points:
        """Process a tick and return all points within reach, in the robot's frame, m, shape (n, 2)."""
        pose = facts.observation.odometry.pose
        points = np.concatenate([near_points(facts.sweep, self._reach), self._behind(facts.sweep, pose)])
        self._last = pose, points
        return points

    def _behind(self, sweep: ScanPoints, pose: Pose) -> Points:
        """The points of earlier ticks that the laser cannot see now."""
        if self._last is None:
            return np.empty((0, 2))
        before, points = self._last
        motion = Frame(before).local(pose)
        cos, sin = cos_sin(motion.heading)
        dx, dy = points[:, 0] - motion.x, points[:, 1] - motion.y
        moved = np.column_stack([cos * dx + sin * dy, cos * dy - sin * dx])
        near = norms(moved[:, 0], moved[:, 1]) < self._reach
        return np.asarray(moved[sweep.fan.blind(moved) & near][-REMEMBERED:])


def near_points(sweep: ScanPoints, reach: float) -> Points:
    """The nearest hits of every three beams within ``reach`` (m) of the sensor, in the robot's frame, shape (n, 2)."""
    count = len(sweep.ranges) // STRIDE * STRIDE
    ranges = np.where(sweep.ranges[:count] < reach, sweep.ranges[:count], math.inf).reshape(-1, STRIDE)
    nearest = ranges.argmin(axis=1)
    rows = np.flatnonzero(np.isfinite(ranges).any(axis=1))
    beams = rows * STRIDE + nearest[rows]
    near, fan = sweep.ranges[beams], sweep.fan
    return np.column_stack([fan.mount.x + near * fan.cosines[beams], fan.mount.y + near * fan.sines[beams]])
