"""The messages between a robot and its controller.

Plain frozen values in SI units, shaped after the ROS 2 messages that carry them over a network. Some of these messages
are narrower than a Python float: ``sensor_msgs/LaserScan`` is single precision, ``nav_msgs/Odometry`` has a
quaternion. The values here are as narrow, so that a run in one process and a run over the network see the same bits.

Frames: x forward, y left, angles counter-clockwise from x, in radians.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from transport.arithmetic import atan2, cos_sin, norm

NANOSECONDS = 1_000_000_000

ALL_ROUND = 4.5
"""A laser sees all round if the gap behind its last beam is narrower than this many steps from beam to beam."""


def wrap_angle(angle: float) -> float:
    """The same direction within [-pi, pi], in radians."""
    return math.remainder(angle, math.tau)


@dataclass(frozen=True, slots=True)
class Pose:
    """A position in metres and a heading in radians, in some planar frame."""

    x: float = 0.0
    y: float = 0.0
    heading: float = 0.0


@dataclass(frozen=True, slots=True)
class Twist:
    """A velocity in the robot's own frame: m/s forward, m/s to the left, rad/s counter-clockwise."""

    forward: float = 0.0
    left: float = 0.0
    turn: float = 0.0

    @property
    def speed(self) -> float:
        """The norm of the translational velocity in m/s."""
        return norm(self.forward, self.left)


STOP = Twist()


def _single(value: float) -> float:
    return float(np.float32(value))


@dataclass(frozen=True, slots=True)
class ScanGeometry:
    """Which beams a laser range finder measures; kept in single precision, as the wire carries it.

    Attributes:
        beams: the number of beams.
        angle_min: direction of the first beam in the sensor's frame, rad.
        angle_increment: from one beam to the next, rad.
        range_min: shorter readings are not valid, m.
        range_max: longer readings are not valid, m; a beam that hits nothing reads infinity.
    """

    beams: int
    angle_min: float
    angle_increment: float
    range_min: float
    range_max: float

    def __post_init__(self) -> None:
        for name in ("angle_min", "angle_increment", "range_min", "range_max"):
            object.__setattr__(self, name, _single(getattr(self, name)))

    @property
    def angle_max(self) -> float:
        """Direction of the last beam, rad."""
        return self.angle_min + (self.beams - 1) * self.angle_increment

    @property
    def all_round(self) -> bool:
        """Whether the beams go all the way round, so that the gap behind the last one is about as wide as any other."""
        return math.tau - abs(self.angle_max - self.angle_min) < ALL_ROUND * abs(self.angle_increment)

    @property
    def spacing(self) -> float:
        """The angle between neighbouring beams, rad."""
        return abs(self.angle_increment)

    def angles(self) -> NDArray[np.float64]:
        """Directions of all beams, rad, shape (beams,)."""
        return self.angle_min + self.angle_increment * np.arange(self.beams, dtype=np.float64)


@dataclass(frozen=True, slots=True, eq=False)
class Scan:
    """One sweep of the laser range finder.

    Attributes:
        stamp: time of the first beam, ns.
        geometry: which beams.
        ranges: metres, float32, shape (beams,), by REP 117: infinity where nothing was hit, minus infinity where
            something is nearer than ``range_min``, NaN where nothing was measured.
    """

    stamp: int
    geometry: ScanGeometry
    ranges: NDArray[np.float32]


@dataclass(frozen=True)
class Odometry:
    """The pose of the robot by its wheels; it drifts and its origin is arbitrary.

    Attributes:
        stamp: time of the measurement, ns.
        x: metres in the odometry frame.
        y: metres in the odometry frame.
        qz: z component of the unit quaternion of the heading, sin(heading / 2).
        qw: w component, cos(heading / 2).
        twist: velocity in the robot's frame.
    """

    stamp: int
    x: float
    y: float
    qz: float
    qw: float
    twist: Twist = STOP

    @classmethod
    def at(cls, stamp: int, pose: Pose, twist: Twist = STOP) -> Odometry:
        """The odometry of a robot at ``pose`` (in the odometry frame)."""
        qw, qz = cos_sin(pose.heading / 2)
        return cls(stamp, pose.x, pose.y, qz, qw, twist)

    @cached_property
    def pose(self) -> Pose:
        """Position and heading in the odometry frame."""
        return Pose(self.x, self.y, wrap_angle(2 * atan2(self.qz, self.qw)))


@dataclass(frozen=True, slots=True)
class DoorReply:
    """The answer to a ring of the door bell: whether a door will open, or why not."""

    accepted: bool
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Navigation:
    """The state of a goal of the robot's own navigation.

    Attributes:
        goal: the pose to be reached, in the navigation's map.
        state: ``asked``, ``driving``, ``arrived``, ``failed``, or ``missing`` where nobody navigates.
        reason: why it failed or is missing.
        distance: what is left of its path, m; None until it says.
        recoveries: how often it has tried to get free again.
    """

    goal: Pose
    state: Literal["asked", "driving", "arrived", "failed", "missing"] = "asked"
    reason: str = ""
    distance: float | None = None
    recoveries: int = 0


@dataclass(frozen=True, slots=True)
class LinkStatus:
    """The state of the link.

    Attributes:
        scan_age: age of the newest scan when it was delivered, s; zero in lockstep.
        odometry_age: the same for odometry, s.
        reconnects: how often the link was lost and found again in this run.
        stopped: the robot's command time-out has stopped it and waits for a new lease.
        refused: why the newest scan or odometry cannot be trusted; empty where both can.
        blind: why the controller keeps the base stopped; empty where it may drive by what is sensed.
    """

    scan_age: float = 0.0
    odometry_age: float = 0.0
    reconnects: int = 0
    stopped: bool = False
    refused: str = ""
    blind: str = ""


@dataclass(frozen=True, slots=True)
class Observation:
    """All data about the robot in one tick.

    Attributes:
        stamp: the tick's time, ns, of the newest sensor message; the only clock a supervisor knows.
        scan: the newest scan.
        odometry: the newest odometry.
        door: the answer to a ring since the last observation, if one came.
        link: state of the link.
        navigation: how the robot's own navigation does with the goal of the last command; None without a goal, and of
            a robot that has no navigation.
    """

    stamp: int
    scan: Scan
    odometry: Odometry
    door: DoorReply | None = None
    link: LinkStatus = field(default=LinkStatus())
    navigation: Navigation | None = None

    @property
    def time(self) -> float:
        """The stamp in seconds."""
        return self.stamp / NANOSECONDS


@dataclass(frozen=True, slots=True)
class Command:
    """The command of a controller to the robot, until the next one.

    Attributes:
        twist: the velocity to drive with.
        ring: ring the door bell, once.
        answers: stamp of the observation that led to this command, ns.
        goal: a pose that the robot's own navigation is to reach; while there is one, it drives instead of the twist.
    """

    twist: Twist = STOP
    ring: bool = False
    answers: int = 0
    goal: Pose | None = None
