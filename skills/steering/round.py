"""The obstacle between the robot and a target, and the side on which to pass it."""

from __future__ import annotations

import numpy as np

from perception.facts import Facts
from skills.settings import PassageSettings
from skills.sides import Side
from skills.surroundings import Points
from transport.arithmetic import norms
from transport.description import RobotDescription


def in_the_way(points: Points, robot: RobotDescription, distance: float, settings: PassageSettings) -> int | None:
    """Which point is the first in the robot's lane to a target; None where the lane is free.

    Args:
        points: hits in a frame at the robot with x to the target, m, shape (n, 2).
        robot: its width counts.
        distance: of the target, m.
        settings: how far is looked, and what a gap must leave.
    """
    x, y = points[:, 0], points[:, 1]
    lane = np.flatnonzero(
        (np.abs(y) < robot.half_width + settings.spare) & (x > 0) & (x < min(distance, settings.reach))
    )
    return int(lane[x[lane].argmin()]) if len(lane) else None


def shorter_way(facts: Facts, points: Points, nearest: int, settings: PassageSettings) -> Side:
    """The side by which an obstacle ends nearer to the robot's line; rather one where its end is seen.

    Args:
        facts: of the tick.
        points: hits in a frame at the robot with x to the target, counter-clockwise, m, shape (n, 2).
        nearest: which of them is the obstacle's.
        settings: what a gap must leave.
    """
    gaps = np.flatnonzero(norms(*np.diff(points, axis=0).T) > 2 * (facts.robot.half_width + settings.spare))
    first = int(gaps[gaps < nearest].max(initial=-1)) + 1
    last = int(gaps[gaps >= nearest].min(initial=len(points) - 1))
    y = points[first : last + 1, 1]
    to_the_left = (last == len(points) - 1 and bool(facts.sweep.hit[-1]), float(y.max()))
    to_the_right = (first == 0 and bool(facts.sweep.hit[0]), -float(y.min()))
    return Side.LEFT if to_the_left <= to_the_right else Side.RIGHT
