"""An opening beside the robot, measured while the robot drives past its near corner."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from skills.frames import Frame
from skills.sides import Side
from skills.surroundings import Points
from transport.description import RobotDescription
from transport.messages import Pose

NEAR_CORNER = 0.15
"""What lies farther ahead than this belongs to the far side of the opening, m."""
SMALLEST = 0.45
"""What is narrower than this is no opening for the robot, m."""
SAME_WALL = 0.2
"""How far aside from the wall beside the robot its continuation may lie, m."""
INTO = 1.0
"""How far aside the bounds of the opening are looked for, m."""
BEHIND = 0.5
"""What lies farther back than this is not the wall beside the robot, m: PICO's laser sees no farther back there."""


@dataclass(slots=True)
class Opening:
    """Where an opening at a side begins and ends, along the course, in a local frame set when it was found.

    Attributes:
        frame: where the robot was then, x along the course.
        side: at which side it is.
        near: x of the end of the wall before it, m.
        aside: how far to the side that wall was, m.
        far: x of the first thing that bounds it at its far side or stands in the robot's way, m.
    """

    frame: Frame
    side: Side
    near: float
    aside: float
    half_width: float
    far: float = field(default=2 * INTO)

    def driven(self, pose: Pose) -> float:
        """How far the robot has driven since, m."""
        return self.frame.local(pose).x

    def update(self, points: Points, pose: Pose) -> None:
        """Measure the far side again, which is seen better the nearer the robot gets.

        Args:
            points: hits in a frame at the robot along the course, m.
            pose: of the robot by odometry.
        """
        x, y = points[:, 0], points[:, 1] * self.side.sign
        beyond = max(NEAR_CORNER, self.near - self.driven(pose) + SMALLEST / 2)
        bounds = x[(y > -self.half_width) & (y < INTO) & (x > beyond)]
        self.far = self.driven(pose) + (float(bounds.min()) if len(bounds) else 2 * INTO)

    def middle(self, farthest: float) -> float:
        """Where the opening's middle is along the course, at most ``farthest`` (m) past its near corner."""
        return self.near + min(farthest, (self.far - self.near) / 2)


def opening_of(points: Points, robot: RobotDescription, side: Side, pose: Pose, error: float) -> Opening:
    """The opening that begins beside the robot, or ahead where the wall beside it ends.

    Args:
        points: hits in a frame at the robot along its course, m.
        robot: its width counts.
        side: at which side.
        pose: of the robot by odometry.
        error: how far the course is to the left of the robot's heading, rad.
    """
    x, y = points[:, 0], points[:, 1] * side.sign
    beside = (y > robot.half_width / 2) & (y < INTO) & (x < NEAR_CORNER) & (x > -BEHIND)
    near, aside = 0.0, INTO
    if beside.any():
        aside = float(y[beside].min())
        wall = np.sort(x[(np.abs(y - aside) < SAME_WALL) & (x > -BEHIND)])
        ends = wall[:-1][np.diff(wall) > SMALLEST]
        near = float(ends[0] if len(ends) else wall[-1])
    return Opening(Frame(Pose(pose.x, pose.y, pose.heading + error)), side, near, aside, robot.half_width)
