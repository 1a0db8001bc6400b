"""The guard's model of the robot's outline: a box with rounded corners, so that a round robot has none."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skills.surroundings import Points
from transport.arithmetic import cos_sin, norms
from transport.compiled import compiled
from transport.section import Point

_EXACT, _SLIGHT = 1e-9, 1e-6
_HALVINGS = 40


class RoundedBox(NamedTuple):
    """A box with rounded corners, m; its core is what is left of it without the rounding.

    Attributes:
        x: of its middle, in the robot's frame.
        y: the same.
        half_length: of its core.
        half_width: of its core.
        rounding: radius of its corners.
    """

    x: float
    y: float
    half_length: float
    half_width: float
    rounding: float


class Outline:
    """The box about a footprint, its corners rounded as far as the footprint leaves them free.

    It holds the footprint, so it is never farther from a wall than it says. Of a box nothing is rounded; of a circle
    only the circle is left.

    Attributes:
        middle: of the box, m in the robot's frame.
        half: of its length and width, m.
        rounding: radius of its corners, m.
        box: the three as plain numbers.
    """

    def __init__(self, footprint: Sequence[Point]) -> None:
        corners = np.asarray(footprint, dtype=np.float64)
        self.middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
        self.half = (corners.max(axis=0) - corners.min(axis=0)) / 2
        self.rounding = _rounding(np.abs(corners - self.middle), self.half)
        self._core = self.half - self.rounding
        (x, y), (half_length, half_width) = self.middle.tolist(), self._core.tolist()
        self.box = RoundedBox(x, y, half_length, half_width, self.rounding)

    @property
    def is_round(self) -> bool:
        """Whether it is a circle about the robot's origin, which a turn leaves where it is."""
        return bool(self._core.max() == 0.0) and bool(np.abs(self.middle).max() < _SLIGHT)

    def apart(self, points: Points) -> tuple[Points, NDArray[np.float64]]:
        """The way from the outline's core to each point, m, and how far each is from the outline; zero within it."""
        return from_core(points, self.box)

    def out_of(self, points: Points) -> NDArray[np.float64]:
        """Where to go from the point deepest within the box, m: to the box's far side, by the middle."""
        offset = points - self.middle
        deepest = int((np.abs(offset) / self.half).max(axis=1).argmin())
        return np.asarray(-offset[deepest])

    def clearance(self, points: Points, poses: NDArray[np.float64]) -> float:
        """Smallest distance from any of the points to the outline at any of the poses, m; negative within it.

        Args:
            points: in the robot's frame, m, shape (n, 2).
            poses: x, y, heading in the same frame, shape (k, 3).
        """
        return least_clearance(points, poses, self.box)


@compiled
def from_core(points: Points, box: RoundedBox) -> tuple[Points, NDArray[np.float64]]:
    """See `Outline.apart`."""
    x, y, *core, rounding = box
    offset = points - (x, y)
    apart = np.sign(offset) * np.maximum(np.abs(offset) - core, 0)
    return np.asarray(apart), np.maximum(norms(apart[:, 0], apart[:, 1]) - rounding, 0)


@compiled
def least_clearance(points: Points, poses: NDArray[np.float64], box: RoundedBox) -> float:
    """See `Outline.clearance`."""
    cos, sin = np.array([cos_sin(heading) for heading in poses[:, 2].tolist()]).T[:, :, None]
    dx, dy = points[:, 0] - poses[:, 0, None], points[:, 1] - poses[:, 1, None]
    x = np.abs(cos * dx + sin * dy - box.x) - box.half_length
    y = np.abs(cos * dy - sin * dx - box.y) - box.half_width
    outside = norms(np.maximum(x, 0), np.maximum(y, 0))
    return float((outside + np.minimum(np.maximum(x, y), 0)).min()) - box.rounding


def _rounding(corners: Points, half: NDArray[np.float64]) -> float:
    """The largest radius of the box's corners with which it still holds the footprint, m.

    Args:
        corners: of the footprint in one quadrant of the box, m, shape (n, 2).
        half: of the box's length and width, m.
    """

    def holds(rounding: float) -> bool:
        out = np.maximum(corners - (half - rounding), 0)
        return bool((norms(out[:, 0], out[:, 1]) <= rounding + _EXACT).all())

    low, high = 0.0, float(half.min())
    if holds(high):
        return high
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low if low > _SLIGHT else 0.0
