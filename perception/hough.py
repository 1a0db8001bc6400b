"""The Hough transform of a scan, the compass of 2015, and the walls that its maxima name.

A hit (x, y) lies on all lines ``p = x cos(alpha) + y sin(alpha)``; each hit within the trust area, a square around the
robot, adds one to the cell of each alpha. A square of half width s reaches to s sqrt(2), so that this is the largest p
and no hit falls outside the grid. The accurate compass is ``perception.compass``; this one is as fine as its grid.

The compass of 2015 needs the overall maximum only. From one alpha to the next a hit moves by few cells, so the votes
for one bound those for its neighbours, and where that bound is too low nobody has to vote.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from perception.compass import UNKNOWN, Compass
from perception.extremes import highest
from perception.settings import HoughSettings
from perception.sweep import Floats, Indices
from transport.arithmetic import cosines_and_sines
from transport.compiled import compiled

Votes = NDArray[np.int32]

BLOCK = 20
"""This many alphas are voted for at a time: what that needs stays in the processor's cache."""


@dataclass(frozen=True, eq=False)
class HoughSpace:
    """The votes of a scan's hits.

    Attributes:
        votes: number of hits on each line, shape (alphas, ps).
        alphas: directions of the normals, rad within [0, pi).
        ps: distances of the lines from the robot's origin along the normal, m, negative on its other side.
        hits: how many hits are in the trust area.
    """

    votes: Votes
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
    """All lines that are voted on, as in ``HoughSettings`` and ``HoughSpace``.

    Every third row and the rows beside them are all rows. The transform, multiplied by a column (x, y, 1), is the
    number of a hit's cell for each alpha.
    """

    step: float
    cell: float
    every_third: Indices
    alphas: Floats
    ps: Floats
    transform: NDArray[np.float32]


@lru_cache(maxsize=8)
def _grid(area: float, step: float, cell: float) -> _Grid:
    alphas: Floats = np.arange(max(round(math.pi / step), 1), dtype=np.float64) * step
    half = math.ceil(area * math.sqrt(2) / cell)
    cos, sin = cosines_and_sines(alphas)
    transform = np.stack((cos / cell, sin / cell, np.full(len(alphas), half + 0.5)), axis=1)
    ps: Floats = (np.arange(2.0 * half + 1) - half) * cell
    every_third = np.minimum(np.arange(1, len(alphas) + 1, 3), len(alphas) - 1)
    return _Grid(step, cell, every_third, alphas, ps, transform.astype(np.float32))


@dataclass(frozen=True, eq=False)
class _Voters:
    """The hits in the trust area.

    Attributes:
        grid: what they vote on.
        columns: x and y of each, in single precision, which is fine enough for a cell, shape (2, hits).
    """

    grid: _Grid
    columns: NDArray[np.float32]

    @classmethod
    def of(cls, points: Floats, settings: HoughSettings) -> _Voters:
        x, y = points[:, 0], points[:, 1]
        trusted = ((np.abs(x) <= settings.area) & (np.abs(y) <= settings.area)).nonzero()[0]
        columns = np.empty((2, len(trusted)), np.float32)
        columns[0], columns[1] = x[trusted], y[trusted]
        return cls(_grid(settings.area, settings.step, settings.cell), columns)

    @property
    def count(self) -> int:
        """How many hits vote."""
        return len(self.columns[0])

    def votes(self, rows: Indices) -> Votes:
        """The votes for the lines of some alphas, shape (rows, ps)."""
        votes = np.empty((len(rows), len(self.grid.ps)), np.int32)
        count_votes(self.grid.transform[rows], self.columns, votes)
        return votes

    def maximum(self) -> tuple[int, int]:
        """The row of the line with the most votes, the lowest such row, and its votes."""
        rows = self.grid.every_third
        votes = self.votes(rows)
        tops = votes.max(axis=1)
        promising = rows[self._bounds(votes) >= tops[tops.argmax()]]
        # Behind the last alpha comes the first, with the other sign of p.
        beside = np.concatenate((promising - 1, promising + 1)) % len(self.grid.alphas)
        rows, tops = np.concatenate((rows, beside)), np.concatenate((tops, self.votes(beside).max(axis=1)))
        most = tops.item(tops.argmax())
        return min(rows[tops == most].tolist()), most

    def _bounds(self, votes: Votes) -> Votes:
        """For each row the most votes that a line of the rows beside it can have, shape (rows,).

        Its hits are all within a window around its cell, as wide as the farthest hit moves from row to row. The windows
        are sums of the cells that end at each cell, taken along all rows at once: those that begin in the row before
        are too high, which a bound may be.
        """
        x, y = self.columns
        farthest = math.sqrt(highest(x * x + y * y))
        moves = math.ceil(farthest * self.grid.step / self.grid.cell + 0.01)  # a little more, for single precision
        sums = votes.ravel().cumsum(dtype=np.int32)
        windows = sums.copy()
        windows[2 * moves + 1 :] -= sums[: -2 * moves - 1]
        bounds: Votes = windows.reshape(votes.shape).max(axis=1)
        return bounds


@compiled
def count_votes(transform: NDArray[np.float32], columns: NDArray[np.float32], votes: Votes) -> None:
    """Let hits vote for one line of each of some alphas.

    Args:
        transform: of each alpha, shape (rows, 3); see `_Grid`.
        columns: x and y of each hit, shape (2, hits).
        votes: becomes the number of votes for each line, shape (rows, ps).
    """
    count = votes.shape[1]
    # In one sequence of cells, row upon row, a single count serves many rows.
    shifts = np.arange(0, BLOCK * count, count, dtype=np.int32)[:, None]
    for first in range(0, len(transform), BLOCK):
        block = votes[first : first + BLOCK]
        cells = _cells(transform[first : first + BLOCK], columns)
        cells += shifts[: len(block)]
        block.ravel()[:] = np.bincount(cells.ravel(), minlength=block.size)


def _cells(transform: NDArray[np.float32], columns: NDArray[np.float32]) -> Votes:
    """The number of each hit's cell for some alphas, shape (rows, hits), without BLAS (`transport.arithmetic`)."""
    cosine, sine, middle = transform.T[:, :, None]
    x, y = columns
    numbers: NDArray[np.float32] = cosine * x
    numbers += sine * y
    numbers += middle
    cells: Votes = numbers.astype(np.int32)
    return cells


def hough_space(points: Floats, settings: HoughSettings) -> HoughSpace:
    """Let the hits in the trust area vote.

    Args:
        points: hits in the robot's frame, m, shape (n, 2).
        settings: the trust area and the grid.
    """
    voters = _Voters.of(points, settings)
    grid = voters.grid
    return HoughSpace(voters.votes(np.arange(len(grid.alphas))), grid.alphas, grid.ps, voters.count)


def hough_compass(points: Floats, settings: HoughSettings, world_angle: float) -> Compass:
    """The misalignment by the line with the most hits, as in 2015.

    Args:
        points: hits in the robot's frame, m, shape (n, 2).
        settings: the trust area, the grid, and the least number of votes as a share of the hits.
        world_angle: walls meet at its multiples, rad.
    """
    voters = _Voters.of(points, settings)
    if not voters.count:
        return UNKNOWN
    row, votes = voters.maximum()
    share = votes / voters.count
    if share < settings.min_share:
        return UNKNOWN
    direction = float(voters.grid.alphas[row]) - math.pi / 2
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
