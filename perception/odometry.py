"""Odometry: steps from one measurement to the next, and dead reckoning with the compass."""

from __future__ import annotations

import math
from dataclasses import dataclass

from perception.compass import Compass
from perception.settings import OdometrySettings
from transport.arithmetic import cos_sin, norm
from transport.messages import Pose, wrap_angle


@dataclass(frozen=True, slots=True)
class Displacement:
    """A movement in the robot's frame before it.

    Attributes:
        forward: m.
        left: m.
        turn: rad within [-pi, pi], whatever way round the heading was counted.
    """

    forward: float = 0.0
    left: float = 0.0
    turn: float = 0.0

    @property
    def length(self) -> float:
        """Distance moved, m."""
        return norm(self.forward, self.left)


def step_between(before: Pose, after: Pose) -> Displacement:
    """The movement from one pose to another."""
    dx, dy = after.x - before.x, after.y - before.y
    cosine, sine = cos_sin(before.heading)
    return Displacement(dx * cosine + dy * sine, dy * cosine - dx * sine, wrap_angle(after.heading - before.heading))


def moved(pose: Pose, step: Displacement) -> Pose:
    """The pose after a step; the heading is wrapped to [-pi, pi]."""
    cosine, sine = cos_sin(pose.heading)
    return Pose(
        pose.x + step.forward * cosine - step.left * sine,
        pose.y + step.forward * sine + step.left * cosine,
        wrap_angle(pose.heading + step.turn),
    )


def is_restart(step: Displacement, settings: OdometrySettings) -> bool:
    """Whether a step is not movement but a new origin of the odometry, or no number at all."""
    numbers = math.isfinite(step.length) and math.isfinite(step.turn)
    return not numbers or step.length > settings.max_jump or abs(step.turn) > 2 * settings.max_jump


def corrected(heading: float, compass: Compass, world_angle: float, settings: OdometrySettings) -> float:
    """A heading corrected towards the compass.

    The walls run along multiples of the world angle, so the compass knows the heading except for such a multiple, which
    the old heading settles.

    Args:
        heading: rad, in a frame whose axes run along the walls.
        compass: what is seen of the walls.
        world_angle: rad.
        settings: how far to follow.

    Returns:
        rad within [-pi, pi].
    """
    if not compass.known:
        return heading
    innovation = math.remainder(-compass.misalignment - heading, world_angle)
    if abs(innovation) > settings.max_correction:
        return heading
    return wrap_angle(heading + settings.heading_gain * innovation)
