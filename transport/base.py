"""How a base moves: which velocities it can have, how it gets from one to another, and where one carries it.

The gate in front of a base, the simulator's body, the guard against walls and the steering of the motion skills share
these rules.
"""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field

from transport.arithmetic import chord_over_arc, cos_sin, norm
from transport.messages import Pose, Twist, wrap_angle
from transport.section import Positive, Settings

Limit = Annotated[float, Field(ge=1e-3, le=1e6, allow_inf_nan=False)]
"""The limit of a velocity or an acceleration: with less, a robot stands still."""


class Limits(Settings):
    """The limits of the base."""

    speed: Limit = 0.5
    """Largest translational speed, m/s."""
    turn_rate: Limit = 1.2
    """Largest rate of rotation, rad/s."""
    acceleration: Limit = 1.5
    """Largest change of the translational speed, m/s^2."""
    turn_acceleration: Limit = 6.0
    """Largest change of the rate of rotation, rad/s^2."""
    translation: Literal["norm", "axis"] = "norm"
    """Whether the speed limit holds for the norm of the translational velocity or for each of its axes."""

    @property
    def largest_speed(self) -> float:
        """The largest norm of the translational velocity, m/s."""
        return self.speed if self.translation == "norm" else math.sqrt(2) * self.speed


class Holonomic(Settings):
    """A base that moves in any direction and turns meanwhile."""

    kind: Literal["holonomic"] = "holonomic"
    """The base's kind."""

    def limited(self, twist: Twist, limits: Limits) -> Twist:
        """The velocity that the base makes of a command.

        Where the limit of speed holds for the norm, the translation is scaled and keeps its direction; where it holds
        for each axis, each axis is cut on its own. The rotation is cut.
        """
        speed = twist.speed
        if limits.translation == "norm" and speed <= limits.speed and abs(twist.turn) <= limits.turn_rate:
            return twist
        turn = _cut(twist.turn, limits.turn_rate)
        if limits.translation == "axis":
            return Twist(_cut(twist.forward, limits.speed), _cut(twist.left, limits.speed), turn)
        share = _share(limits.speed, speed)
        return Twist(share * twist.forward, share * twist.left, turn)

    def towards(self, before: Twist, wanted: Twist, limits: Limits, duration: float) -> Twist:
        """The velocity after a while (s) of getting from one to another: ``wanted`` itself where it is reached.

        The translation moves in a straight line to the wanted one, the rotation at a rate of its own. Of two
        velocities within the limits each one between them is within them too.
        """
        return reached(before, wanted, self.changes(limits, duration))

    def changes(self, limits: Limits, duration: float) -> tuple[float, float]:
        """The largest change of the translation, m/s, and of the rotation, rad/s, in a while (s)."""
        return limits.acceleration * duration, limits.turn_acceleration * duration


class Differential(Settings):
    """A base with two driven wheels on one axle below the robot's origin; it cannot move sideways.

    A velocity of the robot is one of the rims: ``forward - turn * track / 2`` on the left, ``forward + turn * track /
    2`` on the right. Whatever is cut is cut from both, so that the robot stays on its circle.
    """

    kind: Literal["differential"]
    """The base's kind."""
    track: Positive
    """Distance between the wheels, m; by default the robot's width."""
    wheel_speed: Positive
    """Largest speed of a wheel's rim, m/s; by default what the limits of speed and rotation together ask for."""

    def limited(self, twist: Twist, limits: Limits) -> Twist:
        """The velocity that the base makes of a command: what is sideways is lost, the rest is scaled as one."""
        share = min(
            _share(limits.speed, abs(twist.forward)),
            _share(limits.turn_rate, abs(twist.turn)),
            _share(self.wheel_speed, abs(twist.forward) + abs(twist.turn) * self.track / 2),
        )
        return Twist(share * twist.forward, 0.0, share * twist.turn)

    def towards(self, before: Twist, wanted: Twist, limits: Limits, duration: float) -> Twist:
        """The velocity after a while (s) of getting from one to another: ``wanted`` itself where it is reached.

        Both parts change in one proportion, so that no wheel is asked for more on the way than at its ends, and a
        robot that brakes stays on its circle.
        """
        forward, turn = wanted.forward - before.forward, wanted.turn - before.turn
        share = min(
            _share(limits.acceleration * duration, abs(forward)),
            _share(limits.turn_acceleration * duration, abs(turn)),
        )
        return wanted if share >= 1.0 else Twist(before.forward + share * forward, 0.0, before.turn + share * turn)


KINDS = ("holonomic", "differential")
"""What kinds of base there are."""

Base = Annotated[Holonomic | Differential, Field(discriminator="kind")]
"""How a robot moves."""


def reached(before: Twist, wanted: Twist, changes: tuple[float, float]) -> Twist:
    """`Holonomic.towards` with its largest changes of translation and rotation, m/s and rad/s."""
    forward, left, turn = wanted.forward - before.forward, wanted.left - before.left, wanted.turn - before.turn
    most, most_turn = changes
    change = norm(forward, left)
    if change > most:
        share = most / change
        speeds = before.forward + share * forward, before.left + share * left
    elif abs(turn) <= most_turn:
        return wanted
    else:
        speeds = wanted.forward, wanted.left
    return Twist(*speeds, before.turn + math.copysign(most_turn, turn) if abs(turn) > most_turn else wanted.turn)


def integrate(pose: Pose, twist: Twist, duration: float) -> Pose:
    """Where a constant velocity carries a robot in a time, exactly along its arc (the exponential in SE(2)).

    With theta the turn, the chord is ``sin(theta / 2) / (theta / 2)`` of the way, in the direction of half the turn.

    Args:
        pose: where it begins.
        twist: in the robot's frame.
        duration: s.
    """
    half = twist.turn * duration / 2
    chord = duration * chord_over_arc(half)
    cos, sin = cos_sin(pose.heading + half)
    cos, sin = chord * cos, chord * sin
    return Pose(
        pose.x + cos * twist.forward - sin * twist.left,
        pose.y + sin * twist.forward + cos * twist.left,
        wrap_angle(pose.heading + twist.turn * duration),
    )


def _cut(value: float, largest: float) -> float:
    return min(max(value, -largest), largest)


def _share(largest: float, size: float) -> float:
    """The factor that brings a size down to the largest one."""
    return largest / size if size > largest else 1.0
