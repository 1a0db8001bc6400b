"""Paths over the grid: from the robot to every seen place, and to the edge of the seen area."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, label
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from perception.mapping.free_space import Cell, FreeSpace
from perception.mapping.settings import PlanSettings
from perception.sweep import Floats, Mask
from transport.description import Point

Way = tuple[Point, ...]
"""A list of places, some centimetres apart, m."""


@dataclass(frozen=True, slots=True)
class Frontier:
    """A frontier: a piece of the edge of the seen area that the robot can reach.

    Attributes:
        place: the cell of it to which the way is the shortest, m.
        beyond: the middle of what has not been seen beside that place, m.
        distance: length of that way, longer where it is narrow, m.
        inside: how far it is from the rim of all that has been seen, m: small at the outside of the map.
    """

    place: Point
    beyond: Point
    distance: float
    inside: float


@dataclass(frozen=True, eq=False, slots=True)
class ShortestWays:
    """The shortest ways from one place.

    Attributes:
        space: the grid.
        room: distance of each cell's middle from the nearest one with a wall, m, shape (columns, rows).
        distance: length of the way to each cell, longer where it is narrow, m; infinity where there is none.
        before: the cell before each one on its way, as a number in the flattened grid; negative where there is none.
        radius: of the robot, m.
        settings: how much room is wanted.
    """

    space: FreeSpace
    room: Floats
    distance: Floats
    before: NDArray[np.int32]
    radius: float
    settings: PlanSettings

    def way_to(self, cell: Cell) -> Way:
        """The way to a cell; empty where there is none."""
        if not self.space.holds(cell) or not math.isfinite(self.distance[cell]):
            return ()
        rows = self.distance.shape[1]
        number = cell[0] * rows + cell[1]
        cells = []
        while number >= 0:
            cells.append(divmod(number, rows))
            number = int(self.before[number])
        return tuple(self.space.middle((int(column), int(row))) for column, row in reversed(cells))

    def nearest(self, point: Point, within: float) -> Cell | None:
        """The reachable cell nearest to a point, at most so far away, m; None where there is none."""
        cell = self.space.cell_of(point)
        away = math.ceil(within / self.space.settings.cell)
        columns, rows = self.distance.shape
        low = max(cell[0] - away, 0), max(cell[1] - away, 0)
        part = self.distance[low[0] : min(cell[0] + away + 1, columns), low[1] : min(cell[1] + away + 1, rows)]
        reachable = np.argwhere(np.isfinite(part))
        if not len(reachable):
            return None
        off = reachable + low - np.array(cell)
        squares = np.sum(off * off, axis=1)
        best = int(np.argmin(squares))
        if squares[best] > away * away:
            return None
        return int(reachable[best][0]) + low[0], int(reachable[best][1]) + low[1]

    def frontiers(self) -> list[Frontier]:
        """The pieces of the rim of what has been seen that can be reached, in the order of the grid."""
        unknown = self.space.belief == 0
        beside = _beside(unknown)
        rim = beside & np.isfinite(self.distance) & (self.room >= self.settings.rim_room * self.radius)
        pieces, count = label(rim, structure=np.ones((3, 3), dtype=int))
        seen = ~unknown
        if not seen.any():
            return []
        columns, rows = np.flatnonzero(seen.any(axis=1)), np.flatnonzero(seen.any(axis=0))
        found = []
        for number in range(1, count + 1):
            cells = np.argwhere(pieces == number)
            if len(cells) < self.settings.least_rim:
                continue
            lengths = self.distance[cells[:, 0], cells[:, 1]]
            cell = cells[int(np.argmin(lengths))].tolist()
            inside = min(cell[0] - columns[0], columns[-1] - cell[0], cell[1] - rows[0], rows[-1] - cell[1])
            place = self.space.middle((cell[0], cell[1]))
            length, deep = float(lengths.min()), float(inside) * self.space.settings.cell
            found.append(Frontier(place, self._beyond((cell[0], cell[1])), length, deep))
        return found

    def _beyond(self, cell: Cell) -> Point:
        """The middle of the unknown cells about a cell of the rim."""
        low = max(cell[0] - 2, 0), max(cell[1] - 2, 0)
        about = self.space.belief[low[0] : cell[0] + 3, low[1] : cell[1] + 3]
        columns, rows = (about == 0).nonzero()
        size = self.space.settings.cell
        x, y = self.space.middle(low)
        return x + float(np.mean(columns)) * size, y + float(np.mean(rows)) * size


def plan_from(space: FreeSpace, start: Point, radius: float, settings: PlanSettings) -> ShortestWays:
    """The shortest ways from a place to all cells that can be reached.

    Args:
        space: the grid.
        start: where the ways begin; the cell there counts as free. Where it is outside the grid there are none.
        radius: of the robot, m.
        settings: how much room is wanted.
    """
    size = space.settings.cell
    cell = space.cell_of(start)
    if not space.holds(cell):
        nowhere = np.full(space.belief.shape, math.inf)
        return ShortestWays(space, nowhere, nowhere, np.full(space.belief.size, -1, dtype=np.int32), radius, settings)
    room: Floats = distance_transform_edt(~space.taken) * size
    passable = space.free & (room >= settings.room * radius)
    # The robot cannot be planned through cells too near to a wall, but it may be in one and must get away.
    near = (slice(max(cell[0] - 2, 0), cell[0] + 3), slice(max(cell[1] - 2, 0), cell[1] + 3))
    passable[near] |= space.free[near]
    passable[cell] = True
    dear = 1.0 + settings.dear * np.maximum(0.0, 1.0 - room / settings.ease)
    graph = _graph(passable, dear, size)
    number = cell[0] * passable.shape[1] + cell[1]
    distance, before = dijkstra(graph, indices=number, return_predecessors=True)
    return ShortestWays(space, room, distance.reshape(passable.shape), before, radius, settings)


STEPS = (((1, 0), 1.0), ((0, 1), 1.0), ((1, 1), math.sqrt(2.0)), ((1, -1), math.sqrt(2.0)))
"""To the neighbours of a cell: columns, rows, and how far that is in cells; each represents its opposite, too."""


def _graph(passable: Mask, dear: Floats, size: float) -> csr_array:
    """The passable cells, each joined to its passable neighbours by how long the way is."""
    rows = passable.shape[1]
    numbers = np.arange(passable.size).reshape(passable.shape)
    first, second, lengths = [], [], []
    for (columns, up), length in STEPS:
        here = (slice(0, passable.shape[0] - columns), slice(max(-up, 0), rows - max(up, 0)))
        there = (slice(columns, None), slice(max(up, 0), rows - max(-up, 0)))
        both = passable[here] & passable[there]
        first.append(numbers[here][both])
        second.append(numbers[there][both])
        lengths.append((dear[here][both] + dear[there][both]) * (length * size / 2))
    one, other, all_lengths = np.concatenate(first), np.concatenate(second), np.concatenate(lengths)
    ends = np.concatenate([one, other]), np.concatenate([other, one])
    return csr_array((np.concatenate([all_lengths, all_lengths]), ends), shape=(passable.size, passable.size))


def _beside(cells: Mask) -> Mask:
    """The cells with one of these among their eight neighbours."""
    wide = np.pad(cells, 1)
    columns, rows = cells.shape
    beside = np.zeros_like(cells)
    for i in range(3):
        for j in range(3):
            beside |= wide[i : i + columns, j : j + rows]
    return beside
