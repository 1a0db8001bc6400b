"""Where a robot fits: exact distances to the walls on a grid of points, and reachability."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.maze import Point, Segments
from transport.arithmetic import square

Flags = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class DistanceGrid:
    """A grid of points with the distance of each to the nearest segment, exact up to a limit.

    Attributes:
        origin: position of the point [0, 0], m.
        step: distance between neighbouring points, m.
        clearance: distances in metres, shape (points along y, points along x); the limit where nothing is nearer.
        limit: beyond this the distance was not computed, m.
    """

    origin: Point
    step: float
    clearance: NDArray[np.float64]
    limit: float

    @classmethod
    def around(
        cls, segments: Segments, bounds: tuple[float, float, float, float], *, limit: float, step: float, margin: float
    ) -> DistanceGrid:
        """The grid over ``bounds`` and a margin about it.

        Args:
            segments: the walls, shape (n, 4).
            bounds: lower and upper corner: x, y, x, y in metres.
            limit: up to which distance to the walls is computed, m.
            step: grid step, m.
            margin: how far the grid goes beyond the bounds, m.
        """
        left, bottom, right, top = bounds
        x0, y0 = left - margin, bottom - margin
        columns = math.ceil((right + margin - x0) / step) + 1
        rows = math.ceil((top + margin - y0) / step) + 1
        return cls.on_grid(segments, (x0, y0), (rows, columns), limit=limit, step=step)

    @classmethod
    def on_grid(
        cls, segments: Segments, origin: Point, shape: tuple[int, int], *, limit: float, step: float
    ) -> DistanceGrid:
        """A grid of that many rows and columns of points from an origin on.

        Args:
            segments: the walls, shape (n, 4).
            origin: position of the point [0, 0], m.
            shape: points along y and along x.
            limit: up to which distance to the walls is computed, m.
            step: grid step, m.
        """
        (x0, y0), (rows, columns) = origin, shape
        squares = np.full((rows, columns), limit * limit)
        for ax, ay, bx, by in segments.tolist():
            left = max(math.floor((min(ax, bx) - limit - x0) / step), 0)
            right = min(math.ceil((max(ax, bx) + limit - x0) / step) + 1, columns)
            low = max(math.floor((min(ay, by) - limit - y0) / step), 0)
            high = min(math.ceil((max(ay, by) + limit - y0) / step) + 1, rows)
            if left >= right or low >= high:
                continue
            px = (x0 + step * np.arange(left, right) - ax)[None, :]
            py = (y0 + step * np.arange(low, high) - ay)[:, None]
            dx, dy = bx - ax, by - ay
            length = dx * dx + dy * dy
            along = np.clip((px * dx + py * dy) / length, 0.0, 1.0) if length > 0.0 else 0.0
            apart = square(px - along * dx) + square(py - along * dy)
            np.minimum(squares[low:high, left:right], apart, out=squares[low:high, left:right])
        return cls((x0, y0), step, np.sqrt(squares), limit)

    def cell(self, point: Point) -> tuple[int, int]:
        """Row and column of the grid point nearest to a point; may lie outside of the grid."""
        return round((point[1] - self.origin[1]) / self.step), round((point[0] - self.origin[0]) / self.step)

    def holds(self, cell: tuple[int, int]) -> bool:
        """Whether the grid has such a point."""
        rows, columns = self.clearance.shape
        return bool(0 <= cell[0] < rows and 0 <= cell[1] < columns)

    def point(self, row: int, column: int) -> Point:
        """Position of a grid point, m."""
        return self.origin[0] + self.step * column, self.origin[1] + self.step * row

    def nearest(self, point: Point, fits: Flags) -> tuple[int, int] | None:
        """Row and column of the point of ``fits`` nearest to a point, if one lies within three steps."""
        row, column = self.cell(point)
        low, left = max(row - 3, 0), max(column - 3, 0)
        rows, columns = np.nonzero(fits[low : row + 4, left : column + 4])
        if len(rows) == 0:
            return None
        down, across = rows + low - row, columns + left - column
        best = int(np.argmin(down * down + across * across))
        return int(rows[best]) + low, int(columns[best]) + left


def flood(free: Flags, seeds: Flags) -> NDArray[np.int32]:
    """How many steps to a neighbour above, below or beside it take from the seeds to each free point.

    Args:
        free: where one may go, shape (rows, columns).
        seeds: where one begins, the same shape.

    Returns:
        Steps, the same shape; -1 where no way leads.
    """
    rows, columns = free.shape
    width = columns + 2
    padded = np.zeros((rows + 2, width), dtype=np.bool_)
    padded[1:-1, 1:-1] = free
    open_points = padded.ravel()
    steps = np.full(open_points.shape, -1, dtype=np.int32)
    starts = np.zeros_like(padded)
    starts[1:-1, 1:-1] = seeds & free
    frontier = np.flatnonzero(starts)
    offsets = np.array([1, -1, width, -width])
    distance = 0
    while frontier.size:
        steps[frontier] = distance
        open_points[frontier] = False
        distance += 1
        neighbours = (frontier[:, None] + offsets).ravel()
        neighbours = neighbours[open_points[neighbours]]
        open_points[neighbours] = False
        # A point reached from two sides is kept once.
        steps[neighbours] = np.arange(len(neighbours), dtype=np.int32)
        frontier = neighbours[steps[neighbours] == np.arange(len(neighbours))]
    return steps.reshape(rows + 2, width)[1:-1, 1:-1].copy()


def within(mask: Flags, radius: int) -> Flags:
    """All points within ``radius`` grid steps (Euclidean) of a point of the mask."""
    rows, columns = mask.shape
    # Two passes: distances along each column first, then the best over neighbouring columns.
    far = radius + 1
    vertical = np.full(mask.shape, far, dtype=np.int64)
    vertical[mask] = 0
    for row in range(1, rows):
        np.minimum(vertical[row], vertical[row - 1] + 1, out=vertical[row])
    for row in range(rows - 2, -1, -1):
        np.minimum(vertical[row], vertical[row + 1] + 1, out=vertical[row])
    squares = np.where(vertical > radius, far * far, vertical * vertical)
    result = np.zeros(mask.shape, dtype=np.bool_)
    for shift in range(-min(radius, columns - 1), min(radius, columns - 1) + 1):
        hit = squares <= radius * radius - shift * shift
        source = hit[:, max(-shift, 0) : columns - max(shift, 0)]
        result[:, max(shift, 0) : columns + min(shift, 0)] |= source
    return result
