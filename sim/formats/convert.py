"""Maze files from mazes: the format is told by the suffix."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image

from sim.formats import heightmap, micromouse, mms, text
from sim.formats.grid import NotCellsError, as_cells, exit_maze
from sim.maze import Maze, MazeError

SUFFIXES = (".maze", ".png", ".pgm", ".txt", ".num")


def write_maze(
    maze: Maze,
    path: Path,
    *,
    metres_a_pixel: float = heightmap.METRES_A_PIXEL,
    metres_a_cell: float = micromouse.METRES_A_CELL,
) -> None:
    """Write a maze in the format that the file's suffix names.

    Args:
        maze: the maze.
        path: a ``.maze``, ``.png``, ``.pgm``, ``.txt`` (micromouse) or ``.num`` (mms) file.
        metres_a_pixel: scale of heightmap images, m.
        metres_a_cell: scale of micromouse and mms mazes, m.

    Raises:
        MazeError: the format cannot hold this maze, or the file cannot be written.
    """
    try:
        match path.suffix:
            case ".maze":
                path.write_text(text.write(maze), encoding="utf-8")
            case ".png" | ".pgm":
                _write_image(maze, path, metres_a_pixel)
            case ".txt" | ".num":
                path.write_text(_cells(maze, path, metres_a_cell), encoding="utf-8")
            case _:
                raise MazeError(
                    str(path), f"no maze format has the suffix `{path.suffix}`", hint="one of " + ", ".join(SUFFIXES)
                )
    except OSError as error:
        raise MazeError(str(path), f"cannot be written: {error.strerror or error}") from None


def _write_image(maze: Maze, path: Path, metres_a_pixel: float) -> None:
    if maze.objects:
        raise MazeError(str(path), "a heightmap image cannot hold moving objects", hint="write a .maze file")
    Image.fromarray(heightmap.draw(maze, metres_a_pixel)).save(path)


def _cells(maze: Maze, path: Path, size: float) -> str:
    try:
        cells = as_cells(maze, size)
    except NotCellsError as error:
        raise MazeError(str(path), f"this format cannot hold the maze: {error}", hint="write a .maze file") from None
    again = exit_maze(cells, size)
    if path.suffix == ".num" and (
        cells.entrance != mms.ENTRANCE or cells.goals[0] not in mms.goal_cells(cells.columns, cells.rows)
    ):
        raise MazeError(
            str(path),
            "an mms maze has its exit beside the south-west cell and its start in the middle",
            hint="write a .txt or a .maze file",
        )
    low = maze.walls.reshape(-1, 2).min(axis=0)
    there, here = (np.sort(exits.reshape(2, 2), axis=0) for exits in (again.exits, maze.exits))
    if not np.allclose(there, here - low, atol=1e-3 * size):
        raise MazeError(
            str(path), "the exit beside a corner cell would be read at its other outer side", hint="write a .maze file"
        )
    return mms.write(cells) if path.suffix == ".num" else micromouse.write(cells)
