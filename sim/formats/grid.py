"""A maze of square cells with walls between them, as micromouse files have it, and its use as an exit maze."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.formats.format import CannotHoldError, Source
from sim.maze import Leave, Maze, Point, Start, merge_collinear
from sim.solvability import LARGEST
from transport.messages import Pose

GridCell = tuple[int, int]
"""Column from the west and row from the south, counted from 0."""

SIDES = {"north": (0, 1), "east": (1, 0), "south": (0, -1), "west": (-1, 0)}
OPPOSITE = {"north": "south", "east": "west", "south": "north", "west": "east"}
HEADINGS = {"north": math.pi / 2, "east": 0.0, "south": -math.pi / 2, "west": math.pi}


@dataclass(frozen=True, slots=True, eq=False)
class CellMaze:
    """Cells and the walls between them.

    Attributes:
        name: the maze's name.
        across: walls that run east-west: [line, column], line 0 in the south; shape (rows + 1, columns).
        upright: walls that run north-south: [row, line], line 0 in the west; shape (rows, columns + 1).
        entrance: the corner cell where a mouse would start.
        goals: the goal cells.
    """

    name: str
    across: NDArray[np.bool_]
    upright: NDArray[np.bool_]
    entrance: GridCell
    goals: tuple[GridCell, ...]

    @property
    def columns(self) -> int:
        """Number of cells from west to east."""
        return int(self.across.shape[1])

    @property
    def rows(self) -> int:
        """Number of cells from south to north."""
        return int(self.upright.shape[0])

    def at(self, point: Point, size: float) -> GridCell:
        """The cell at a point of the maze, or the nearest one.

        Args:
            point: in the frame of `exit_maze`, m.
            size: edge of a cell, m.
        """
        column, row = math.floor(point[0] / size), math.floor(point[1] / size)
        return min(max(column, 0), self.columns - 1), min(max(row, 0), self.rows - 1)

    def wall(self, cell: GridCell, side: str) -> bool:
        """Whether there is a wall on a side of a cell."""
        column, row = cell
        if side in {"north", "south"}:
            return bool(self.across[row + (side == "north"), column])
        return bool(self.upright[row, column + (side == "east")])

    def outer(self, cell: GridCell, side: str) -> bool:
        """Whether a side of a cell lies on the maze's outer boundary."""
        step = SIDES[side]
        return not (0 <= cell[0] + step[0] < self.columns and 0 <= cell[1] + step[1] < self.rows)


def refuse_large(source: Source, columns: int, rows: int, size: float) -> None:
    """Refuse a maze of more cells than are searched.

    Raises:
        MazeError: it is longer or wider than the largest maze.
    """
    if max(columns, rows) * size > LARGEST:
        raise source.error(
            f"{columns} x {rows} cells of {size:g} m are {columns * size:.4g} by {rows * size:.4g} m; more than "
            f"the limit is {LARGEST:.0f} m",
            hint="check the metres a cell",
        )


def goal_cells(columns: int, rows: int) -> tuple[GridCell, ...]:
    """The one, two or four cells in the middle, which are the goal of a contest's maze where the file names none."""
    middle_x = range((columns - 1) // 2, columns // 2 + 1)
    middle_y = range((rows - 1) // 2, rows // 2 + 1)
    return tuple((x, y) for y in reversed(middle_y) for x in middle_x)


def exit_maze(cells: CellMaze, size: float) -> Maze:
    """The maze the other way round: from a goal cell to an opening in the outer wall beside the entrance.

    The origin is the south-west corner, x goes east, y north. The robot starts in the middle of the first goal cell
    and faces its first open side of north, east, south, west. The opening is in line with the way into the entrance
    cell where that side lies on the boundary, otherwise on its first outer side of south, west, east, north.

    Args:
        cells: the maze.
        size: edge of a cell, m.
    """
    goal = cells.goals[0]
    facing = next((side for side in HEADINGS if not cells.wall(goal, side)), "north")
    entrance = cells.entrance
    outer = [side for side in ("south", "west", "east", "north") if cells.outer(entrance, side)]
    ahead = [side for side in outer if not cells.wall(entrance, OPPOSITE[side])]
    segments = []
    opening = _edge(entrance, (ahead or outer)[0], size)
    for line, column in np.argwhere(cells.across).tolist():
        segments.append((column * size, line * size, (column + 1) * size, line * size))
    for row, line in np.argwhere(cells.upright).tolist():
        segments.append((line * size, row * size, line * size, (row + 1) * size))
    kept = [segment for segment in segments if segment not in (opening, (*opening[2:], *opening[:2]))]
    return Maze(
        name=cells.name,
        walls=merge_collinear(np.asarray(kept, dtype=np.float64).reshape(-1, 4)),
        start=Start(Pose((goal[0] + 0.5) * size, (goal[1] + 0.5) * size, HEADINGS[facing])),
        exits=np.asarray([opening]),
        time_limit=math.inf,
    )


def _edge(cell: GridCell, side: str, size: float) -> tuple[float, float, float, float]:
    column, row = cell
    if side in {"north", "south"}:
        y = (row + (side == "north")) * size
        return column * size, y, (column + 1) * size, y
    x = (column + (side == "east")) * size
    return x, row * size, x, (row + 1) * size


def as_cells(maze: Maze, size: float) -> CellMaze:
    """A maze as cells: its start is the goal cell, and the cell inside its exit is the entrance.

    Args:
        maze: a maze whose walls lie on a lattice, with one exit and neither doors nor moving objects.
        size: edge of a cell, m.

    Raises:
        CannotHoldError: it is none of that kind, or `exit_maze` would put its exit elsewhere.
    """
    if maze.doors or maze.objects or maze.others or len(maze.exits) != 1 or len(maze.unknown) or maze.goal != Leave():
        raise CannotHoldError("cells have neither doors nor moving objects, and one start, one exit and no other goal")
    walls = np.concatenate([maze.walls, maze.exits])
    low = walls.reshape(-1, 2).min(axis=0)
    lines = (walls - np.tile(low, 2)) / size
    lattice = np.round(lines).astype(int)
    columns, rows = lattice.reshape(-1, 2).max(axis=0).tolist()
    across = np.zeros((rows + 1, columns), dtype=np.bool_)
    upright = np.zeros((rows, columns + 1), dtype=np.bool_)
    for wall, exact, (ax, ay, bx, by) in zip(walls.tolist(), lines, lattice.tolist(), strict=True):
        if np.abs(exact - (ax, ay, bx, by)).max() > 1e-3 or (ax != bx and ay != by):
            x1, y1, x2, y2 = wall
            raise CannotHoldError(
                f"the wall from ({x1:g}, {y1:g}) to ({x2:g}, {y2:g}) m does not lie on a lattice of {size:g} m"
            )
        if ay == by:
            across[ay, min(ax, bx) : max(ax, bx)] = True
        else:
            upright[min(ay, by) : max(ay, by), ax] = True
    ax, ay, bx, by = lattice[-1].tolist()
    inward = (0.5 * (by - ay), -0.5 * (bx - ax))
    entrance = math.floor((ax + bx) / 2 + inward[0]), math.floor((ay + by) / 2 + inward[1])
    start = (np.asarray(maze.start_point) - low) / size
    goal = math.floor(float(start[0])), math.floor(float(start[1]))
    cells = CellMaze(maze.name, across, upright, entrance, (goal,))
    there, here = (np.sort(exits.reshape(2, 2), axis=0) for exits in (exit_maze(cells, size).exits, maze.exits))
    if not np.allclose(there, here - low, atol=1e-3 * size):
        raise CannotHoldError("an exit beside this corner cell would be read at its other outer side")
    return cells
