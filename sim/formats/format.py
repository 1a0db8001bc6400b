"""Maze formats: how their files are recognised, read and written, and the choices of the user."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from pathlib import Path

from sim.maze import Goal, Maze, MazeError, Point, Start
from transport.files import read_at_most

TextPlace = tuple[int | None, int | None]
"""Line and column in a text file, or row and column of a pixel, from 1; None where the format knows no such place."""

LARGEST_FILE = 64_000_000
"""The largest file, bytes."""
LARGEST_TEXT = 8_000_000
"""The longest text, bytes."""
LONGEST_LINE = 100_000
"""The longest line, characters."""

COMMENTS = ("#", "//", ";", "%")
"""The beginnings of comment lines in a maze of cells."""

METRES_A_PIXEL = 0.025
"""Edge of a pixel of an image without a scale, m."""
METRES_A_CELL = 1.0
"""Edge of a cell of a maze of cells, m."""


class Grey(StrEnum):
    """The meaning of pixels that are neither dark enough for a wall nor light enough to be free."""

    DOOR = "door"
    UNKNOWN = "unknown"
    SPLIT = "split"


@dataclass(frozen=True, slots=True)
class Choices:
    """The user's choices for a maze, which complete or override its file.

    Attributes:
        metres_a_pixel: edge of a pixel of an image, m; None for what the file says, or else `METRES_A_PIXEL`.
        metres_a_cell: edge of a cell, m.
        grey: what grey pixels are; ``split`` takes the darker half for walls, the lighter one for free. None for the
            format's own meaning.
        start: where the first robot is placed; None for the value in the file.
        exits: the ways out, both ends of each, m; none for those that the file says or that are found.
        goal: the goal; None for the value in the file.
        objects: a file of the course's simulator (``config.json``) with moving objects; None for no such file.
    """

    metres_a_pixel: float | None = None
    metres_a_cell: float = METRES_A_CELL
    grey: Grey | None = None
    start: Start | None = None
    exits: tuple[tuple[Point, Point], ...] = ()
    goal: Goal | None = None
    objects: Path | None = None


@dataclass(frozen=True)
class Source:
    """A file to be read.

    Attributes:
        path: where it is.
        content: its bytes.
    """

    path: Path
    content: bytes

    @classmethod
    def of(cls, path: Path) -> Source:
        """A file with its content.

        Raises:
            MazeError: it cannot be read, is a device, a pipe or a folder, or is longer than any maze.
        """
        try:
            content = read_at_most(path, LARGEST_FILE + 1)
        except OSError as error:
            raise MazeError(str(path), f"cannot be read: {error.strerror or error}") from None
        if len(content) > LARGEST_FILE:
            raise MazeError(str(path), f"is longer than the limit of {LARGEST_FILE // 1_000_000} MB")
        return cls(path, content)

    @cached_property
    def lines(self) -> list[str]:
        """The file as lines of text; a byte order mark is taken off.

        Raises:
            MazeError: it is not text, too long, or has a line that is too long.
        """
        if len(self.content) > LARGEST_TEXT:
            raise self.error(f"is longer than the limit of {LARGEST_TEXT // 1_000_000} MB of text")
        encoding = "utf-16" if self.content[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
        try:
            lines = self.content.decode(encoding).splitlines()
        except UnicodeDecodeError as error:
            line = self.content[: error.start].count(b"\n") + 1
            raise self.error("is neither an image nor text", line, hint="maze files are images or UTF-8 text") from None
        for number, line_of_text in enumerate(lines, start=1):
            if len(line_of_text) > LONGEST_LINE:
                raise self.error(f"the line has more than {LONGEST_LINE} characters", number, hint="break it up")
        return lines

    @cached_property
    def drawing(self) -> list[tuple[int, str]]:
        """The lines with their numbers, from 1, without lines of comment and without empty ones before and after.

        Raises:
            MazeError: it is not text.
        """
        lines = [(number, line.rstrip()) for number, line in enumerate(self.lines, start=1)]
        lines = [(number, line) for number, line in lines if not line.lstrip().startswith(COMMENTS)]
        filled = [index for index, (_, line) in enumerate(lines) if line]
        return lines[filled[0] : filled[-1] + 1] if filled else []

    def error(self, reason: str, line: int | None = None, column: int | None = None, hint: str = "") -> MazeError:
        """An error of the file."""
        return MazeError(str(self.path), reason, line=line, column=column, hint=hint)


@dataclass(frozen=True, slots=True)
class Sketch:
    """A maze from a file, before it is checked whether it can be solved.

    Attributes:
        maze: the maze, perhaps without exits.
        locate: from a point in the maze, m, to the place in the file that drew what is nearest to it.
        may_be_closed: whether a maze without an exit is a valid world without a goal.
    """

    maze: Maze
    locate: Callable[[Point], TextPlace]
    may_be_closed: bool = False


class CannotHoldError(Exception):
    """A format cannot represent a maze; the message says why."""


@dataclass(frozen=True, slots=True)
class Format:
    """One maze format.

    Attributes:
        name: what people call it.
        suffixes: of its files, each with its dot; a maze is written in the format that has the file's suffix.
        recognises: whether a file is of this format, by its content.
        read: from a file to a maze; raises a `MazeError` with the place in the file.
        write: from a maze and a suffix to a file's bytes; raises a `CannotHoldError`. None for a format that is only
            read.
    """

    name: str
    suffixes: tuple[str, ...]
    recognises: Callable[[Source], bool]
    read: Callable[[Source, Choices], Sketch]
    write: Callable[[Maze, str, Choices], bytes] | None
