"""Whether a scan, seen from the robot's estimated place, shows what the grid of free space holds."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from perception.mapping.frames import compose, placed
from perception.mapping.free_space import FreeSpace
from perception.mapping.settings import PlaceSettings
from perception.sweep import Mask, ScanPoints
from transport.arithmetic import norms
from transport.messages import Pose


@dataclass(frozen=True, slots=True)
class Agreement:
    """How the hits of a scan lie on a grid.

    Attributes:
        hits: how many were examined.
        share: of them that lie on or beside a cell with a wall, 0 to 1.
        contradicted: share that lie amid free cells, 0 to 1.
        hidden: share that lie where nothing is known, behind a wall, 0 to 1.
        elsewhere: share of the directions that agree, without the widest sector of those that do not, 0 to 1: one thing
            that is new, such as a door that has shut, leaves it at 1.
    """

    hits: int
    share: float
    contradicted: float
    hidden: float
    elsewhere: float

    def fits(self, settings: PlaceSettings) -> bool:
        """Whether the scan may have been taken there by a robot that has followed the map to there."""
        seen = self.hits >= settings.least_hits and self.share >= settings.agreeing
        return seen and self.contradicted <= settings.contradicted and self.hidden <= settings.hidden

    def shows(self, settings: PlaceSettings) -> bool:
        """Whether the scan agrees so well with the grid there that a lost robot may be there."""
        seen = self.hits >= settings.least_hits and self.share >= settings.found
        return seen and self.contradicted <= settings.found_contradicted and self.hidden <= settings.found_hidden


BEFORE = 0.3
"""A wall nearer than this before a hit may be the one that was hit, m."""
NOTHING_SEEN = Agreement(0, 0.0, 0.0, 0.0, 0.0)


def agreement_of(space: FreeSpace, sweep: ScanPoints, pose: Pose, settings: PlaceSettings) -> Agreement:
    """Lay a scan on a grid.

    Args:
        space: the grid.
        sweep: the scan.
        pose: where the robot may be, in the grid's frame.
        settings: how many hits, how wide a sector.
    """
    near = np.flatnonzero(sweep.distances < min(sweep.reach, space.settings.reach))
    near = near[:: max(len(near) // settings.hits, 1)]
    cells = np.floor(placed(sweep.points.T[:, near], pose) / space.settings.cell).astype(np.intp)
    x, y = cells[0] - space.corner[0], cells[1] - space.corner[1]
    columns, rows = space.belief.shape
    inside = (x >= 1) & (x < columns - 1) & (y >= 1) & (y < rows - 1)
    if not inside.any():
        return NOTHING_SEEN
    x, y, cells = x[inside], y[inside], cells[:, inside]
    about = [space.belief[x + i, y + j] for i in (-1, 0, 1) for j in (-1, 0, 1)]
    taken, free = np.minimum.reduce(about) < 0, np.minimum.reduce(about) > 0
    beams = sweep.beams[near[inside]]
    count = len(near)
    hidden = _behind_walls(space, compose(pose, sweep.fan.mount), cells[:, ~(taken | free)])
    elsewhere = _elsewhere(taken, beams // max(round(settings.direction / sweep.fan.step), 1), settings)
    share, contradicted = int(np.sum(taken)) / count, int(np.sum(free)) / count
    return Agreement(count, share, contradicted, hidden / count, elsewhere)


def walls_shown(space: FreeSpace, sweep: ScanPoints, pose: Pose) -> frozenset[int]:
    """The cells with a wall, as numbers in the flattened grid, in which hits of a scan lie.

    Args:
        space: the grid.
        sweep: the scan.
        pose: where the robot may be, in the grid's frame.
    """
    near = sweep.distances < min(sweep.reach, space.settings.reach)
    cells = np.floor(placed(sweep.points.T[:, near], pose) / space.settings.cell).astype(np.intp)
    x, y = cells[0] - space.corner[0], cells[1] - space.corner[1]
    columns, rows = space.belief.shape
    inside = (x >= 0) & (x < columns) & (y >= 0) & (y < rows)
    numbers = x[inside] * rows + y[inside]
    return frozenset(numbers[space.belief.ravel()[numbers] < 0].tolist())


def _behind_walls(space: FreeSpace, sensor: Pose, cells: NDArray[np.intp]) -> int:
    """How many cells, shape (2, n), are hidden from a sensor by a wall of the grid."""
    if not cells.shape[1]:
        return 0
    size = space.settings.cell
    dx, dy = (cells[0] + 0.5) * size - sensor.x, (cells[1] + 0.5) * size - sensor.y
    away = norms(dx, dy)
    steps = np.arange(1, math.ceil(float(np.max(away)) / size) + 1) * size
    shares = np.minimum(steps[:, None] / np.maximum(away, size), 1.0)
    x = np.floor((sensor.x + shares * dx) / size).astype(np.intp) - space.corner[0]
    y = np.floor((sensor.y + shares * dy) / size).astype(np.intp) - space.corner[1]
    columns, rows = space.belief.shape
    before = (steps[:, None] < away - BEFORE) & (x >= 0) & (x < columns) & (y >= 0) & (y < rows)
    walls = before & (space.belief[np.where(before, x, 0), np.where(before, y, 0)] < 0)
    return int(np.sum(walls.any(axis=0)))


def _elsewhere(agree: Mask, directions: NDArray[np.intp], settings: PlaceSettings) -> float:
    """The share of the directions in which most hits agree, without the widest sector of others."""
    all_hits = np.bincount(directions)
    agreeing = np.bincount(directions, agree)
    seen = all_hits > 0
    good = (2 * agreeing[seen] >= all_hits[seen]).tolist()
    widest = run = 0
    for one in good:
        run = 0 if one else run + 1
        widest = max(widest, run)
    widest = min(widest, math.floor(settings.widest / settings.direction))
    return float(good.count(True) / max(len(good) - widest, 1))
