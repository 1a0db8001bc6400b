"""The correlative search: where a scan fits best within a window, found reliably and at a bounded cost.

Points are looked up in a grid in which the walls are blurred. A coarse grid of the largest values bounds what any place
within a block can score. Only blocks that may hold the best place are searched in full (Olson, "Real-time
correlative scan matching", 2009). Scores are sums of whole numbers: the same on every processor.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from perception.mapping.cloud import Cloud, thinned
from perception.mapping.frames import placed
from perception.mapping.settings import SearchSettings
from perception.sweep import Floats
from transport.arithmetic import exp, norm, square
from transport.messages import Pose, wrap_angle

Bytes = NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class Window:
    """Where to search, about a guess.

    Attributes:
        across: to each side in x and y, m.
        turn: to each side, rad.
    """

    across: float
    turn: float


@dataclass(frozen=True, slots=True)
class Found:
    """The best place in a window.

    Attributes:
        pose: of the robot in the reference's frame.
        score: the points' mean value in the grid, 0 to 1.
        rival: score of the best place that is another one, 0 to 1.
    """

    pose: Pose
    score: float
    rival: float


@dataclass(frozen=True, eq=False)
class BlurredWalls:
    """Walls blurred, the value of a cell 0 to 255, and for each cell the largest value of the block that begins there.

    Attributes:
        values: shape (columns, rows).
        bounds: shape (columns, rows).
        origin: the corner of the first cell, m.
        settings: how fine.
    """

    values: Bytes
    bounds: Bytes
    origin: tuple[float, float]
    settings: SearchSettings

    @classmethod
    def of(cls, cloud: Cloud, settings: SearchSettings) -> BlurredWalls:
        """Draw a cloud."""
        cell, block = settings.cell, settings.block
        radius = math.ceil(2.5 * settings.blur / cell)
        margin = radius + block + 1
        low = np.floor(cloud.points.min(axis=1) / cell).astype(np.intp) - margin
        high = np.floor(cloud.points.max(axis=1) / cell).astype(np.intp) + margin
        shape = high - low + 1
        at = np.floor(cloud.points / cell).astype(np.intp) - low[:, None]
        stamps = sorted(
            (round(255 * exp(-((i * i + j * j) * cell * cell) / (2 * square(settings.blur)))), i, j)
            for i in range(-radius, radius + 1)
            for j in range(-radius, radius + 1)
        )
        values = np.zeros(tuple(shape), dtype=np.uint8)
        for value, i, j in stamps:
            values[at[0] + i, at[1] + j] = value
        bounds = values.copy()
        for away in range(1, block):
            bounds[:-away] = np.maximum(bounds[:-away], values[away:])
        across = bounds.copy()
        for away in range(1, block):
            bounds[:, :-away] = np.maximum(bounds[:, :-away], across[:, away:])
        return cls(values, bounds, (float(low[0] * cell), float(low[1] * cell)), settings)

    def cells(self, points: Floats) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """The cells of points, given in the cloud's frame."""
        cell = self.settings.cell
        x = np.floor((points[0] - self.origin[0]) / cell).astype(np.intp)
        y = np.floor((points[1] - self.origin[1]) / cell).astype(np.intp)
        return x, y


def _looked_up(table: Bytes, x: NDArray[np.intp], y: NDArray[np.intp]) -> NDArray[np.int64]:
    """Sums over the last axis of a table's values; values outside count as zero."""
    columns, rows = table.shape
    inside = (x >= 0) & (x < columns) & (y >= 0) & (y < rows)
    values = table[np.where(inside, x, 0), np.where(inside, y, 0)]
    sums: NDArray[np.int64] = np.sum(np.where(inside, values, 0), axis=-1, dtype=np.int64)
    return sums


def search(cloud: Cloud, grid: BlurredWalls, guess: Pose, window: Window) -> Found:
    """The best place of a scan within a window about a guess.

    Args:
        cloud: the scan, in the robot's frame.
        grid: the walls.
        guess: of the robot's pose in the grid's frame.
        window: how far from the guess to look.
    """
    settings = grid.settings
    points = thinned(cloud, settings.points).points
    count = points.shape[1]
    block, cell = settings.block, settings.cell
    blocks = math.ceil(window.across / (block * cell))
    shifts = np.arange(-blocks, blocks + 1) * block
    turns = math.ceil(window.turn / settings.turn)
    headings = [guess.heading + number * settings.turn for number in range(-turns, turns + 1)]
    at = [grid.cells(placed(points, Pose(guess.x, guess.y, heading))) for heading in headings]
    bounds = np.concatenate(
        [
            _looked_up(
                grid.bounds,
                (x + shifts[:, None, None]) + np.zeros_like(shifts)[None, :, None],
                (y + shifts[None, :, None]) + np.zeros_like(shifts)[:, None, None],
            ).ravel()
            for x, y in at
        ]
    )
    order = np.argsort(-bounds, kind="stable")
    fine = np.arange(block)
    side = len(shifts)
    best: list[tuple[int, Pose]] = []
    top = 0
    for candidate in order.tolist():
        if bounds[candidate] <= max(settings.distinct * top, 1):
            break
        turn, place = divmod(candidate, side * side)
        dx, dy = shifts[place // side], shifts[place % side]
        x, y = at[turn]
        scores = _looked_up(
            grid.values,
            (x + (dx + fine)[:, None, None]) + np.zeros_like(fine)[None, :, None],
            (y + (dy + fine)[None, :, None]) + np.zeros_like(fine)[:, None, None],
        ).ravel()
        which = int(np.argmax(scores))
        score = int(scores[which])
        if score > settings.distinct * top:
            shift_x, shift_y = int(dx) + which // block, int(dy) + which % block
            pose = Pose(guess.x + shift_x * cell, guess.y + shift_y * cell, wrap_angle(headings[turn]))
            best.append((score, pose))
            top = max(top, score)
    if not best:
        return Found(guess, 0.0, 0.0)
    score, pose = max(best, key=lambda one: one[0])
    rivals = [other for other, at_pose in best if _apart(pose, at_pose, settings)]
    return Found(pose, score / (255 * count), max(rivals, default=0) / (255 * count))


def _apart(one: Pose, other: Pose, settings: SearchSettings) -> bool:
    turned = abs(wrap_angle(one.heading - other.heading))
    return norm(one.x - other.x, one.y - other.y) > settings.apart or turned > 6 * settings.turn
