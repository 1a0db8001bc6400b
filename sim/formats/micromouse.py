"""Micromouse text mazes: posts at even distances, walls `---` and `|`, marks `S` and `G`, the north first.

Posts are `o`, `+`, `.` or `*`, three characters apart or any other number; cells are empty or hold a dot. Where no
cell is marked `S`, the mouse starts in the south-west corner; where none is marked `G`, the goal is the middle: as in
contests, whose files have no marks.
"""

from __future__ import annotations

import re
from itertools import pairwise

import numpy as np

from sim.formats.format import Choices, Format, Sketch, Source, TextPlace
from sim.formats.grid import CellMaze, GridCell, as_cells, exit_maze, goal_cells, refuse_large
from sim.maze import Maze, Point

POSTS = "o+.*"
LEVEL = "-=_"
"""The characters of walls that run east-west."""
CORNER = (0, 0)
FIRST_LINE = re.compile(r"\s*[o+.*](([-=_]+|\s+)[o+.*])+")


def recognises(source: Source) -> bool:
    """Whether the first line looks like the north wall of such a maze."""
    return bool(source.drawing) and FIRST_LINE.fullmatch(source.drawing[0][1]) is not None


def parse(source: Source) -> CellMaze:
    """The cells of a micromouse text maze.

    Raises:
        MazeError: a line does not fit the grid.
    """
    numbers, lines = [number for number, _ in source.drawing], [line.expandtabs() for _, line in source.drawing]
    if len(lines) % 2 == 0:
        raise source.error("a maze of H rows of cells has 2H+1 lines; this one has an even number", line=numbers[-1])
    margin = len(lines[0]) - len(lines[0].lstrip())
    grid = _Grid(source, margin, *_pitch(lines[0][margin:]))
    rows, columns = len(lines) // 2, grid.columns
    across = np.zeros((rows + 1, columns), dtype=np.bool_)
    upright = np.zeros((rows, columns + 1), dtype=np.bool_)
    marked: dict[str, list[GridCell]] = {"S": [], "G": []}
    for index, (number, line) in enumerate(zip(numbers, lines, strict=True)):
        if index % 2 == 0:
            across[rows - index // 2] = grid.level(number, line)
            continue
        row = rows - 1 - index // 2
        upright[row], marks = grid.row(number, line)
        for column, mark in marks:
            marked[mark].append((column, row))
    entrance = marked["S"][0] if marked["S"] else CORNER
    goals = tuple(marked["G"]) or goal_cells(columns, rows)
    if entrance[0] not in (0, columns - 1) and entrance[1] not in (0, rows - 1):
        raise source.error(
            "the cell marked `S` is not at the outer wall, where the opening is made",
            numbers[2 * (rows - 1 - entrance[1]) + 1],
            margin + grid.pitch * entrance[0] + 1 + grid.pitch // 2,
        )
    return CellMaze(source.path.stem, across, upright, entrance, goals)


def _pitch(first: str) -> tuple[int, int]:
    """Characters from post to post, and number of cells, in the first line."""
    posts = [at for at, letter in enumerate(first) if letter in POSTS]
    pitch = min(right - left for left, right in pairwise(posts))
    return pitch, (len(first) - 1) // pitch


class _Grid:
    """Where posts, walls and cells are in the lines of a file."""

    def __init__(self, source: Source, margin: int, pitch: int, columns: int) -> None:
        self.pitch, self.columns = pitch, columns
        self._source, self._margin = source, margin
        self._width = pitch * columns + 1

    def _line(self, number: int, line: str) -> str:
        if len(line) > self._margin + self._width:
            raise self._source.error(
                f"the line is longer than the first one ({self._margin + self._width} characters)",
                number,
                self._margin + self._width + 1,
            )
        if line[: self._margin].strip():
            raise self._source.error("the line begins left of the first one", number, 1)
        return line[self._margin :].ljust(self._width)

    def level(self, number: int, line: str) -> list[bool]:
        """Which cells have a wall in a line of posts."""
        line, walls = self._line(number, line), []
        for column in range(self.columns + 1):
            at = self.pitch * column
            if line[at] not in POSTS:
                raise self._source.error("a post `o` is missing", number, self._margin + at + 1)
            piece = line[at + 1 : at + self.pitch]
            if piece.strip() and (len(set(piece)) > 1 or piece[0] not in LEVEL):
                raise self._source.error(
                    f"`{piece}` cannot be between two posts",
                    number,
                    self._margin + at + 2,
                    f"`{'-' * len(piece)}` for a wall, spaces for none",
                )
            walls.append(bool(piece.strip()))
        return walls[: self.columns]

    def row(self, number: int, line: str) -> tuple[list[bool], list[tuple[int, str]]]:
        """Which posts' columns have a wall in a line of cells, and the cells that are marked."""
        line = self._line(number, line)
        walls: list[bool] = []
        marks: list[tuple[int, str]] = []
        for at, character in enumerate(line):
            on_wall = at % self.pitch == 0
            if character not in ("| " if on_wall else " .SGsg"):
                raise self._source.error(
                    f"`{character}` is not allowed here",
                    number,
                    self._margin + at + 1,
                    "`|` in the columns of the posts; `S`, `G` or nothing in a cell",
                )
            if on_wall:
                walls.append(character == "|")
            elif character not in " .":
                marks.append((at // self.pitch, character.upper()))
        return walls, marks


def read(source: Source, choices: Choices) -> Sketch:
    """A micromouse text maze as an exit maze; see `sim.formats.grid.exit_maze`.

    Raises:
        MazeError: the text is not such a maze.
    """
    cells = parse(source)
    refuse_large(source, cells.columns, cells.rows, choices.metres_a_cell)
    pitch, _ = _pitch(source.drawing[0][1].strip())

    def locate(point: Point) -> TextPlace:
        column, row = cells.at(point, choices.metres_a_cell)
        return source.drawing[2 * (cells.rows - row) - 1][0], pitch * column + 1 + pitch // 2

    return Sketch(exit_maze(cells, choices.metres_a_cell), locate)


def drawn(cells: CellMaze) -> str:
    """Cells as a micromouse text maze."""
    lines = []
    for row in reversed(range(cells.rows)):
        lines.append(_level(cells, row + 1))
        line = ""
        for column in range(cells.columns):
            mark = "S" if (column, row) == cells.entrance else "G" if (column, row) in cells.goals else " "
            line += f"{'|' if cells.upright[row, column] else ' '} {mark} "
        lines.append(line + ("|" if cells.upright[row, -1] else " "))
    lines.append(_level(cells, 0))
    return "\n".join(lines) + "\n"


def _level(cells: CellMaze, line: int) -> str:
    return "o" + "".join(("---" if wall else "   ") + "o" for wall in cells.across[line])


def write(maze: Maze, _suffix: str, choices: Choices) -> bytes:
    """A maze that consists of cells as a micromouse text maze.

    Raises:
        CannotHoldError: it does not consist of cells, or its exit would be read elsewhere.
    """
    return drawn(as_cells(maze, choices.metres_a_cell)).encode()


FORMAT = Format("micromouse text maze", (".txt",), recognises, read, write)
