"""What a controller, a simulator and a gate on the robot must know alike of one robot: its shape, limits and laser."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from transport.messages import Pose, ScanGeometry, Twist

Point = tuple[float, float]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]


class Settings(BaseModel):
    """A section of a robot profile: immutable, every key documented, an unknown key refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)


class Limits(Settings):
    """What the base may be asked for."""

    speed: Positive = 0.5
    """Largest translational speed, m/s."""
    turn_rate: Positive = 1.2
    """Largest rate of rotation, rad/s."""
    acceleration: Positive = 1.5
    """Largest change of the translational speed, m/s^2."""
    turn_acceleration: Positive = 6.0
    """Largest change of the rate of rotation, rad/s^2."""
    translation: Literal["norm", "axis"] = "norm"
    """Whether the speed limit holds for the norm of the translational velocity or for each of its axes."""

    def clamp(self, twist: Twist) -> Twist:
        """A twist within the speed limits; where they hold for the norm, it points the same way."""
        turn = min(max(twist.turn, -self.turn_rate), self.turn_rate)
        if self.translation == "axis":
            forward = min(max(twist.forward, -self.speed), self.speed)
            return Twist(forward, min(max(twist.left, -self.speed), self.speed), turn)
        share = self.speed / max(twist.speed, self.speed)
        return Twist(twist.forward * share, twist.left * share, turn)


class Laser(Settings):
    """The laser range finder and where it is mounted."""

    beams: Annotated[int, Field(ge=2)] = 1000
    """Number of beams."""
    angle_min: float = -2.0
    """Direction of the first beam, rad."""
    angle_max: float = 2.0
    """Direction of the last beam, rad."""
    range_min: Positive = 0.01
    """Shortest valid reading, m."""
    range_max: Positive = 10.0
    """Longest valid reading, m."""
    mount_x: float = 0.0
    """Position of the sensor in the robot's frame, m forward."""
    mount_y: float = 0.0
    """Position of the sensor in the robot's frame, m to the left."""
    mount_heading: float = 0.0
    """Direction of the sensor's zero angle in the robot's frame, rad."""

    def geometry(self) -> ScanGeometry:
        """The beams as a scan describes them."""
        increment = (self.angle_max - self.angle_min) / (self.beams - 1)
        return ScanGeometry(self.beams, self.angle_min, increment, self.range_min, self.range_max)

    @property
    def mount(self) -> Pose:
        """Pose of the sensor in the robot's frame."""
        return Pose(self.mount_x, self.mount_y, self.mount_heading)


PICO_FOOTPRINT: tuple[Point, ...] = (
    (0.1, -0.2),
    (0.1, -0.1),
    (0.05, -0.1),
    (0.05, 0.1),
    (0.1, 0.1),
    (0.1, 0.2),
    (-0.1, 0.2),
    (-0.1, -0.2),
)


class RobotDescription(Settings):
    """One robot's body: by default PICO's."""

    name: str = "pico"
    """The robot's name, which is also its namespace on a network."""
    footprint: tuple[Point, ...] = PICO_FOOTPRINT
    """Outline seen from above in the robot's frame, m, counter-clockwise."""
    limits: Limits = Limits()
    """Velocity and acceleration limits."""
    laser: Laser = Laser()
    """The laser range finder."""
    period: Positive = 0.1
    """Time from one command to the next, s."""

    @property
    def radius(self) -> float:
        """Radius of the circle about the robot's origin that its footprint sweeps when it rotates, m."""
        return max(math.hypot(x, y) for x, y in self.footprint)

    @property
    def half_width(self) -> float:
        """Largest extent to a side, m."""
        return max(abs(y) for _, y in self.footprint)
