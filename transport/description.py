"""What a controller, a simulator and a gate on the robot must know alike of one robot: its shape, limits and laser."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, ValidationInfo, field_validator

from transport.arithmetic import norm
from transport.base import Base, Holonomic, Limits
from transport.messages import Pose, ScanGeometry, Twist
from transport.section import Point, Positive, Settings

__all__ = ["PICO_FOOTPRINT", "Laser", "Limits", "Point", "RobotDescription"]


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
    base: Base = Holonomic()
    """How it moves: `holonomic`, or `differential` with the wheels' track and speed."""
    laser: Laser = Laser()
    """The laser range finder."""
    period: Positive = 0.1
    """Time from one command to the next, s."""

    @field_validator("base", mode="before")
    @classmethod
    def _with_wheels(cls, base: object, info: ValidationInfo) -> object:
        """A base that is only named, or says only some of its wheels: at the robot's sides, as fast as its limits."""
        named = {"kind": base} if isinstance(base, str) else base
        footprint, limits = info.data.get("footprint"), info.data.get("limits")
        if not isinstance(named, dict) or named.get("kind") != "differential" or footprint is None or limits is None:
            return named
        width = max(y for _, y in footprint) - min(y for _, y in footprint)
        track = named.get("track", width)
        rim = limits.speed + limits.turn_rate * (track if isinstance(track, float) else width) / 2
        return {"track": width, "wheel_speed": rim} | named

    @property
    def radius(self) -> float:
        """Radius of the circle about the robot's origin that its footprint sweeps when it rotates, m."""
        return max(norm(x, y) for x, y in self.footprint)

    @property
    def half_width(self) -> float:
        """Largest extent to a side, m."""
        return max(abs(y) for _, y in self.footprint)

    def limited(self, twist: Twist) -> Twist:
        """The velocity that the base makes of a command."""
        return self.base.limited(twist, self.limits)

    def towards(self, before: Twist, wanted: Twist, duration: float) -> Twist:
        """The velocity that the base has after a while (s) of getting from one to another."""
        return self.base.towards(before, wanted, self.limits, duration)
