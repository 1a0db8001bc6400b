"""Maze files: one module a format, one function that reads them all."""

from __future__ import annotations

from pathlib import Path

from sim.formats import heightmap, micromouse, mms, text
from sim.maze import Maze, MazeError
from sim.solvability import checked

METRES_A_PIXEL = heightmap.METRES_A_PIXEL
METRES_A_CELL = micromouse.METRES_A_CELL


def read_maze(
    path: Path | str, *, metres_a_pixel: float = METRES_A_PIXEL, metres_a_cell: float = METRES_A_CELL
) -> Maze:
    """Read a maze of any format, told by its content, complete its exits and make sure that it can be solved.

    Args:
        path: a heightmap image (PNG, PGM), a micromouse text maze, an mms ``.num`` file or a ``.maze`` file.
        metres_a_pixel: scale of heightmap images, m.
        metres_a_cell: scale of micromouse and mms mazes, m.

    Raises:
        MazeError: the file cannot be read, is not a maze, or the maze cannot be solved.
    """
    path = Path(path)
    try:
        content = path.read_bytes()
    except OSError as error:
        raise MazeError(str(path), f"cannot be read: {error.strerror or error}") from None
    if heightmap.recognises(content):
        return checked(heightmap.read(path, content, metres_a_pixel))
    try:
        lines = content.decode("utf-8").splitlines()
    except UnicodeDecodeError as error:
        line = content[: error.start].count(b"\n") + 1
        raise MazeError(
            str(path), "is neither an image nor text", line=line, hint="maze files are PNG, PGM or UTF-8 text"
        ) from None
    if path.suffix == ".maze":
        return checked(text.read(path, lines))
    if micromouse.recognises(lines):
        return checked(micromouse.read(path, lines, metres_a_cell))
    if mms.recognises(lines) or path.suffix == ".num":
        return checked(mms.read(path, lines, metres_a_cell))
    return checked(text.read(path, lines))


__all__ = ["METRES_A_CELL", "METRES_A_PIXEL", "read_maze"]
