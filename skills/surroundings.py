"""What is near the robot on all sides: the newest scan, and behind it what earlier scans saw there."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from perception.facts import Facts
from skills.frames import Frame
from transport.description import Laser
from transport.messages import Pose, Scan

Points = NDArray[np.float64]

STRIDE = 3  # at the distances that matter the beams are far denser than any wall is thin, unless it points at the robot
REMEMBERED = 400  # points; a full turn in a narrow corridor leaves fewer


class Surroundings:
    """Points near the robot, kept by odometry while they are in the laser's blind sector.

    The laser sees two radians to either side. A wall that leaves its view does not go away: the robot's rear corners
    sweep past it when the robot turns. Over the metre or so for which a point is kept, odometry is far more exact than
    the margins that the points are needed for.
    """

    def __init__(self, laser: Laser, reach: float) -> None:
        self._laser = laser
        self._reach = reach
        self._last: tuple[Pose, Points] | None = None

    def update(self, facts: Facts) -> Points:
        """Take in a tick and return all points within reach, in the robot's frame, m, shape (n, 2)."""
        pose = facts.observation.odometry.pose
        seen = near_points(facts.observation.scan, self._laser, self._reach)
        points = np.concatenate([seen, self._behind(pose)])
        self._last = pose, points
        return points

    def _behind(self, pose: Pose) -> Points:
        """The points of earlier ticks that the laser cannot see now."""
        if self._last is None:
            return np.empty((0, 2))
        before, points = self._last
        matrix = Frame(Frame(before).local(pose)).matrix()
        moved = points @ matrix[:2, :2].T + matrix[:2, 2]
        x, y = moved[:, 0] - self._laser.mount_x, moved[:, 1] - self._laser.mount_y
        direction = np.arctan2(y, x) - self._laser.mount_heading
        direction = (direction + np.pi) % (2 * np.pi) - np.pi
        blind = (direction < self._laser.angle_min) | (direction > self._laser.angle_max)
        near = np.hypot(moved[:, 0], moved[:, 1]) < self._reach
        return np.asarray(moved[blind & near][-REMEMBERED:])


def near_points(scan: Scan, laser: Laser, reach: float) -> Points:
    """The nearest hits of every three beams within ``reach`` (m) of the sensor, in the robot's frame, shape (n, 2)."""
    ranges = scan.ranges[: len(scan.ranges) // STRIDE * STRIDE].reshape(-1, STRIDE)
    valid = (ranges >= laser.range_min) & (ranges < min(reach, laser.range_max))
    usable = np.where(valid, ranges, np.inf)
    nearest = usable.argmin(axis=1)
    rows = np.flatnonzero(valid.any(axis=1))
    beams = rows * STRIDE + nearest[rows]
    near = ranges[rows, nearest[rows]].astype(np.float64)
    angles = scan.geometry.angles()[beams] + laser.mount_heading
    return np.column_stack([laser.mount_x + near * np.cos(angles), laser.mount_y + near * np.sin(angles)])
