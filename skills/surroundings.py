"""What is near the robot on all sides: the newest scan, and behind it what earlier scans saw there."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from perception.facts import Facts
from skills.frames import Frame
from transport.arithmetic import cosines, norms, sines
from transport.description import Laser
from transport.messages import Pose, Scan, ScanGeometry

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
        motion = Frame(before).local(pose)
        cos, sin = math.cos(motion.heading), math.sin(motion.heading)
        dx, dy = points[:, 0] - motion.x, points[:, 1] - motion.y
        x, y = cos * dx + sin * dy, cos * dy - sin * dx
        blind = ~_seen(x - self._laser.mount_x, y - self._laser.mount_y, self._laser)
        near = norms(x, y) < self._reach
        return np.column_stack([x, y])[blind & near][-REMEMBERED:]


def _seen(x: NDArray[np.float64], y: NDArray[np.float64], laser: Laser) -> NDArray[np.bool_]:
    """Whether points, given from the sensor in the robot's directions, lie in the sector that the laser looks at."""
    first, width = laser.angle_min + laser.mount_heading, laser.angle_max - laser.angle_min
    after_first = math.cos(first) * y - math.sin(first) * x >= 0
    before_last = math.sin(first + width) * x - math.cos(first + width) * y >= 0
    if width >= math.tau:
        return np.ones(len(x), dtype=np.bool_)
    return after_first & before_last if width <= math.pi else after_first | before_last


def near_points(scan: Scan, laser: Laser, reach: float) -> Points:
    """The nearest hits of every three beams within ``reach`` (m) of the sensor, in the robot's frame, shape (n, 2)."""
    ranges = scan.ranges[: len(scan.ranges) // STRIDE * STRIDE].reshape(-1, STRIDE)
    valid = (ranges >= laser.range_min) & (ranges < min(reach, laser.range_max))
    usable = np.where(valid, ranges, np.inf)
    nearest = usable.argmin(axis=1)
    rows = np.flatnonzero(valid.any(axis=1))
    beams = rows * STRIDE + nearest[rows]
    near = ranges[rows, nearest[rows]].astype(np.float64)
    cos, sin = _directions(scan.geometry, laser.mount_heading)
    return np.column_stack([laser.mount_x + near * cos[beams], laser.mount_y + near * sin[beams]])


@lru_cache(maxsize=8)
def _directions(geometry: ScanGeometry, mount_heading: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Cosine and sine of the beams' directions in the robot's frame, each of shape (beams,)."""
    angles = geometry.angles() + mount_heading
    return cosines(angles), sines(angles)
