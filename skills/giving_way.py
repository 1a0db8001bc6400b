"""Alternatives for a velocity that would bring the robot too near to something."""

from __future__ import annotations

import math
from collections.abc import Iterator

from transport.base import Base, Differential, Holonomic
from transport.messages import Twist
from transport.section import Point

SHARES = (0.6, 0.3)
"""How much slower it is tried."""
SIDEWAYS = 0.5
"""A direction of which less than this is along the robot's axis is one to its side."""
TURNING = 0.5
"""Rate of rotation with which a base on two wheels steers away from something, rad/s."""


def alternatives(base: Base, wanted: Twist, away: Point, push: float, pressed: float) -> Iterator[Twist]:
    """The velocities to try instead, the nearest to the requested one first.

    Args:
        base: how the robot moves.
        wanted: what was asked for.
        away: unit vector away from the nearest point.
        push: velocity with which the robot moves away, m/s.
        pressed: how many times as fast it must.
    """
    match base:
        case Holonomic():
            return _aside(wanted, away, push, pressed)
        case Differential():
            return _forward_or_back(wanted, away, push, pressed)


def _aside(wanted: Twist, away: Point, push: float, pressed: float) -> Iterator[Twist]:
    """Slide along what is near, and move off it in whatever direction that is."""
    towards = min(0.0, wanted.forward * away[0] + wanted.left * away[1])
    slide = (wanted.forward - towards * away[0], wanted.left - towards * away[1])

    def pushed(velocity: Point, times: float, turn: float) -> Twist:
        return Twist(velocity[0] + times * push * away[0], velocity[1] + times * push * away[1], turn)

    yield pushed(slide, pressed, wanted.turn)
    for share in SHARES:
        yield Twist(share * wanted.forward, share * wanted.left, share * wanted.turn)
        yield pushed((share * slide[0], share * slide[1]), max(1.0, pressed), share * wanted.turn)
    yield pushed((0.0, 0.0), max(1.0, pressed), wanted.turn)
    yield pushed((0.0, 0.0), max(1.0, pressed), 0.0)
    yield Twist(0.0, 0.0, wanted.turn)


def _forward_or_back(wanted: Twist, away: Point, push: float, pressed: float) -> Iterator[Twist]:
    """Slower, steered away, forward or back off what is ahead or behind, turned away from what is beside.

    Such a robot cannot give way to something from the side: it can only drive on, or turn.
    """
    off = math.copysign(TURNING, away[1])
    apart = math.copysign(push, away[0]) if abs(away[0]) >= SIDEWAYS else 0.0
    onwards = 0.0 if wanted.forward * apart < 0 else wanted.forward
    yield Twist(onwards + pressed * apart, 0.0, wanted.turn)
    if not wanted.forward:
        yield Twist(max(1.0, pressed) * apart, 0.0, wanted.turn)
    for share in SHARES:
        yield Twist(share * wanted.forward, 0.0, share * wanted.turn)
        if wanted.forward:
            yield Twist(share * wanted.forward, 0.0, share * wanted.turn + off)
    for share in (1.0, *SHARES):
        yield Twist(share * wanted.forward)
    yield Twist(max(1.0, pressed) * apart, 0.0, wanted.turn)
    yield Twist(max(1.0, pressed) * apart)
    yield Twist(turn=wanted.turn)
    yield Twist(push, 0.0, off)
    yield Twist(turn=off)
    yield Twist(turn=-off)
