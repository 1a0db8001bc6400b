"""Maze files: one module a format, one function that reads them all."""

from __future__ import annotations

from pathlib import Path

from sim.formats import heightmap, micromouse, mms, text
from sim.formats.sketch import Sketch
from sim.maze import Maze, MazeError
from sim.solvability import UnsolvableError, checked

METRES_A_PIXEL = heightmap.METRES_A_PIXEL
METRES_A_CELL = micromouse.METRES_A_CELL


def read_maze(
    path: Path | str, *, metres_a_pixel: float = METRES_A_PIXEL, metres_a_cell: float = METRES_A_CELL
) -> Maze:
    """Read a maze of any format, complete its exits and make sure that it can be solved.

    The format is told by the content: an image, a micromouse drawing, six numbers a line, or else our own ``.maze``.

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
    sketch = _sketch(path, content, metres_a_pixel, metres_a_cell)
    try:
        return checked(sketch.maze)
    except UnsolvableError as error:
        line, column = sketch.locate(error.at)
        raise MazeError(str(path), error.reason, line=line, column=column, hint=error.hint) from None


def _sketch(path: Path, content: bytes, metres_a_pixel: float, metres_a_cell: float) -> Sketch:
    if heightmap.recognises(content):
        return heightmap.read(path, content, metres_a_pixel)
    try:
        lines = content.decode("utf-8").splitlines()
    except UnicodeDecodeError as error:
        line = content[: error.start].count(b"\n") + 1
        raise MazeError(
            str(path), "is neither an image nor text", line=line, hint="maze files are PNG, PGM or UTF-8 text"
        ) from None
    if micromouse.recognises(lines):
        return micromouse.read(path, lines, metres_a_cell)
    if mms.recognises(lines) or path.suffix == ".num":
        return mms.read(path, lines, metres_a_cell)
    return text.read(path, lines)


__all__ = ["METRES_A_CELL", "METRES_A_PIXEL", "read_maze"]
