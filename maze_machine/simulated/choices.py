"""The maze options of a command line, as text."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from maze_machine.errors import UsageError
from sim.formats import Choices, Grey
from sim.formats.format import METRES_A_CELL
from sim.formats.text import exit_in, goal_in, start_in
from sim.maze import MazeError

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class MazeWords:
    """The options of a command that takes a maze; plain values, so that a campaign's file can store them.

    Attributes:
        start: x, y, heading as in a ``.maze`` file; None for the file's.
        exits: the two ends of each exit, as there.
        goal: as there.
        metres_a_pixel: edge of a pixel, m; None for the value in the file.
        metres_a_cell: edge of a cell, m.
        grey: a value of `Grey`; None for the format's own.
        objects: the file of the course's simulator with moving objects; None for no such file.
    """

    start: str | None = None
    exits: tuple[str, ...] = ()
    goal: str | None = None
    metres_a_pixel: float | None = None
    metres_a_cell: float = METRES_A_CELL
    grey: str | None = None
    objects: str | None = None

    def choices(self) -> Choices:
        """What they choose.

        Raises:
            UsageError: one of them is malformed.
        """
        return Choices(
            metres_a_pixel=self.metres_a_pixel,
            metres_a_cell=self.metres_a_cell,
            grey=None if self.grey is None else Grey(self.grey),
            start=None if self.start is None else _understood(start_in, self.start),
            exits=tuple(_understood(exit_in, words) for words in self.exits),
            goal=None if self.goal is None else _understood(goal_in, self.goal),
            objects=None if self.objects is None else Path(self.objects),
        )


AS_THE_FILE_SAYS = MazeWords()
"""Nothing is chosen."""


def _understood(read: Callable[[str], T], words: str) -> T:
    try:
        return read(words)
    except MazeError as error:
        raise UsageError(f"{error.path} {words!r}: {error.reason}", error.hint) from None
