"""Micromouse text mazes: posts `o` every fourth column, walls `---` and `|`, marks `S` and `G`, north first."""

from __future__ import annotations

import numpy as np

from sim.formats.format import Format, Scale, Sketch, Source, TextPlace
from sim.formats.grid import CellMaze, GridCell, as_cells, exit_maze
from sim.maze import Maze, Point


def recognises(source: Source) -> bool:
    """Whether the first line looks like the north wall of such a maze."""
    first = source.lines[0].rstrip() if source.lines else ""
    return len(first) >= 5 and first[0] in "o+" and set(first) <= set("o+- ")


def parse(source: Source) -> CellMaze:
    """The cells of a micromouse text maze.

    Raises:
        MazeError: a line does not fit the grid, or ``S`` or ``G`` is missing.
    """
    rows_of_text = [line.rstrip() for line in source.lines]
    while rows_of_text and not rows_of_text[-1]:
        rows_of_text.pop()
    if len(rows_of_text) % 2 == 0:
        raise source.error(
            "a maze of H rows of cells has 2H+1 lines; this one has an even number", line=len(rows_of_text)
        )
    rows, columns = len(rows_of_text) // 2, (len(rows_of_text[0]) - 1) // 4
    width = 4 * columns + 1
    across = np.zeros((rows + 1, columns), dtype=np.bool_)
    upright = np.zeros((rows, columns + 1), dtype=np.bool_)
    entrances: list[GridCell] = []
    goals: list[GridCell] = []
    for number, text in enumerate(rows_of_text):
        if len(text) > width:
            raise source.error(
                f"the line is longer than the first one ({width} characters)",
                line=number + 1,
                column=width + 1,
            )
        line = text.ljust(width)
        if number % 2 == 0:
            across[rows - number // 2] = _posts_and_walls(source, number, line, columns)
        else:
            row = rows - 1 - number // 2
            upright[row], marks = _cells(source, number, line, columns)
            entrances += [(column, row) for column, mark in marks if mark == "S"]
            goals += [(column, row) for column, mark in marks if mark == "G"]
    for letter, found in (("S", entrances), ("G", goals)):
        if not found:
            raise source.error(f"no cell is marked `{letter}`", hint="S: where the opening is made, G: the start")
    return CellMaze(source.path.stem, across, upright, entrances[0], tuple(goals))


def _posts_and_walls(source: Source, number: int, line: str, columns: int) -> list[bool]:
    for column in range(columns + 1):
        if line[4 * column] not in "o+":
            raise source.error("a post `o` is missing", line=number + 1, column=4 * column + 1)
    walls = []
    for column in range(columns):
        piece = line[4 * column + 1 : 4 * column + 4]
        if piece not in {"---", "   "}:
            raise source.error(
                f"between two posts stands `{piece}`",
                line=number + 1,
                column=4 * column + 2,
                hint="`---` for a wall, three spaces for none",
            )
        walls.append(piece == "---")
    return walls


def _cells(source: Source, number: int, line: str, columns: int) -> tuple[list[bool], list[tuple[int, str]]]:
    walls, marks = [], []
    for at, character in enumerate(line):
        allowed = "| " if at % 4 == 0 else " SG" if at % 4 == 2 else " "
        if character not in allowed:
            raise source.error(
                f"`{character}` cannot stand here",
                line=number + 1,
                column=at + 1,
                hint="`|` stands in the columns of the posts, `S` and `G` in the middle of a cell",
            )
        if at % 4 == 0:
            walls.append(character == "|")
        elif character != " ":
            marks.append((at // 4, character))
    return walls, marks


def read(source: Source, scale: Scale) -> Sketch:
    """A micromouse text maze as an exit maze; see `sim.formats.grid.exit_maze`.

    Raises:
        MazeError: the text is not such a maze.
    """
    cells = parse(source)

    def locate(point: Point) -> TextPlace:
        column, row = cells.at(point, scale.metres_a_cell)
        return 2 * (cells.rows - row), 4 * column + 3

    return Sketch(exit_maze(cells, scale.metres_a_cell), locate)


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


def write(maze: Maze, _suffix: str, scale: Scale) -> bytes:
    """A maze that consists of cells as a micromouse text maze.

    Raises:
        CannotHoldError: it does not consist of cells, or its exit would be read elsewhere.
    """
    return drawn(as_cells(maze, scale.metres_a_cell)).encode()


FORMAT = Format("micromouse text maze", (".txt",), recognises, read, write)
