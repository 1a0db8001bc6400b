"""A maze as an occupancy grid, as in mapping tools."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim.free_space import DistanceGrid, flood
from sim.maze import Maze, Point

FREE, OCCUPIED, UNKNOWN = 0, 100, -1
RESOLUTION = 0.05
"""Edge of a cell, m, in all but very large mazes."""
MOST_CELLS = 4_000_000
MARGIN = 0.5
"""The margin of the grid around the maze, m."""


def occupancy(maze: Maze) -> tuple[NDArray[np.int8], float, Point]:
    """A maze, with its doors shut and without what moves, as a grid of cells.

    Cells with a wall or a door in them are occupied; others are free where a way leads there from the start or from
    beyond an exit, and unknown elsewhere.

    Returns:
        The cells, shape (rows, columns), the first row at the lower edge; the edge of a cell, m; and the grid's lower
        left corner, m.
    """
    left, bottom, right, top = (value + sign * MARGIN for value, sign in zip(maze.bounds, (-1, -1, 1, 1), strict=True))
    resolution = max(RESOLUTION, math.sqrt((right - left) * (top - bottom) / MOST_CELLS))
    shape = math.ceil((top - bottom) / resolution), math.ceil((right - left) / resolution)
    leaves = np.asarray([[*door.leaf[0], *door.leaf[1]] for door in maze.doors], dtype=np.float64).reshape(-1, 4)
    middle = left + resolution / 2, bottom + resolution / 2
    solid = DistanceGrid.on_grid(np.concatenate([maze.walls, leaves]), middle, shape, limit=resolution, step=resolution)
    edges = DistanceGrid.on_grid(maze.unknown, middle, shape, limit=resolution, step=resolution)
    # A wall that touches a cell is at most half its diagonal from its centre, at a right angle at most half its edge.
    near = resolution / 2 + 1e-9
    occupied, barred = solid.clearance <= near, edges.clearance <= near
    start = np.zeros(shape, dtype=np.bool_)
    for x, y in [maze.start_point]:
        row, column = solid.cell((x, y))
        start[row, column] = True
    known = flood(~occupied & ~barred, start) >= 0
    cells = np.full(shape, UNKNOWN, dtype=np.int8)
    cells[known] = FREE
    cells[occupied] = OCCUPIED
    return cells, resolution, (left, bottom)
