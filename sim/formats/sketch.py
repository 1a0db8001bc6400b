"""A maze as a file draws it, before it is known whether it can be solved."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from sim.maze import Maze, Point

Place = tuple[int | None, int | None]
"""Line and column in a text file, or row and column of a pixel, from 1; None where the format knows no such place."""


@dataclass(frozen=True, slots=True)
class Sketch:
    """What a reader makes of a file.

    Attributes:
        maze: the maze, perhaps without exits.
        locate: from a point in the maze, m, to the place in the file that drew what is nearest to it.
    """

    maze: Maze
    locate: Callable[[Point], Place]
