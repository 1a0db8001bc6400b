"""Injected faults: their kinds, when or where they begin, and for how long."""

from __future__ import annotations

import math
from typing import Annotated, Literal, get_args

from pydantic import Field, TypeAdapter, ValidationError

from sim.maze import Point
from transport.arithmetic import distance_between
from transport.messages import Pose
from transport.section import Angle, Positive, Settings
from transport.wording import in_words

Seconds = Annotated[float, Field(ge=0)]
Jump = Annotated[float, Field(ge=-1e6, le=1e6, allow_inf_nan=False)]


class _Fault(Settings):
    """When a fault begins: at a time, or, where a place is given, when the robot first comes to it after that time."""

    at: Seconds = 0.0
    """Time before which it does not begin, s."""
    lasts: Seconds = math.inf
    """How long it lasts, s."""
    place: tuple[Jump, Jump, Positive] | None = None
    """Centre and radius of the area where it begins, m; none to begin by time alone."""
    robot: str = ""
    """The robot that it affects; empty for all."""

    def concerns(self, robot: str) -> bool:
        """Whether it affects a robot of that name."""
        return self.robot in ("", robot)


class LaserBlinded(_Fault):
    """Every beam measures nothing: NaN."""

    kind: Literal["laser_blinded"] = "laser_blinded"


class LaserFrozen(_Fault):
    """The ranges stay as they were; only their stamp continues."""

    kind: Literal["laser_frozen"] = "laser_frozen"


class LaserSilent(_Fault):
    """No scan comes any more: the last one grows old."""

    kind: Literal["laser_silent"] = "laser_silent"


class OdometrySilent(_Fault):
    """No odometry comes any more: the last one grows old."""

    kind: Literal["odometry_silent"] = "odometry_silent"


class BeamsMissing(_Fault):
    """The beams between two directions measure nothing: NaN."""

    kind: Literal["beams_missing"] = "beams_missing"
    angles: tuple[Angle, Angle]
    """First and last direction in the sensor's frame, rad."""


class OdometryJump(_Fault):
    """The odometry's pose jumps, once."""

    kind: Literal["odometry_jump"] = "odometry_jump"
    by: tuple[Jump, Jump, Angle]
    """Metres forward and to the left, radians counter-clockwise."""


class Carried(_Fault):
    """The robot is carried to another place, once, at rest; its wheels do not turn."""

    kind: Literal["carried"] = "carried"
    to: tuple[Jump, Jump, Angle]
    """Where: x and y, m, and heading, rad, in the maze's frame."""


class CommandLost(_Fault):
    """Commands do not arrive: the robot continues with the last one that did."""

    kind: Literal["command_lost"] = "command_lost"


class CommandLate(_Fault):
    """Commands arrive late."""

    kind: Literal["command_late"] = "command_late"
    ticks: Annotated[int, Field(ge=1, le=10_000)] = 1
    """By this many periods."""


class DoorStuck(_Fault):
    """A door stays where it is when it is rung at."""

    kind: Literal["door_stuck"] = "door_stuck"
    door: str = ""
    """The door's name; empty for all."""


class ObjectStops(_Fault):
    """A moving object stops where it is."""

    kind: Literal["object_stops"] = "object_stops"
    thing: str = ""
    """The object's name; empty for all."""


Fault = Annotated[
    LaserBlinded
    | LaserFrozen
    | LaserSilent
    | OdometrySilent
    | BeamsMissing
    | OdometryJump
    | Carried
    | CommandLost
    | CommandLate
    | DoorStuck
    | ObjectStops,
    Field(discriminator="kind"),
]
_ANY: TypeAdapter[Fault] = TypeAdapter(Fault)
KINDS = tuple(kind.model_fields["kind"].default for kind in get_args(get_args(Fault)[0]))
"""What faults are called."""


def parse_fault(text: str) -> Fault:
    """A fault from a line such as ``laser_blinded at=10 lasts=2`` or ``odometry_jump by=0.5,0,0.3 place=2,3,0.5``.

    Raises:
        ValueError: there is no such fault, or it has no such option; the message names it.
    """
    kind, *details = text.split() or [""]
    if kind not in KINDS:
        raise ValueError(f"there is no fault `{kind}`: the faults are {', '.join(KINDS)}")
    values: dict[str, object] = {"kind": kind}
    for detail in details:
        key, _, value = detail.partition("=")
        values[key] = value.split(",") if "," in value else value
    try:
        return _ANY.validate_python(values)
    except ValidationError as error:
        first = error.errors()[0]
        # The kind is the first part of each place.
        raise ValueError(f"{text}: {in_words({**first, 'loc': first['loc'][1:]})}") from None


class Watch:
    """Tracks whether one fault is active for one robot."""

    def __init__(self, fault: Fault) -> None:
        self.fault = fault
        self._began = math.inf
        self._fired = False

    def holds(self, time: float, pose: Pose) -> bool:
        """Whether the fault is active.

        Args:
            time: simulated time, s; calls are made in its order.
            pose: the robot's true pose.
        """
        if math.isinf(self._began) and time >= self.fault.at - 1e-9 and self._inside((pose.x, pose.y)):
            self._began = time
        return self._began <= time < self._began + self.fault.lasts - 1e-9

    def fires(self, time: float, pose: Pose) -> bool:
        """Whether a one-time fault happens now: at the first call while it is active."""
        if self._fired or not self.holds(time, pose):
            return False
        self._fired = True
        return True

    def _inside(self, point: Point) -> bool:
        if self.fault.place is None:
            return True
        x, y, radius = self.fault.place
        return distance_between(point, (x, y)) <= radius
