"""The way ahead between the walls: how far it is free, and how far aside its bounds are."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from perception.facts import Facts
from skills.settings import PassageSettings, SkillSettings
from skills.surroundings import Points
from transport.arithmetic import cos_sin
from transport.compiled import compiled
from transport.description import RobotDescription

DENSE = math.radians(0.3)
"""Of beams closer together than this, every second one is used, rad."""

Gap = tuple[float, float]
NOWHERE: Gap = (-math.inf, math.inf)
"""The gap that nothing bounds."""


@dataclass(frozen=True, slots=True)
class Passage:
    """The free gap that the robot drives in, in a frame at the robot along its course.

    Attributes:
        ahead: free way in front of the robot's centre, in a lane as wide as the robot, m.
        right: y of the right bound, m; ``-math.inf`` where nothing bounds it within reach.
        left: y of the left bound, m; ``math.inf`` where nothing bounds it within reach.
    """

    ahead: float
    right: float
    left: float

    def bound(self, sign: int) -> float:
        """Distance to the left bound (sign +1) or the right one (-1), m."""
        return self.left if sign > 0 else -self.right

    @property
    def width(self) -> float:
        """From bound to bound, m."""
        return self.left - self.right


def points_along(facts: Facts, error: float, settings: PassageSettings) -> Points:
    """The hits near the robot in a frame at the robot turned by the course's ``error``, m, shape (n, 2)."""
    points = facts.sweep.points[:: 2 if facts.observation.scan.geometry.spacing < DENSE else 1]
    return turned_near(points, cos_sin(error), settings.reach)


@compiled
def turned_near(points: Points, turn: tuple[float, float], reach: float) -> Points:
    """The points within a square around the robot, in a frame turned from its own, m, shape (k, 2).

    Args:
        points: in the robot's frame, m, shape (n, 2).
        turn: cosine and sine of the turn.
        reach: half the width of the square, m.
    """
    points = points[np.abs(points).max(axis=1) < reach]
    cos, sin = turn
    x, y = points[:, 0], points[:, 1]
    return np.column_stack([cos * x + sin * y, cos * y - sin * x])


def passage_of(points: Points, robot: RobotDescription, look_ahead: float, settings: PassageSettings) -> Passage:
    """The passage in which the robot drives.

    Of the gaps between what is seen up to ``look_ahead`` in front, the nearest one that the robot can reach and fits
    into; where something closes the way before that, the gap in front of it.

    Args:
        points: hits in the frame of the course, m, shape (n, 2).
        robot: its width counts.
        look_ahead: m.
        settings: what bounds a passage.
    """
    half = robot.half_width
    limits = half, look_ahead, settings.alongside, settings.aside, 2 * (half + settings.spare)
    return Passage(*passage_between(points, limits))


@compiled
def passage_between(points: Points, limits: tuple[float, float, float, float, float]) -> tuple[float, float, float]:
    """How far the way ahead is free and the bounds of the gap in it, m: see `passage_of`.

    Args:
        points: hits in the frame of the course, m, shape (n, 2).
        limits: half the robot's width, how far to look ahead, how much before what is ahead a gap ends, how far aside a
            gap may be, and how wide it must be, m.
    """
    x, y = points[:, 0], points[:, 1]
    half, look_ahead, alongside, aside, width = limits
    faced = x[(np.abs(y) < half) & (x > 0)]
    ahead = float(faced.min()) if len(faced) else math.inf
    beside = x > -half
    here = beside & (x < min(max(ahead - alongside, 0.0), look_ahead))
    around = _gap(y[here], NOWHERE, 0.0, aside) or NOWHERE
    farther = _gap(y[beside & (x < look_ahead)], around, width, aside)
    return (ahead, *(farther or around))


def off_the_walls(passage: Passage, settings: SkillSettings) -> float:
    """How far to the left of the robot the line lies that keeps off the walls of a passage, m.

    The middle of a corridor; in a wider space the robot's own line, unless a wall is too near.
    """
    keep_off = settings.wall.keep_off
    if passage.width < settings.wall.corridor:
        return (passage.left + passage.right) / 2
    room_left, room_right = passage.left - keep_off, -passage.right - keep_off
    return min(room_left, 0.0) - min(room_right, 0.0)


def _gap(y: np.ndarray[tuple[int, ...], np.dtype[np.float64]], within: Gap, width: float, aside: float) -> Gap | None:
    """The gap of at least ``width`` between neighbouring values, cut to a gap around it, that is nearest to zero.

    One farther from zero than ``aside`` is none.
    """
    low, high = within
    edges = np.concatenate([[low], np.sort(y[(y > low) & (y < high)]), [high]])
    wide = np.flatnonzero(np.diff(edges) >= width)
    if not len(wide):
        return None
    distance = np.maximum(np.maximum(edges[wide], -edges[wide + 1]), 0)
    nearest = int(distance.argmin())
    if distance[nearest] > aside:
        return None
    return float(edges[wide[nearest]]), float(edges[wide[nearest] + 1])
