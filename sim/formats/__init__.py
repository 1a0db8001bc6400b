"""Maze files: one module per format, a table of them, and functions that read and write them all."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from sim.formats import course, heightmap, micromouse, mms, ros_map, text
from sim.formats.chosen import chosen
from sim.formats.format import CannotHoldError, Choices, Format, Grey, Source
from sim.maze import Maze, MazeError, Nothing
from sim.solvability import ClosedError, UnsolvableError, checked
from transport.files import write_bytes

FORMATS: tuple[Format, ...] = (
    heightmap.FORMAT,
    ros_map.FORMAT,
    micromouse.FORMAT,
    mms.FORMAT,
    text.FORMAT,
)
"""All formats; a file is of the first one that recognises it, and the last one takes any text."""

AS_THE_FILE_SAYS = Choices()


def read_maze(path: Path | str, choices: Choices = AS_THE_FILE_SAYS, *, radius: float) -> Maze:
    """Read a maze of any format, complete its exits and make sure that a robot can reach the goal in it.

    The content shows the format: an image, a map's description, a micromouse drawing, six numbers a line, or else our
    own ``.maze``.

    Args:
        path: a file of any of the `FORMATS`.
        choices: the user's choices.
        radius: of the disc that the robot sweeps when it turns, m.

    Raises:
        MazeError: the file cannot be read, is not a maze, or no robot can reach the goal in it.
    """
    source = Source.of(Path(path))
    if course.is_config(source) and not ros_map.recognises(source):
        raise source.error("has no walls", hint="give the map as the maze, and this file with `--objects`")
    form = next(form for form in FORMATS if form.recognises(source))
    sketch = form.read(source, choices)
    maze = sketch.maze if choices.objects is None else course.furnished(sketch.maze, Source.of(choices.objects))
    maze = chosen(maze, choices)
    try:
        closed = sketch.may_be_closed and not choices.goal
        return _checked_or_closed(maze, radius) if closed else checked(maze, radius=radius)
    except UnsolvableError as error:
        raise source.error(error.reason, *sketch.locate(error.at), hint=error.hint) from None


def files_of(path: Path) -> tuple[Path, ...]:
    """The files that make up a maze: itself and, where it describes an image that is there, that."""
    try:
        source = Source.of(path)
        image = ros_map.image_of(source) if ros_map.recognises(source) else path
    except MazeError:
        return (path,)
    return (path, image) if image != path and image.is_file() else (path,)


def _checked_or_closed(maze: Maze, radius: float) -> Maze:
    try:
        return checked(maze, radius=radius)
    except ClosedError:
        return checked(replace(maze, goal=Nothing()), radius=radius)


def write_maze(maze: Maze, path: Path | str, choices: Choices = AS_THE_FILE_SAYS) -> None:
    """Write a maze in the format that the file's suffix names.

    Args:
        maze: the maze.
        path: a ``.maze``, ``.png``, ``.pgm``, ``.txt`` (micromouse) or ``.num`` (mms) file.
        choices: how large pixels and cells are.

    Raises:
        MazeError: the format cannot hold this maze, or the file cannot be written.
    """
    path = Path(path)
    writers = {suffix: (form.name, form.write) for form in FORMATS if form.write for suffix in form.suffixes}
    if path.suffix not in writers:
        raise MazeError(str(path), f"no format for mazes is named `{path.suffix}`", hint=f"one of {', '.join(writers)}")
    name, write = writers[path.suffix]
    try:
        write_bytes(path, write(maze, path.suffix, choices))
    except CannotHoldError as error:
        raise MazeError(
            str(path), f"the format {name} cannot hold this maze: {error}", hint="write a .maze file"
        ) from None
    except OSError as error:
        raise MazeError(str(path), f"cannot be written: {error.strerror or error}") from None


__all__ = ["AS_THE_FILE_SAYS", "FORMATS", "Choices", "Grey", "files_of", "read_maze", "write_maze"]
