"""Mazes of the mms simulator (``.num``): one line a cell, ``x y N E S W`` with 0 or 1 for each wall."""

from __future__ import annotations

import re

import numpy as np

from sim.formats.format import CannotHoldError, Choices, Format, Sketch, Source, TextPlace
from sim.formats.grid import CellMaze, GridCell, as_cells, exit_maze, goal_cells, refuse_large
from sim.maze import Maze, Point

CELL = re.compile(r"([0-9]{1,4}) ([0-9]{1,4})( [01]){4}")
"""A line, with one space between its words."""
ENTRANCE = (0, 0)
"""The format's start cell: the south-west corner."""


def recognises(source: Source) -> bool:
    """Whether the first line consists of six whole numbers, or the file's suffix is ``.num``."""
    first = source.drawing[0][1].split() if source.drawing else []
    return (len(first) == 6 and all(word.isdigit() for word in first)) or source.path.suffix == ".num"


def parse(source: Source) -> CellMaze:
    """The cells of an mms maze; the entrance is cell (0, 0), the goals are the cells in the middle.

    Raises:
        MazeError: a line does not hold six numbers, a cell is missing or given twice, or neighbours disagree.
    """
    cells: dict[GridCell, tuple[int, tuple[bool, ...]]] = {}
    for number, line in source.drawing:
        words = line.partition("#")[0].split()
        if not words:
            continue
        if not CELL.fullmatch(" ".join(words)):
            raise source.error(
                "a cell is `x y N E S W` with 0 or 1 for each wall",
                line=number,
                hint="such as `0 0 0 1 1 1`",
            )
        cell = int(words[0]), int(words[1])
        if cell in cells:
            raise source.error(f"cell {cell} was given in line {cells[cell][0]} already", line=number)
        cells[cell] = number, tuple(word == "1" for word in words[2:])
    if not cells:
        raise source.error("the file holds no cell")
    columns, rows = max(x for x, _ in cells) + 1, max(y for _, y in cells) + 1
    if len(cells) != columns * rows:
        missing = next((x, y) for x in range(columns) for y in range(rows) if (x, y) not in cells)
        raise source.error(f"cell {missing} is missing", hint=f"the maze has {columns} by {rows} cells")
    across = np.zeros((rows + 1, columns), dtype=np.bool_)
    upright = np.zeros((rows, columns + 1), dtype=np.bool_)
    for (x, y), (number, (north, east, south, west)) in cells.items():
        for neighbour, mine, theirs in (((x, y + 1), north, 2), ((x + 1, y), east, 3)):
            if neighbour in cells and cells[neighbour][1][theirs] != mine:
                raise source.error(f"cells {(x, y)} and {neighbour} disagree about the wall between them", line=number)
        across[y, x], across[y + 1, x] = south, north
        upright[y, x], upright[y, x + 1] = west, east
    return CellMaze(source.path.stem, across, upright, ENTRANCE, goal_cells(columns, rows))


def read(source: Source, choices: Choices) -> Sketch:
    """An mms maze as an exit maze; see `sim.formats.grid.exit_maze`.

    Raises:
        MazeError: the text is not such a maze.
    """
    cells = parse(source)
    refuse_large(source, cells.columns, cells.rows, choices.metres_a_cell)

    def locate(point: Point) -> TextPlace:
        at = [str(number) for number in cells.at(point, choices.metres_a_cell)]
        return next((number for number, line in enumerate(source.lines, 1) if line.split()[:2] == at), None), None

    return Sketch(exit_maze(cells, choices.metres_a_cell), locate)


def numbered(cells: CellMaze) -> str:
    """Cells as an mms ``.num`` file; such a file does not say which cells are entrance and goals."""
    lines = []
    for column in range(cells.columns):
        for row in range(cells.rows):
            walls = " ".join(str(int(cells.wall((column, row), side))) for side in ("north", "east", "south", "west"))
            lines.append(f"{column} {row} {walls}")
    return "\n".join(lines) + "\n"


def write(maze: Maze, _suffix: str, choices: Choices) -> bytes:
    """A maze that consists of cells as an mms ``.num`` file.

    Raises:
        CannotHoldError: it does not consist of cells, or its start or exit would be read elsewhere.
    """
    cells = as_cells(maze, choices.metres_a_cell)
    if cells.entrance != ENTRANCE or cells.goals[0] not in goal_cells(cells.columns, cells.rows):
        raise CannotHoldError("its exit must be beside the south-west cell and its start in the middle")
    return numbered(cells).encode()


FORMAT = Format("mms maze", (".num",), recognises, read, write)
