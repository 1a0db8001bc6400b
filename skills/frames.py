"""Local frames on odometry, by homogeneous transformation (the 2015 robot's way through a corner)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from transport.arithmetic import cos_sin
from transport.messages import Pose, wrap_angle


@dataclass(frozen=True, slots=True)
class Frame:
    """A frame fixed in the odometry frame, usually where a skill began.

    A homogeneous matrix takes odometry coordinates to this frame. For an origin ``(x0, y0)`` and a heading ``a`` it is
    ``[[cos a, sin a, -x0 cos a - y0 sin a], [-sin a, cos a, x0 sin a - y0 cos a], [0, 0, 1]]``.
    """

    origin: Pose

    def matrix(self) -> NDArray[np.float64]:
        """From homogeneous odometry coordinates to this frame's, shape (3, 3)."""
        cos, sin = cos_sin(self.origin.heading)
        x, y = self.origin.x, self.origin.y
        return np.array([[cos, sin, -x * cos - y * sin], [-sin, cos, x * sin - y * cos], [0.0, 0.0, 1.0]])

    def local(self, pose: Pose) -> Pose:
        """A pose of the odometry frame in this frame."""
        cos, sin = cos_sin(self.origin.heading)
        dx, dy = pose.x - self.origin.x, pose.y - self.origin.y
        return Pose(cos * dx + sin * dy, cos * dy - sin * dx, wrap_angle(pose.heading - self.origin.heading))

    def outer(self, pose: Pose) -> Pose:
        """A pose of this frame in the odometry frame."""
        cos, sin = cos_sin(self.origin.heading)
        return Pose(
            self.origin.x + cos * pose.x - sin * pose.y,
            self.origin.y + sin * pose.x + cos * pose.y,
            wrap_angle(pose.heading + self.origin.heading),
        )


def rotated(x: float, y: float, angle: float) -> tuple[float, float]:
    """A vector turned by ``angle`` (rad, counter-clockwise)."""
    cos, sin = cos_sin(angle)
    return cos * x - sin * y, sin * x + cos * y


class Turned:
    """The angle turned since it was made, from odometry headings that jump between -pi and pi, in rad.

    Right as long as the robot turns by less than half a turn from one tick to the next.
    """

    def __init__(self, heading: float) -> None:
        self._last = heading
        self.angle = 0.0

    def update(self, heading: float) -> float:
        """Take in the newest heading and return the angle turned so far."""
        self.angle += wrap_angle(heading - self._last)
        self._last = heading
        return self.angle
