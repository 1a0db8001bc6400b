"""Maze files: one module a format, a table of them, and functions that read and write them all."""

from __future__ import annotations

from pathlib import Path

from sim.formats import heightmap, micromouse, mms, text
from sim.formats.format import CannotHoldError, Format, Scale, Source
from sim.maze import Maze, MazeError
from sim.solvability import UnsolvableError, checked
from transport.files import write_bytes

FORMATS: tuple[Format, ...] = (heightmap.FORMAT, micromouse.FORMAT, mms.FORMAT, text.FORMAT)
"""All formats; a file is of the first one that recognises it, and the last one takes any text."""

METRES_A_PIXEL = Scale().metres_a_pixel
METRES_A_CELL = Scale().metres_a_cell


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
        source = Source(path, path.read_bytes())
    except OSError as error:
        raise MazeError(str(path), f"cannot be read: {error.strerror or error}") from None
    form = next(form for form in FORMATS if form.recognises(source))
    sketch = form.read(source, Scale(metres_a_pixel, metres_a_cell))
    try:
        return checked(sketch.maze)
    except UnsolvableError as error:
        raise source.error(error.reason, *sketch.locate(error.at), hint=error.hint) from None


def write_maze(
    maze: Maze, path: Path | str, *, metres_a_pixel: float = METRES_A_PIXEL, metres_a_cell: float = METRES_A_CELL
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
    path = Path(path)
    form = next((form for form in FORMATS if path.suffix in form.suffixes), None)
    if form is None:
        known = ", ".join(suffix for form in FORMATS for suffix in form.suffixes)
        raise MazeError(str(path), f"no maze format has the suffix `{path.suffix}`", hint=f"one of {known}")
    try:
        write_bytes(path, form.write(maze, path.suffix, Scale(metres_a_pixel, metres_a_cell)))
    except CannotHoldError as error:
        raise MazeError(str(path), f"a {form.name} cannot hold this maze: {error}", hint="write a .maze file") from None
    except OSError as error:
        raise MazeError(str(path), f"cannot be written: {error.strerror or error}") from None


__all__ = ["FORMATS", "METRES_A_CELL", "METRES_A_PIXEL", "read_maze", "write_maze"]
