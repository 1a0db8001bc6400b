"""An opening beside the robot, measured while the robot drives past its near corner."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from skills.frames import Frame
from skills.settings import OpeningSettings
from skills.sides import Side
from skills.surroundings import Points
from transport.description import RobotDescription
from transport.messages import Pose


@dataclass(slots=True)
class Opening:
    """Where an opening on one side begins and ends, along the course, in a local frame set when it was found.

    Attributes:
        frame: where the robot was then, x along the course.
        side: at which side it is.
        near: x of the end of the wall before it, m.
        passed: whether that wall's end is out of sight, behind; ``near`` is where the robot was then.
        aside: how far to the side that wall was, m.
        half_width: of the robot, m.
        settings: what an opening is.
        far: x of the first thing that bounds it at its far side or is in the robot's way, m.
    """

    frame: Frame
    side: Side
    near: float
    aside: float
    half_width: float
    settings: OpeningSettings
    passed: bool = False
    far: float = math.inf

    def driven(self, pose: Pose) -> float:
        """How far the robot has driven since, m."""
        return self.frame.local(pose).x

    def update(self, points: Points, pose: Pose) -> None:
        """Measure the far side again, which is seen better the nearer the robot gets.

        Args:
            points: hits in a frame at the robot along the course, m.
            pose: of the robot by odometry.
        """
        settings, (x, y) = self.settings, (points[:, 0], points[:, 1] * self.side.sign)
        beyond = max(settings.near_corner, self.near - self.driven(pose) + settings.smallest / 2)
        bounds = x[(y > -self.half_width) & (y < settings.into) & (x > beyond)]
        self.far = self.driven(pose) + (float(bounds.min()) if len(bounds) else 2 * settings.into)

    def middle(self, farthest: float) -> float:
        """Where the opening's middle is along the course, at most ``farthest`` (m) past its near corner.

        Of an opening whose near corner is out of sight it is as far before the far side, where that is near: the wall
        there is the only one to keep to in the way behind the opening.
        """
        before_far = self.far - farthest
        if self.passed and farthest < before_far < self.settings.into:
            return before_far
        return self.near + min(farthest, (self.far - self.near) / 2)


def opening_of(
    points: Points, robot: RobotDescription, side: Side, course: Pose, settings: OpeningSettings, *, least: float
) -> Opening:
    """The opening that begins beside the robot, or ahead where the wall beside it ends.

    One that the robot has nearly passed counts only where no other one follows soon.

    Args:
        points: hits in a frame at the robot along its course, m.
        robot: its width counts.
        side: at which side.
        course: the robot's place by odometry, with the heading of its course.
        settings: what an opening is.
        least: so far ahead its far side must be, so that the robot can still turn into it, m.
    """
    x, y = points[:, 0], points[:, 1] * side.sign
    bounds = (y > robot.half_width / 2) & (y < settings.into) & (x > -settings.behind)
    near, aside = 0.0, settings.into
    passed = not (bounds & (x < settings.near_corner)).any()
    beside = y[bounds & (x < (least if passed else settings.near_corner))]
    if len(beside):
        level = float(beside.min())
        wall = np.sort(x[(np.abs(y - level) < settings.same_wall) & (x > -settings.behind)])
        first, fitting = _beginnings(wall, settings, least)
        soon = fitting < settings.into
        if soon or not passed:
            near, aside, passed = fitting if soon else first, level, False
    return Opening(Frame(course), side, near, aside, robot.half_width, settings, passed)


def _beginnings(wall: NDArray[np.float64], settings: OpeningSettings, least: float) -> tuple[float, float]:
    """Where the first opening in a wall begins, and the first one whose far side is far enough ahead, m.

    Args:
        wall: x of the hits on it, rising, m, shape (n,), one at least.
        settings: what an opening is.
        least: so far ahead the far side must be, m.
    """
    ends = np.append(np.flatnonzero(np.diff(wall) > settings.smallest), len(wall) - 1)
    far = np.append(wall, math.inf)[ends + 1]
    return float(wall[ends[0]]), float(wall[ends[far >= least][0]])
