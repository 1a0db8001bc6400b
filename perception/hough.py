"""The Hough transform of a scan, the compass of 2015, and the walls that its maxima name.

A hit (x, y) lies on all lines ``p = x cos(alpha) + y sin(alpha)``; each hit within the trust area, a square around the
robot, adds one to the cell of each alpha. A square of half width s reaches to s sqrt(2), so that this is the largest p
and no hit falls outside the grid. The accurate compass is ``perception.compass``; this one is as fine as its grid.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from perception.compass import UNKNOWN, Compass
from perception.settings import HoughSettings
from perception.sweep import Floats

BLOCK = 18
"""So many alphas are voted for at a time: what that needs stays in the processor's cache."""


@dataclass(frozen=True, eq=False)
class HoughSpace:
    """The votes of a scan's hits.

    Attributes:
        votes: number of hits on each line, shape (alphas, ps).
        alphas: directions of the normals, rad within [0, pi).
        ps: distances of the lines from the robot's origin along the normal, m, negative on its other side.
        hits: how many hits are in the trust area.
    """

    votes: NDArray[np.int32]
    alphas: Floats
    ps: Floats
    hits: int


@dataclass(frozen=True, slots=True)
class HoughLine:
    """A maximum of the Hough space.

    Attributes:
        alpha: direction of the normal, rad within [0, pi).
        p: distance along the normal, m.
        votes: hits on the line.
    """

    alpha: float
    p: float
    votes: int


@dataclass(frozen=True, eq=False)
class _Grid:
    alphas: Floats
    ps: Floats
    transform: NDArray[np.float32]


@lru_cache(maxsize=8)
def _grid(area: float, step: float, cell: float) -> _Grid:
    """The grid, and the matrix that turns a column (x, y, 1) into the number of a hit's cell for each alpha."""
    alphas: Floats = np.arange(round(math.pi / step), dtype=np.float64) * step
    half = math.ceil(area * math.sqrt(2) / cell)
    count = 2 * half + 1
    shifts = np.arange(len(alphas)) * count + half + 0.5
    transform = np.stack((np.cos(alphas) / cell, np.sin(alphas) / cell, shifts), axis=1)
    ps: Floats = (np.arange(count, dtype=np.float64) - half) * cell
    return _Grid(alphas, ps, transform.astype(np.float32))


def hough_space(points: Floats, settings: HoughSettings) -> HoughSpace:
    """Let the hits in the trust area vote.

    Args:
        points: hits in the robot's frame, m, shape (n, 2).
        settings: the trust area and the grid.
    """
    grid = _grid(settings.area, settings.step, settings.cell)
    trusted = points.T[:, (np.abs(points[:, 0]) <= settings.area) & (np.abs(points[:, 1]) <= settings.area)]
    hits = trusted.shape[1]
    columns = np.ones((3, hits), np.float32)
    columns[:2] = trusted
    count = len(grid.ps)
    votes = np.empty((len(grid.alphas), count), np.int32)
    for first in range(0, len(votes), BLOCK):
        rows = votes[first : first + BLOCK]
        # Single precision is fine enough for a cell, and its numbers become whole ones many at once.
        cells = (grid.transform[first : first + BLOCK] @ columns).astype(np.int32).ravel()
        cells -= first * count
        rows.ravel()[:] = np.bincount(cells, minlength=rows.size)
    return HoughSpace(votes, grid.alphas, grid.ps, hits)


def hough_compass(space: HoughSpace, settings: HoughSettings, world_angle: float) -> Compass:
    """The misalignment by the line with the most hits, as in 2015.

    Args:
        space: the votes.
        settings: the least number of votes, as a share of the hits.
        world_angle: walls meet at its multiples, rad.
    """
    if not space.hits:
        return UNKNOWN
    best = int(space.votes.argmax())
    row, column = divmod(best, len(space.ps))
    share = int(space.votes[row, column]) / space.hits
    if share < settings.min_share:
        return UNKNOWN
    direction = float(space.alphas[row]) - math.pi / 2
    return Compass(math.remainder(direction, world_angle), share, settings.step / math.sqrt(12))


def hough_lines(space: HoughSpace, settings: HoughSettings, world_angle: float) -> list[HoughLine]:
    """The walls that the maxima name, the most hits first.

    As in 2015 the overall maximum gives the direction; all walls are taken to be parallel to it or at a multiple of the
    world angle. Along these directions further maxima count if they have votes enough and are far enough from those
    before.
    """
    if not space.hits:
        return []
    row = int(space.votes.argmax()) // len(space.ps)
    directions = len(space.alphas)
    turn = max(round(world_angle / settings.step), 1)
    rows = sorted({(row + k * turn) % directions for k in range(max(directions // turn, 1))})
    found: list[HoughLine] = []
    for each in rows:
        votes = space.votes[each].copy()
        while True:
            column = int(votes.argmax())
            count = int(votes[column])
            if count < settings.min_share * space.hits:
                break
            found.append(HoughLine(float(space.alphas[each]), float(space.ps[column]), count))
            votes[np.abs(space.ps - space.ps[column]) < settings.apart] = 0
    return sorted(found, key=lambda line: -line.votes)
