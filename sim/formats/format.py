"""What a maze format is: how its files are recognised, read and written."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from sim.maze import Maze, MazeError, Point

TextPlace = tuple[int | None, int | None]
"""Line and column in a text file, or row and column of a pixel, from 1; None where the format knows no such place."""


@dataclass(frozen=True, slots=True)
class Scale:
    """How large things are whose files do not say it.

    Attributes:
        metres_a_pixel: edge of a pixel of an image, m.
        metres_a_cell: edge of a cell, m.
    """

    metres_a_pixel: float = 0.025
    metres_a_cell: float = 1.0


@dataclass(frozen=True)
class Source:
    """A file to be read.

    Attributes:
        path: where it is.
        content: its bytes.
    """

    path: Path
    content: bytes

    @cached_property
    def lines(self) -> list[str]:
        """The file as lines of text.

        Raises:
            MazeError: it is no text.
        """
        try:
            return self.content.decode("utf-8").splitlines()
        except UnicodeDecodeError as error:
            line = self.content[: error.start].count(b"\n") + 1
            raise self.error(
                "is neither an image nor text", line, hint="maze files are PNG, PGM or UTF-8 text"
            ) from None

    def error(self, reason: str, line: int | None = None, column: int | None = None, hint: str = "") -> MazeError:
        """What is wrong with the file."""
        return MazeError(str(self.path), reason, line=line, column=column, hint=hint)


@dataclass(frozen=True, slots=True)
class Sketch:
    """A maze as a file draws it, before it is known whether it can be solved.

    Attributes:
        maze: the maze, perhaps without exits.
        locate: from a point in the maze, m, to the place in the file that drew what is nearest to it.
    """

    maze: Maze
    locate: Callable[[Point], TextPlace]


class CannotHoldError(Exception):
    """A format has no way to say what a maze is like; the message says what."""


@dataclass(frozen=True, slots=True)
class Format:
    """One maze format.

    Attributes:
        name: what people call it.
        suffixes: of its files, each with its dot; a maze is written in the format that has the file's suffix.
        recognises: whether a file is of this format, told by its content.
        read: from a file to a maze; raises a `MazeError` with the place in the file.
        write: from a maze and a suffix to a file's bytes; raises a `CannotHoldError`.
    """

    name: str
    suffixes: tuple[str, ...]
    recognises: Callable[[Source], bool]
    read: Callable[[Source, Scale], Sketch]
    write: Callable[[Maze, str, Scale], bytes]
