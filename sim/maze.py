"""A maze as data: walls, doors, moving objects, where the robot starts and where it leaves.

Frames: metres, x and y as the maze's file format says, angles counter-clockwise from x in radians.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from transport.arithmetic import distance_between
from transport.messages import Pose
from transport.wording import printable

Point = tuple[float, float]
ORIGIN = Pose()
Segments = NDArray[np.float64]
"""Line segments, one a row: x1, y1, x2, y2 in metres; shape (n, 4)."""

MAZE_TIME_LIMIT = 420.0
"""Time for all attempts at the maze challenge together, s."""
LARGEST_COORDINATE = 10_000.0
"""Points farther from the origin than this along x or y are refused, m."""
LONGEST = 300
"""The longest error message about a maze, characters."""
DOOR_SPEED = 0.3
"""How fast a door slides, m/s."""


class MazeError(Exception):
    """A maze that cannot be used: the place, the reason, and a suggestion.

    Attributes:
        path: the maze's file, or its name where it comes from no file.
        line: line in a text file or pixel row in an image, counted from 1; None if there is no single line.
        column: column in the line or pixel column, counted from 1; None where the whole line is meant.
        reason: what is wrong.
        hint: how to fix it; may be empty.
    """

    def __init__(
        self, path: str, reason: str, *, line: int | None = None, column: int | None = None, hint: str = ""
    ) -> None:
        reason = printable(reason if len(reason) <= LONGEST else f"{reason[:LONGEST]} ...")
        self.path, self.line, self.column, self.reason, self.hint = path, line, column, reason, hint
        place = ":".join(str(part) for part in (printable(path), line, column) if part is not None)
        super().__init__(f"{place}: {self.reason}" + (f" ({hint})" if hint else ""))


@dataclass(frozen=True, slots=True)
class Start:
    """The start of a robot.

    Attributes:
        pose: the nominal pose.
        spread: half the width of the uniform distribution about it, m along x and y, rad in heading; drawn by the seed.
    """

    pose: Pose = ORIGIN
    spread: Pose = ORIGIN


@dataclass(frozen=True, slots=True)
class MazeDoor:
    """A piece of wall that slides along its own axis, by its own length, towards its second end.

    Attributes:
        name: the door's name.
        leaf: the two ends of the closed door.
        speed: how fast it slides, m/s.
        stays: how long it stays open before it closes again, s; infinite if it never does.
    """

    name: str
    leaf: tuple[Point, Point]
    speed: float = DOOR_SPEED
    stays: float = math.inf

    @property
    def length(self) -> float:
        """Length of the leaf, m."""
        return distance_between(*self.leaf)


@dataclass(frozen=True, slots=True)
class MovingObject:
    """A solid thing that travels along a path of straight pieces at constant speed.

    Attributes:
        name: the object's name.
        outline: its corners about its own origin, m, counter-clockwise.
        path: where its origin goes, from its first point on; an object with one point stands still.
        speed: how fast it goes, m/s.
        near: it starts when a robot's origin comes closer to it than this, m; infinite to start immediately.
        returns: at the end of the path it goes back the same way, repeatedly; otherwise it stays there.
    """

    name: str
    outline: tuple[Point, ...]
    path: tuple[Point, ...]
    speed: float = 0.3
    near: float = math.inf
    returns: bool = False


@dataclass(frozen=True, slots=True)
class Leave:
    """To leave through an exit: the challenge."""

    def __str__(self) -> str:
        return "leaving through an exit"


@dataclass(frozen=True, slots=True)
class Reach:
    """To bring the robot's origin to a place.

    Attributes:
        place: where, m.
        radius: how near is near enough, m.
    """

    place: Point
    radius: float = 0.3

    def __str__(self) -> str:
        return f"coming within {self.radius:g} m of ({self.place[0]:.2f}, {self.place[1]:.2f}) m"


@dataclass(frozen=True, slots=True)
class Survive:
    """To touch nothing for a time.

    Attributes:
        duration: how long, s.
    """

    duration: float

    def __str__(self) -> str:
        return f"touching nothing for {self.duration:g} s"


@dataclass(frozen=True, slots=True)
class Nothing:
    """No goal: only contacts are judged."""

    def __str__(self) -> str:
        return "touching nothing"


LEAVE = Leave()
Goal = Leave | Reach | Survive | Nothing
"""The goal of a robot in a maze."""


def no_segments() -> Segments:
    """An empty array of segments."""
    return np.empty((0, 4))


@dataclass(frozen=True, slots=True, eq=False)
class Maze:
    """One maze.

    Attributes:
        name: the maze's name.
        walls: the walls.
        start: where the first robot is placed.
        exits: the ways out; the outside lies to the left when one goes from an exit's first end to its second.
        doors: the doors, all closed at the beginning.
        objects: what moves.
        others: where further robots are placed, in order.
        time_limit: how long all attempts together may take, s; infinite where the maze belongs to no challenge.
        unknown: edges of what a map knows: neither a robot nor a beam passes them.
        goal: the goal.
    """

    name: str
    walls: Segments
    start: Start = field(default=Start())
    exits: Segments = field(default_factory=no_segments)
    doors: tuple[MazeDoor, ...] = ()
    objects: tuple[MovingObject, ...] = ()
    others: tuple[Start, ...] = ()
    time_limit: float = MAZE_TIME_LIMIT
    unknown: Segments = field(default_factory=no_segments)
    goal: Goal = LEAVE

    @property
    def barriers(self) -> Segments:
        """Walls and edges of the unknown, shape (n, 4)."""
        return np.concatenate([self.walls, self.unknown]) if len(self.unknown) else self.walls

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """The smallest box about what does not move: x and y of its lower corner, x and y of its upper one, m."""
        starts = [[start.pose.x, start.pose.y] for start in self.starts]
        goal = [self.goal.place] if isinstance(self.goal, Reach) else []
        leaves = [point for door in self.doors for point in door.leaf]
        drawn = [self.walls.reshape(-1, 2), self.unknown.reshape(-1, 2), self.exits.reshape(-1, 2)]
        points = np.concatenate([*drawn, np.asarray([*starts, *goal, *leaves])])
        low, high = points.min(axis=0), points.max(axis=0)
        return float(low[0]), float(low[1]), float(high[0]), float(high[1])

    @property
    def starts(self) -> tuple[Start, ...]:
        """Where robots are placed, in order."""
        return (self.start, *self.others)

    @property
    def start_point(self) -> Point:
        """Position of the nominal start, m."""
        return self.start.pose.x, self.start.pose.y


def merge_collinear(segments: Segments) -> Segments:
    """The same walls with axis-aligned segments that overlap or touch end to end joined into longer ones.

    Args:
        segments: shape (n, 4).

    Returns:
        Shape (m, 4) with m <= n; axis-aligned ones first, sorted, then the others as they were.
    """
    merged: list[tuple[float, float, float, float]] = []
    vertical = segments[:, 0] == segments[:, 2]
    horizontal = (segments[:, 1] == segments[:, 3]) & ~vertical
    for across, chosen in ((0, vertical), (1, horizontal)):
        along = 1 - across
        lows = np.minimum(segments[chosen, along], segments[chosen, along + 2])
        highs = np.maximum(segments[chosen, along], segments[chosen, along + 2])
        spans = sorted(zip(segments[chosen, across].tolist(), lows.tolist(), highs.tolist(), strict=True))
        joined: list[tuple[float, float, float]] = []
        for line, low, high in spans:
            same, begin, end = joined[-1] if joined else (math.nan, 0.0, 0.0)
            if same == line and low <= end:
                joined[-1] = line, begin, max(high, end)
            else:
                joined.append((line, low, high))
        merged += [(line, low, line, high) if across == 0 else (low, line, high, line) for line, low, high in joined]
    others = segments[~vertical & ~horizontal]
    return np.concatenate([np.asarray(merged, dtype=np.float64).reshape(-1, 4), others])
