"""A small plan as text, of Braille patterns: walls, the way so far, the robot."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence

from transport.messages import Pose

DOTS = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))
"""The dots of a Braille pattern by row and column, as Unicode numbers them."""
ARROWS = "→↗↑↖←↙↓↘"
"""The robot by its heading, in steps of 45 degrees from the x axis, counter-clockwise."""
MARGIN = 0.3
"""Around what is drawn, m."""

Line = Sequence[float]
_Dot = Callable[[float, float], tuple[int, int]]


def text_plan(
    walls: Sequence[Line], way: Sequence[tuple[float, float]], robot: Pose, width: int, height: int
) -> list[str]:
    """Draw a plan, y upwards.

    Args:
        walls: segments as x1, y1, x2, y2, m.
        way: where the robot has been, m.
        robot: where it is.
        width: of the picture, characters.
        height: of the picture, characters.

    Returns:
        The lines, the top one first.
    """
    if width < 1 or height < 1:
        return []
    places = [*way, (robot.x, robot.y)]
    xs = [x for x, _ in places] + [x for one in walls for x in one[0::2]]
    ys = [y for _, y in places] + [y for one in walls for y in one[1::2]]
    left, low, right, high = min(xs) - MARGIN, min(ys) - MARGIN, max(xs) + MARGIN, max(ys) + MARGIN
    scale = min((2 * width - 1) / (right - left), (4 * height - 1) / (high - low))
    cells = [[0] * width for _ in range(height)]

    def dot(x: float, y: float) -> tuple[int, int]:
        return round((x - left) * scale), round((high - y) * scale)

    for column, row in _dots(walls, dot):
        cells[row // 4][column // 2] |= DOTS[row % 4][column % 2]
    for column, row in (dot(*place) for place in way):
        cells[row // 4][column // 2] |= DOTS[row % 4][column % 2]
    rows = [[chr(0x2800 + cell) if cell else " " for cell in row] for row in cells]
    column, row = dot(robot.x, robot.y)
    rows[row // 4][column // 2] = ARROWS[round(robot.heading / (math.pi / 4)) % 8]
    return ["".join(one).rstrip() for one in rows]


def _dots(walls: Sequence[Line], dot: _Dot) -> Iterable[tuple[int, int]]:
    """The dots of segments, close enough to each other to be lines."""
    for x1, y1, x2, y2 in walls:
        (c1, r1), (c2, r2) = dot(x1, y1), dot(x2, y2)
        count = max(abs(c2 - c1), abs(r2 - r1), 1)
        for number in range(count + 1):
            part = number / count
            yield round(c1 + part * (c2 - c1)), round(r1 + part * (r2 - r1))
