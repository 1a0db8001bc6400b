"""An opening beside the robot, measured while the robot drives past its near corner."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

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
        """Where the opening's middle is along the course, at most ``farthest`` (m) past its near corner."""
        return self.near + min(farthest, (self.far - self.near) / 2)


def opening_of(points: Points, robot: RobotDescription, side: Side, course: Pose, settings: OpeningSettings) -> Opening:
    """The opening that begins beside the robot, or ahead where the wall beside it ends.

    Args:
        points: hits in a frame at the robot along its course, m.
        robot: its width counts.
        side: at which side.
        course: the robot's place by odometry, with the heading of its course.
        settings: what an opening is.
    """
    x, y = points[:, 0], points[:, 1] * side.sign
    back = x > -settings.behind
    beside = (y > robot.half_width / 2) & (y < settings.into) & (x < settings.near_corner) & back
    near, aside = 0.0, settings.into
    if beside.any():
        aside = float(y[beside].min())
        wall = np.sort(x[(np.abs(y - aside) < settings.same_wall) & back])
        ends = wall[:-1][np.diff(wall) > settings.smallest]
        near = float(ends[0] if len(ends) else wall[-1])
    return Opening(Frame(course), side, near, aside, robot.half_width, settings)
