"""Our own maze format (``.maze``): one declaration a line, metres and degrees, ``#`` to the end of a line is a comment.

::

    name   the final of 2015
    start  0.5 0.5  90                       # x y heading; a second one is a second robot's, and so on
    start  2.5 0.5  90  spread 0.1 0.1 5     # drawn by the seed, uniformly: dx dy degrees to either side
    wall   0 0  4 0  4 3                     # two or more points: a wall along them
    exit   0 3  1 3                          # its two ends
    door   front  2 1  3 1                   # a name and its two ends; it slides towards the second end
    door   back   5 1  6 1  speed 0.2  stays 10
    object cart  box 0.4 0.3  path 1 1  3 1  speed 0.3  near 1.5  returns
    object post  outline 0.1 0  0 0.1  -0.1 0  path 2 2
    limit  300                               # seconds for all attempts, or `none`; 420 if not given
    goal   3.5 2.5  0.3                      # a place to reach and how near; or `survive 60`, `none`, or `exit`
    unknown 4 0  5 0  5 3                    # the edge of what is known: nothing passes it
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np

from sim.formats.format import Choices, Format, Sketch, Source, TextPlace
from sim.geometry import distances
from sim.maze import (
    DOOR_SPEED,
    LARGEST_COORDINATE,
    MAZE_TIME_LIMIT,
    Goal,
    Leave,
    Maze,
    MazeDoor,
    MazeError,
    MovingObject,
    Nothing,
    Point,
    Reach,
    Segments,
    Start,
    Survive,
)
from transport.messages import Pose
from transport.wording import printable

MOST = 100_000
"""Mazes with more pieces of wall, or more of anything else, are refused."""
FASTEST = 100.0
"""Doors and objects are not faster than this, m/s."""


class _Line:
    """The words of one line, read in order."""

    def __init__(self, source: Source, number: int, text: str) -> None:
        self._source, self.number_in_file = source, number
        self._words = [(match.group(), match.start() + 1) for match in re.finditer(r"\S+", text.partition("#")[0])]
        self._next = 0

    def __bool__(self) -> bool:
        return self._next < len(self._words)

    def error(self, reason: str, hint: str = "", *, back: int = 0) -> MazeError:
        at = self._next - back
        column = self._words[at][1] if at < len(self._words) else self._words[-1][1] + len(self._words[-1][0])
        return self._source.error(reason, self.number_in_file, column, hint)

    def word(self, what: str) -> str:
        if not self:
            raise self.error(f"{what} is missing")
        self._next += 1
        return self._words[self._next - 1][0]

    def rest(self) -> str:
        words = [word for word, _ in self._words[self._next :]]
        self._next = len(self._words)
        return " ".join(words)

    def number(self, what: str) -> float:
        word = self.word(what)
        try:
            value = float(word)
        except ValueError:
            raise self.error(f"{what} should be a number, not `{word}`", back=1) from None
        if not math.isfinite(value):
            raise self.error(f"{what} should be a finite number", back=1)
        return value

    def positive(self, what: str) -> float:
        value = self.number(what)
        if value <= 0:
            raise self.error(f"{what} should be greater than zero", back=1)
        return value

    def speed(self) -> float:
        value = self.positive("a speed in m/s")
        if value > FASTEST:
            raise self.error(f"a speed should be at most {FASTEST:g} m/s", back=1)
        return value

    def coordinate(self, what: str) -> float:
        value = self.number(what)
        if abs(value) > LARGEST_COORDINATE:
            raise self.error(f"{what} should be at most {LARGEST_COORDINATE / 1000:g} km from the origin", back=1)
        return value

    def point(self) -> Point:
        return self.coordinate("an x in metres"), self.coordinate("a y in metres")

    def points(self, at_least: int) -> tuple[Point, ...]:
        points = []
        while self and re.match(r"[-+.\d]", self._words[self._next][0]):
            points.append(self.point())
        if len(points) < at_least:
            raise self.error(f"needs at least {at_least} points", "a point is its x and y in metres")
        for first, second in pairwise(points):
            if first == second:
                raise self.error("two points in a row are the same", back=1)
        return tuple(points)

    def ends(self) -> tuple[Point, Point]:
        points = self.points(2)
        if len(points) > 2:
            raise self.error("it has just two ends", back=1)
        return points[0], points[1]

    def skip(self, word: str) -> bool:
        here = bool(self) and self._words[self._next][0] == word
        self._next += here
        return here

    def keyword(self, allowed: Sequence[str]) -> str:
        word = self.word("a keyword")
        if word not in allowed:
            raise self.error(f"the word `{word}` is unknown here", "one of: " + ", ".join(allowed), back=1)
        return word


class _Reader:
    """Collects the declarations of one file."""

    def __init__(self, source: Source) -> None:
        self._source = source
        self.name = source.path.stem
        self.walls: list[tuple[float, float, float, float]] = []
        self.exits: list[tuple[float, float, float, float]] = []
        self.doors: list[MazeDoor] = []
        self.objects: list[MovingObject] = []
        self.starts: list[Start] = []
        self.unknown: list[tuple[float, float, float, float]] = []
        self.goal: Goal = Leave()
        self.time_limit = MAZE_TIME_LIMIT
        self.places: list[tuple[tuple[float, float, float, float], int]] = []

    def read_all(self) -> None:
        """Read every line.

        Raises:
            MazeError: a line is malformed.
        """
        readers: dict[str, Callable[[_Line], None]] = {
            "name": self.read_name,
            "limit": self.read_limit,
            "start": self.read_start,
            "wall": self.read_wall,
            "exit": self.read_exit,
            "door": self.read_door,
            "object": self.read_object,
            "goal": self.read_goal,
            "unknown": self.read_unknown,
        }
        for number, text in enumerate(self._source.lines, start=1):
            line = _Line(self._source, number, text)
            if line:
                readers[line.keyword(list(readers))](line)
                if line:
                    raise line.error(f"`{line.word('a word')}` is superfluous", back=1)
                if max(len(self.places), len(self.doors), len(self.objects)) > MOST:
                    raise line.error(f"the maze has more than {MOST} pieces, which is the limit")

    def drawn(self, points: Sequence[Point], line: _Line) -> list[tuple[float, float, float, float]]:
        """Segments along points, recorded with their line."""
        segments = [(*first, *second) for first, second in pairwise(points)]
        self.places += [(segment, line.number_in_file) for segment in segments]
        return segments

    def read_name(self, line: _Line) -> None:
        self.name = printable(line.rest()) or self.name

    def read_start(self, line: _Line) -> None:
        x, y = line.point()
        pose, spread = Pose(x, y, math.radians(line.number("a heading in degrees"))), Pose()
        if line:
            line.keyword(["spread"])
            x, y = line.point()
            spread = Pose(x, y, math.radians(line.number("a spread in degrees")))
        self.starts.append(Start(pose, spread))
        self.places.append(((pose.x, pose.y, pose.x, pose.y), line.number_in_file))

    def read_limit(self, line: _Line) -> None:
        self.time_limit = math.inf if line.skip("none") else line.positive("a time in seconds")

    def read_wall(self, line: _Line) -> None:
        self.walls += self.drawn(line.points(2), line)

    def read_exit(self, line: _Line) -> None:
        self.exits += self.drawn(line.ends(), line)

    def read_unknown(self, line: _Line) -> None:
        self.unknown += self.drawn(line.points(2), line)

    def read_goal(self, line: _Line) -> None:
        if line.skip("none"):
            self.goal = Nothing()
        elif line.skip("exit"):
            self.goal = Leave()
        elif line.skip("survive"):
            self.goal = Survive(line.positive("a time in seconds"))
        else:
            place = line.point()
            self.goal = Reach(place, line.positive("a radius in metres")) if line else Reach(place)

    def read_door(self, line: _Line) -> None:
        name = printable(line.word("a name"))
        ends = line.ends()
        speed, stays = DOOR_SPEED, math.inf
        while line:
            if line.keyword(["speed", "stays"]) == "speed":
                speed = line.speed()
            else:
                stays = line.positive("a time in seconds")
        self.doors.append(MazeDoor(name, ends, speed, stays))

    def read_object(self, line: _Line) -> None:
        name = printable(line.word("a name"))
        if line.keyword(["box", "outline"]) == "box":
            length, width = (line.coordinate(f"a {name} in metres") / 2 for name in ("length", "width"))
            if min(length, width) <= 0:
                raise line.error("a box should be longer and wider than zero", back=1)
            outline: tuple[Point, ...] = ((length, -width), (length, width), (-length, width), (-length, -width))
        else:
            outline = line.points(3)
        line.keyword(["path"])
        path = line.points(1)
        speed, near, returns = 0.3, math.inf, False
        while line:
            match line.keyword(["speed", "near", "returns"]):
                case "speed":
                    speed = line.speed()
                case "near":
                    near = line.positive("a distance in metres")
                case _:
                    returns = True
        self.objects.append(MovingObject(name, outline, path, speed, near, returns))


def read(source: Source, choices: Choices) -> Sketch:
    """A ``.maze`` file as a maze.

    Raises:
        MazeError: a line is malformed, or there is no start.
    """
    reader = _Reader(source)
    reader.read_all()
    if not reader.starts and choices.start:
        reader.starts.append(choices.start)
    if not reader.starts:
        raise source.error("the maze has no start", hint="add a line such as `start 0.5 0.5 90`")
    maze = Maze(
        name=reader.name,
        walls=np.asarray(reader.walls, dtype=np.float64).reshape(-1, 4),
        start=reader.starts[0],
        others=tuple(reader.starts[1:]),
        exits=np.asarray(reader.exits, dtype=np.float64).reshape(-1, 4),
        doors=tuple(reader.doors),
        objects=tuple(reader.objects),
        time_limit=reader.time_limit,
        unknown=np.asarray(reader.unknown, dtype=np.float64).reshape(-1, 4),
        goal=reader.goal,
    )

    def locate(point: Point) -> TextPlace:
        drawn = np.asarray([segment for segment, _ in reader.places])
        return reader.places[int(np.argmin(distances(np.array([point]), drawn)))][1], None

    return Sketch(maze, locate)


def start_in(words: str) -> Start:
    """The start from the words after ``start``.

    Raises:
        MazeError: they are malformed.
    """
    return _said("start", words).starts[0]


def exit_in(words: str) -> tuple[Point, Point]:
    """The two ends from the words after ``exit``.

    Raises:
        MazeError: they are malformed.
    """
    ax, ay, bx, by = _said("exit", words).exits[0]
    return (ax, ay), (bx, by)


def goal_in(words: str) -> Goal:
    """The goal from the words after ``goal``.

    Raises:
        MazeError: they are malformed.
    """
    return _said("goal", words).goal


def _said(keyword: str, words: str) -> _Reader:
    reader = _Reader(Source(Path(f"--{keyword}"), f"{keyword} {words}".encode(errors="replace")))
    reader.read_all()
    return reader


def write(maze: Maze, _suffix: str = ".maze", _choices: Choices | None = None) -> bytes:
    """A maze as a ``.maze`` file; `read` returns the same maze."""
    lines = [f"name   {maze.name}"]
    if maze.time_limit != MAZE_TIME_LIMIT:
        lines.append(f"limit  {_number(maze.time_limit) if math.isfinite(maze.time_limit) else 'none'}")
    if maze.goal != Leave():
        lines.append(f"goal   {_goal(maze.goal)}")
    lines += [*map(_start, maze.starts), ""]
    lines += [f"wall   {_points(chain)}" for chain in _chains(maze.walls)]
    lines += [f"unknown {_points(chain)}" for chain in _chains(maze.unknown)]
    lines += [f"exit   {_points([(ax, ay), (bx, by)])}" for ax, ay, bx, by in maze.exits.tolist()]
    for door in maze.doors:
        speed = f"  speed {_number(door.speed)}" if door.speed != DOOR_SPEED else ""
        stays = f"  stays {_number(door.stays)}" if math.isfinite(door.stays) else ""
        lines.append(f"door   {_word(door.name)}  {_points(door.leaf)}{speed}{stays}")
    for thing in maze.objects:
        near = f"  near {_number(thing.near)}" if math.isfinite(thing.near) else ""
        lines.append(
            f"object {_word(thing.name)}  outline {_points(thing.outline)}  path {_points(thing.path)}"
            f"  speed {_number(thing.speed)}{near}{'  returns' if thing.returns else ''}"
        )
    return ("\n".join(lines) + "\n").encode()


def _start(start: Start) -> str:
    line = f"start  {_points([(start.pose.x, start.pose.y)])}  {_number(math.degrees(start.pose.heading))}"
    if start.spread == Pose():
        return line
    return (
        line + f"  spread {_points([(start.spread.x, start.spread.y)])} {_number(math.degrees(start.spread.heading))}"
    )


def _goal(goal: Goal) -> str:
    match goal:
        case Reach():
            return f"{_points([goal.place])}  {_number(goal.radius)}"
        case Survive():
            return f"survive {_number(goal.duration)}"
        case Nothing():
            return "none"
        case Leave():
            return "exit"


def _number(value: float) -> str:
    return repr(int(value)) if value == int(value) else repr(value)


def _points(points: Sequence[Point]) -> str:
    return "  ".join(f"{_number(x)} {_number(y)}" for x, y in points)


def _word(name: str) -> str:
    return "_".join(name.split()) or "unnamed"


def _chains(segments: Segments) -> list[list[Point]]:
    """Segments, in order, with those joined that begin where the previous one ended."""
    chains: list[list[Point]] = []
    for ax, ay, bx, by in segments.tolist():
        if not chains or chains[-1][-1] != (ax, ay):
            chains.append([(ax, ay)])
        chains[-1].append((bx, by))
    return chains


def recognises(source: Source) -> bool:
    """Whether a file is text: any text that no other format recognises is read as this one."""
    return source.lines is not None


FORMAT = Format("maze file", (".maze",), recognises, read, write)
