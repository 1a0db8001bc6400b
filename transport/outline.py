"""Checks an outline: enough corners, an area, and no crossing sides."""

from __future__ import annotations

import math
from collections.abc import Sequence

Corner = tuple[float, float]
MOST = 100
"""No outline has more corners."""
LEAST_AREA = 1e-4
"""The least area, m^2: a square centimetre."""


def outline_fault(corners: Sequence[Corner]) -> str:
    """Why corners, in m, do not outline a body; None if they do."""
    if not 3 <= len(corners) <= MOST:
        return f"must have 3 to {MOST} corners, not {len(corners)}"
    if abs(area_of(corners)) < LEAST_AREA:
        area = abs(area_of(corners))
        return f"must be an outline with an area, not {len(corners)} corners around {area:g} m^2"
    sides = list(zip(corners, [*corners[1:], corners[0]], strict=True))
    if any(one == other for one, other in sides):
        return "must not have a corner twice in a row"
    for number, side in enumerate(sides):
        # Neighbouring sides share a corner, which is not a crossing.
        for other in sides[number + 2 : len(sides) - (number == 0)]:
            if _cross(*side, *other):
                return (
                    f"must not cross itself: the side from {side[0]} to {side[1]}, that from {other[0]} to {other[1]}"
                )
    return ""


def area_of(corners: Sequence[Corner]) -> float:
    """The area, positive counter-clockwise (the shoelace formula)."""
    following = [*corners[1:], corners[0]]
    return math.fsum(ax * by - ay * bx for (ax, ay), (bx, by) in zip(corners, following, strict=True)) / 2


def _cross(a: Corner, b: Corner, c: Corner, d: Corner) -> bool:
    """Whether two sides meet."""
    sides = _side(a, b, c) * _side(a, b, d), _side(c, d, a) * _side(c, d, b)
    return max(sides) <= 0 and not (sides == (0.0, 0.0) and _apart(a, b, c, d))


def _side(a: Corner, b: Corner, point: Corner) -> float:
    return (b[0] - a[0]) * (point[1] - a[1]) - (b[1] - a[1]) * (point[0] - a[0])


def _apart(a: Corner, b: Corner, c: Corner, d: Corner) -> bool:
    """Whether the boxes around two sides do not meet."""
    return any(
        max(a[axis], b[axis]) < min(c[axis], d[axis]) or max(c[axis], d[axis]) < min(a[axis], b[axis])
        for axis in (0, 1)
    )
