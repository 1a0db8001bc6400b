"""Paths over the grid: from the robot to every seen place, and to the edge of the seen area."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, label
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from perception.mapping.free_space import Cell, FreeSpace
from perception.mapping.settings import PlanSettings
from perception.sweep import Floats, Mask
from transport.arithmetic import distance_between
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
        outward: length of the shortest way from there out of the rectangle about all walls seen, m, if all that has not
            been seen were free.
    """

    place: Point
    beyond: Point
    distance: float
    outward: float


@dataclass(frozen=True, slots=True)
class EdgeAhead:
    """A frontier with the direction in which it lies.

    Attributes:
        frontier: the piece of the edge.
        towards: a place on the way to it, near its beginning; where it is nearer than that, what is beyond it.
    """

    frontier: Frontier
    towards: Point


def along(way: Way, distance: float) -> Point | None:
    """The place this far along a way, m; None where it is not that long."""
    gone = 0.0
    for one, other in pairwise(way):
        gone += distance_between(one, other)
        if gone >= distance:
            return other
    return None


def left_of(way: Way, place: Point) -> Way:
    """The rest of a way for a robot that has come from its beginning to a place near it."""
    apart = [distance_between(one, place) for one in way]
    nearest = min(range(len(way)), key=apart.__getitem__)
    return (place, *way[nearest + 1 :])


def length_of(way: Way) -> float:
    """The length of a way, m."""
    length = 0.0
    for one, other in pairwise(way):
        length += distance_between(one, other)
    return length


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

    def edges(self, ahead: float) -> tuple[EdgeAhead, ...]:
        """The frontiers, each with where the way to it leads first.

        Args:
            ahead: how far along the way that is, m.
        """
        found = []
        for frontier in self.frontiers():
            way = self.way_to(self.space.cell_of(frontier.place))
            on = along(way, ahead)
            found.append(EdgeAhead(frontier, frontier.beyond if on is None else on))
        return tuple(found)

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
        if not count:
            return []
        outward = ways_outward(self.space, self.room, self.settings.room * self.radius)
        found = []
        for number in range(1, count + 1):
            cells = np.argwhere(pieces == number)
            if len(cells) < self.settings.least_rim:
                continue
            lengths = self.distance[cells[:, 0], cells[:, 1]]
            cell = cells[int(np.argmin(lengths))].tolist()
            place = self.space.middle((cell[0], cell[1]))
            beyond = self._beyond((cell[0], cell[1]))
            found.append(Frontier(place, beyond, float(lengths.min()), outward.length((cell[0], cell[1]))))
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


@dataclass(frozen=True, eq=False, slots=True)
class WaysOutward:
    """How long the ways out of the rectangle about all walls seen would be, if all that has not been seen were free.

    A robot that always takes the shortest of these ways leaves a maze as the search called A* would: what it has
    driven, what it expects to drive.

    Attributes:
        low: the first cell of the grid that the table covers; may be outside the grid.
        side: this many cells a side are one of the table's.
        lengths: of the ways, m; where walls seen are all around, half of the rectangle's outline.
    """

    low: Cell
    side: int
    lengths: Floats

    def length(self, cell: Cell) -> float:
        """From a cell of the grid, m; 0 outside the rectangle."""
        column, row = (cell[0] - self.low[0]) // self.side, (cell[1] - self.low[1]) // self.side
        columns, rows = self.lengths.shape
        return float(self.lengths[column, row]) if 0 <= column < columns and 0 <= row < rows else 0.0


def ways_outward(space: FreeSpace, room: Floats, least: float) -> WaysOutward:
    """The ways out of the rectangle about all walls seen, from everywhere in it.

    Args:
        space: the grid.
        room: distance of each cell's middle from the nearest one with a wall, m, shape (columns, rows).
        least: the robot's origin keeps this far from cells with a wall, m.
    """
    size = space.settings.cell
    taken = space.taken
    if not taken.any():
        return WaysOutward((0, 0), 1, np.zeros((0, 0)))
    columns, rows = np.flatnonzero(taken.any(axis=1)), np.flatnonzero(taken.any(axis=0))
    # Cells are joined to larger ones as far as that opens no way through a wall.
    side = max(1, math.floor(least / size))
    margin = math.ceil(least / size) + side
    low, high = (int(columns[0]) - margin, int(rows[0]) - margin), (int(columns[-1]) + margin, int(rows[-1]) + margin)
    count = (high[0] - low[0]) // side + 1, (high[1] - low[1]) // side + 1
    passable = np.ones((count[0] * side, count[1] * side), dtype=bool)
    first, end = (max(low[0], 0), max(low[1], 0)), (min(high[0] + 1, room.shape[0]), min(high[1] + 1, room.shape[1]))
    here = (slice(first[0] - low[0], end[0] - low[0]), slice(first[1] - low[1], end[1] - low[1]))
    passable[here] = room[first[0] : end[0], first[1] : end[1]] >= least
    coarse: Mask = np.asarray(passable.reshape(count[0], side, count[1], side).any(axis=(1, 3)), dtype=bool)
    numbers = np.arange(coarse.size).reshape(count)
    border = np.unique(np.concatenate([numbers[[0, -1]].ravel(), numbers[:, [0, -1]].ravel()]))
    graph = _graph(coarse, np.ones(count), side * size)
    lengths = dijkstra(graph, indices=border, min_only=True)
    return WaysOutward(low, side, np.minimum(lengths, (count[0] + count[1]) * side * size).reshape(count))


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
    # Older versions of SciPy search graphs with 32-bit indices only.
    ends = np.concatenate([one, other]).astype(np.int32), np.concatenate([other, one]).astype(np.int32)
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
