"""The description of one robot, shared by controller, simulator and gate: its shape, limits and laser."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Annotated, Self, TypeVar

from pydantic import BaseModel, Field, ValidationInfo, field_validator, model_validator

from transport.arithmetic import norm
from transport.base import Base, Holonomic, Limits
from transport.messages import Pose, ScanGeometry, Twist
from transport.outline import area_of, outline_fault
from transport.section import Angle, Coordinate, Finite, Period, Point, Positive, Settings, grown, is_network_name
from transport.wording import shortened

__all__ = ["PICO_FOOTPRINT", "Laser", "Limits", "Point", "RobotDescription", "fitted"]

Section = TypeVar("Section", bound=BaseModel)


class Laser(Settings):
    """The laser range finder and where it is mounted.

    A laser that turns clockwise is described by the same two angles, in either order: its scans are turned round.
    """

    beams: Annotated[int, Field(ge=2, le=100_000)] = 1000
    """Number of beams."""
    angle_min: Finite = -2.0
    """Direction of the first beam, rad."""
    angle_max: Finite = 2.0
    """Direction of the last beam, rad."""
    range_min: Positive = 0.01
    """Shortest valid reading, m."""
    range_max: Positive = 10.0
    """Longest valid reading, m."""
    mount_x: Coordinate = 0.0
    """Position of the sensor in the robot's frame, m forward."""
    mount_y: Coordinate = 0.0
    """Position of the sensor in the robot's frame, m to the left."""
    mount_heading: Angle = 0.0
    """Direction of the sensor's zero angle in the robot's frame, rad."""

    @model_validator(mode="before")
    @classmethod
    def _counter_clockwise(cls, values: object) -> object:
        """The two ends of the fan in counter-clockwise order."""
        if isinstance(values, dict):
            first, last = values.get("angle_min"), values.get("angle_max")
            if isinstance(first, int | float) and isinstance(last, int | float) and first > last:
                return values | {"angle_min": last, "angle_max": first}
        return values

    @model_validator(mode="after")
    def _possible(self) -> Self:
        span, furthest = self.angle_max - self.angle_min, max(abs(self.angle_min), abs(self.angle_max))
        if not span > 0:
            raise ValueError(f"must have `angle_min` ({self.angle_min:g}) below `angle_max` ({self.angle_max:g})")
        if furthest > 2 * math.tau:
            raise ValueError(f"has its angles in radians: {furthest:g} degrees are {math.radians(furthest):.4f} rad")
        if not span <= math.tau + 1.5 * span / (self.beams - 1):
            raise ValueError(f"cannot span more than a full turn: it is {math.tau:.4f} rad, not {span:g}")
        if self.range_min >= self.range_max:
            raise ValueError(f"must have `range_min` ({self.range_min:g}) below `range_max` ({self.range_max:g})")
        return self

    @property
    def angle_increment(self) -> float:
        """The angle from a beam to the next one, rad; negative where they follow one another clockwise."""
        return (self.angle_max - self.angle_min) / (self.beams - 1)

    def geometry(self) -> ScanGeometry:
        """The beams as a scan describes them."""
        return ScanGeometry(self.beams, self.angle_min, self.angle_increment, self.range_min, self.range_max)

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


@lru_cache(maxsize=16)
def _extents(footprint: tuple[Point, ...]) -> tuple[float, float]:
    """How far a footprint reaches from its origin, and how far to a side, m."""
    return max(norm(x, y) for x, y in footprint), max(abs(y) for _, y in footprint)


class RobotDescription(Settings):
    """One robot's body: by default PICO's."""

    name: str = "pico"
    """The robot's name, under which a gate or a simulator shows it on a network."""
    namespace: str = "{name}"
    """Namespace of the topics of a bare ROS 2 robot; `{name}` represents its name. Empty for a robot without one."""
    footprint: tuple[Point, ...] = PICO_FOOTPRINT
    """Outline seen from above in the robot's frame, m, counter-clockwise."""
    limits: Limits = Limits()
    """Velocity and acceleration limits."""
    base: Base = Holonomic()
    """How it moves: `holonomic`, or `differential` with the wheels' track and speed."""
    laser: Laser = Laser()
    """The laser range finder."""
    period: Period = 0.1
    """Time from one command to the next, s."""

    @field_validator("footprint")
    @classmethod
    def _outlines_a_body(cls, footprint: tuple[Point, ...]) -> tuple[Point, ...]:
        """The corners counter-clockwise, whichever way they are given."""
        if reason := outline_fault(footprint):
            raise ValueError(reason)
        return footprint if area_of(footprint) > 0 else footprint[::-1]

    @model_validator(mode="after")
    def _sees_where_it_drives(self) -> Self:
        """The laser is a part of the robot, and sees as far as the robot needs to stop."""
        laser, radius, needed = self.laser, self.radius, self.radius + self.stopping_distance
        if norm(laser.mount_x, laser.mount_y) > radius + 1e-6:
            raise ValueError(
                f"has its laser at ({laser.mount_x:g}, {laser.mount_y:g}) m, outside the circle of {radius:.3g} m that "
                "its footprint sweeps: the laser is a part of the robot, so correct `laser.mount_x`, `laser.mount_y` "
                "or `footprint`"
            )
        if laser.range_max < needed:
            raise ValueError(
                f"needs {needed:.3g} m to stop from its largest speed, and its laser sees {laser.range_max:g} m: "
                "lower `limits.speed`, or correct `limits.acceleration` or `laser.range_max`"
            )
        return self

    @field_validator("base", mode="before")
    @classmethod
    def _with_wheels(cls, base: object, info: ValidationInfo) -> object:
        """Complete a base that is only named, or lacks values: wheels on the robot's sides, as fast as its limits."""
        named = {"kind": base} if isinstance(base, str) else base
        footprint, limits = info.data.get("footprint"), info.data.get("limits")
        if not isinstance(named, dict) or named.get("kind") != "differential" or footprint is None or limits is None:
            return named
        width = max(y for _, y in footprint) - min(y for _, y in footprint)
        track = named.get("track", width)
        rim = limits.speed + limits.turn_rate * (track if isinstance(track, float) else width) / 2
        return {"track": width, "wheel_speed": rim} | named

    @field_validator("name", "namespace")
    @classmethod
    def _sayable(cls, value: str, info: ValidationInfo) -> str:
        spelt = value.replace("{name}", "name").strip("/")
        if not is_network_name(spelt) and (spelt or info.field_name == "name"):
            raise ValueError(f"must be letters, digits, - and _, a letter first, not {shortened(repr(value))}")
        return value

    @property
    def topics_below(self) -> str:
        """The namespace of its topics as a bare ROS 2 robot; empty where they have none."""
        return self.namespace.replace("{name}", self.name).strip("/")

    @property
    def radius(self) -> float:
        """Radius of the circle about the robot's origin that its footprint sweeps when it rotates, m."""
        return _extents(self.footprint)[0]

    @property
    def half_width(self) -> float:
        """Largest extent to a side, m."""
        return _extents(self.footprint)[1]

    @property
    def stopping_distance(self) -> float:
        """The way from its largest speed to standstill, at most, m: one more period at that speed, then braking."""
        speed = self.limits.largest_speed
        return speed * self.period + speed * speed / (2 * self.limits.acceleration)

    def limited(self, twist: Twist) -> Twist:
        """The velocity that the base makes of a command."""
        return self.base.limited(twist, self.limits)

    def towards(self, before: Twist, wanted: Twist, duration: float) -> Twist:
        """The velocity that the base has after a while (s) of getting from one to another."""
        return self.base.towards(before, wanted, self.limits, duration)

    @property
    def relative_size(self) -> float:
        """Its radius as a multiple of the default robot's."""
        return self.radius / _DEFAULT.radius

    @property
    def relative_speed(self) -> float:
        """Its largest speed as a multiple of the default robot's."""
        return self.limits.speed / _DEFAULT.limits.speed


_DEFAULT = RobotDescription()


def fitted(section: Section, robot: RobotDescription) -> Section:
    """A section of a profile for a robot: its defaults grow with the robot where they are marked to."""
    return grown(section, robot.relative_size, robot.relative_speed)
