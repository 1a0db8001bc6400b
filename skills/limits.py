"""What may be asked of the base: a velocity is scaled, never bent, until it keeps the robot's limits."""

from __future__ import annotations

import math

from transport.description import Limits
from transport.messages import Twist


def within_speed(twist: Twist, limits: Limits) -> Twist:
    """The twist with its translation scaled to the speed limit and its rotation cut to the turn-rate limit.

    The direction of the translation and the sense of the rotation stay.
    """
    size = twist.speed if limits.translation == "norm" else max(abs(twist.forward), abs(twist.left))
    scale = min(1.0, limits.speed / size) if size > 0 else 1.0
    turn = math.copysign(min(abs(twist.turn), limits.turn_rate), twist.turn)
    return Twist(scale * twist.forward, scale * twist.left, turn)


def within_acceleration(before: Twist, wanted: Twist, limits: Limits, period: float) -> Twist:
    """The twist on the way from ``before`` to ``wanted`` that can be had within a period (s).

    The change of the translation is scaled, so that the velocity moves in a straight line to the wanted one; of two
    velocities within the speed limit each one between them is within it too.
    """
    forward, left = wanted.forward - before.forward, wanted.left - before.left
    change = math.hypot(forward, left)
    share = min(1.0, limits.acceleration * period / change) if change > 0 else 1.0
    largest = limits.turn_acceleration * period
    turn = max(-largest, min(largest, wanted.turn - before.turn))
    return Twist(before.forward + share * forward, before.left + share * left, before.turn + turn)
