"""Points near the robot on all sides: from the newest scan, and behind it from earlier scans."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from perception.facts import Facts
from perception.sweep import FieldOfView, ScanPoints, out_of_view
from skills.frames import Frame
from transport.arithmetic import cos_sin, norms
from transport.compiled import compiled
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
        pose, sweep = facts.observation.odometry.pose, facts.sweep
        before, points = self._last or (pose, np.empty((0, 2)))
        moved = Frame(before).local(pose)
        motion = moved.x, moved.y, *cos_sin(moved.heading)
        fan = sweep.fan
        if fan.view is None:
            behind = fan.blind(carried_near(points, motion, self._reach))[-REMEMBERED:]
            points = np.concatenate([near_points(sweep, self._reach), behind])
        else:
            beams = sweep.ranges, fan.cosines, fan.sines
            points = seen_and_behind(beams, fan.view, self._reach, points, motion)
        self._last = pose, points
        return points


def near_points(sweep: ScanPoints, reach: float) -> Points:
    """The nearest hits of every three beams within ``reach`` (m) of the sensor, in the robot's frame, shape (n, 2)."""
    fan = sweep.fan
    return nearest_of_beams(sweep.ranges, fan.cosines, fan.sines, fan.place, reach)


@compiled
def nearest_of_beams(
    ranges: Points, cosines: Points, sines: Points, place: tuple[float, float], reach: float
) -> Points:
    """The nearest hit of every three beams, m in the robot's frame, shape (k, 2).

    Args:
        ranges: of the beams, m, shape (n,); NaN where nothing is known.
        cosines: of their directions, shape (n,).
        sines: the same.
        place: the sensor's, m.
        reach: a hit farther from the sensor counts as none, m.
    """
    count = len(ranges) // STRIDE * STRIDE
    near = np.where(ranges[:count] < reach, ranges[:count], math.inf).reshape(-1, STRIDE)
    nearest = near.argmin(axis=1)
    rows = np.flatnonzero(np.isfinite(near).any(axis=1))
    beams = rows * STRIDE + nearest[rows]
    away = ranges[beams]
    return np.column_stack([place[0] + away * cosines[beams], place[1] + away * sines[beams]])


@compiled
def carried_near(points: Points, motion: tuple[float, float, float, float], reach: float) -> Points:
    """Points in the frame of a robot that has moved, those within reach of it, m, shape (k, 2).

    Args:
        points: in the robot's frame before it moved, m, shape (n, 2).
        motion: where the robot is in that frame, m, and cosine and sine of its heading.
        reach: m.
    """
    x, y, cos, sin = motion
    dx, dy = points[:, 0] - x, points[:, 1] - y
    moved = np.column_stack([cos * dx + sin * dy, cos * dy - sin * dx])
    return np.asarray(moved[norms(moved[:, 0], moved[:, 1]) < reach])


@compiled
def seen_and_behind(
    beams: tuple[Points, Points, Points],
    view: FieldOfView,
    reach: float,
    before: Points,
    motion: tuple[float, float, float, float],
) -> Points:
    """`nearest_of_beams`, and of earlier points carried along, those that the laser cannot see, m, shape (k, 2).

    Args:
        beams: the ranges, m, shape (n,), NaN where nothing is known; cosines and sines of their directions.
        view: the sensor's.
        reach: a hit farther from the sensor counts as none, m.
        before: points in the robot's frame before it moved, m, shape (m, 2).
        motion: where the robot is in that frame, m, and cosine and sine of its heading.
    """
    behind = out_of_view(carried_near(before, motion, reach), view)[-REMEMBERED:]
    return np.concatenate([nearest_of_beams(*beams, (view.x, view.y), reach), behind])
