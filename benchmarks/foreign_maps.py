"""Reads every map in some folders and reports, by folder, how many were read and why the others were refused.

    python benchmarks/foreign_maps.py FOLDER... [--start-anywhere] [--markdown]

With ``--start-anywhere``, a map in which the robot does not fit at its start is tried again from the middle of its
largest free area, as a user would with ``--start``.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sim.formats import Choices, Grey, read_maze
from sim.free_space import DistanceGrid
from sim.maze import Maze, MazeError, Nothing, Start
from transport.description import RobotDescription
from transport.messages import Pose

SUFFIXES = {".maze", ".txt", ".num", ".maz", ".pgm", ".png", ".bmp", ".yaml"}
KNOWN = (
    ("does not fit at its start", "no room at the default start: give `--start`"),
    ("no way leads", "no way from the start: give `--start`, `--exit` or `--goal`"),
    ("grey areas", "grey is not a door there: give `--grey`"),
    ("cannot be read", "the description names an image that is not there"),
    ("is missing", "no map: a description of something else"),
    ("does not describe a map", "no map: a description of something else"),
    ("is not a map's description", "no map: a description of something else"),
    ("is unknown here", "no map: another kind of text"),
    ("no wall", "no wall in it: a mask of another kind"),
)


@dataclass(frozen=True)
class Read:
    """The result for a file: its goal, or why it was refused, and the elapsed time, s."""

    name: str
    result: str
    seconds: float


def read(path: Path, choices: Choices) -> Read:
    """Read one file."""
    began = time.perf_counter()
    try:
        maze = read_maze(path, choices, radius=RobotDescription().radius)
    except MazeError as error:
        reason = next((words for part, words in KNOWN if part in error.reason), error.reason)
        return Read(path.name, f"refused: {reason}", time.perf_counter() - began)
    goal = "closed or without a goal" if maze.goal == Nothing() else "with a way out"
    return Read(path.name, f"read, {goal}", time.perf_counter() - began)


def helped(path: Path) -> Read:
    """Read one file as a user would after the message: with grey split if it is not a door, with another start."""
    first = read(path, Choices())
    choices = Choices()
    if "--grey" in first.result:
        choices = Choices(grey=Grey.SPLIT)
        first = read(path, choices)
    if "default start" not in first.result:
        return first
    start = roomiest(path, choices)
    return first if start is None else read(path, Choices(grey=choices.grey, start=start, goal=Nothing()))


def roomiest(path: Path, choices: Choices) -> Start | None:
    """A start in the middle of the largest free disc, or None where the maze cannot be drawn at all."""
    far = Start(Pose(-1e4, -1e4, 0.0))
    try:
        maze = drawn(path, Choices(grey=choices.grey, start=far, goal=Nothing()))
    except MazeError:
        return None
    space = DistanceGrid.around(maze.barriers, box(maze), limit=1.5, step=0.1, margin=0.0)
    row, column = np.unravel_index(int(np.argmax(space.clearance)), space.clearance.shape)
    x, y = space.point(int(row), int(column))
    return Start(Pose(x, y, 0.0))


def drawn(path: Path, choices: Choices) -> Maze:
    """A maze as its file draws it, unchecked."""
    from sim.formats import FORMATS
    from sim.formats.format import Source

    source = Source.of(path)
    return next(form for form in FORMATS if form.recognises(source)).read(source, choices).maze


def box(maze: Maze) -> tuple[float, float, float, float]:
    """The smallest box about the walls, m."""
    points = maze.barriers.reshape(-1, 2)
    return *points.min(axis=0).tolist(), *points.max(axis=0).tolist()


def files(folder: Path) -> Iterator[Path]:
    """The maps in a folder; a description represents its image."""
    found = {path for path in folder.rglob("*") if path.suffix in SUFFIXES and path.is_file()}
    images = {path.with_suffix(suffix) for path in found if path.suffix == ".yaml" for suffix in (".pgm", ".png")}
    yield from sorted(found - images)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--start-anywhere", action="store_true")
    parser.add_argument("--markdown", action="store_true")
    arguments = parser.parse_args()
    for folder in arguments.folders:
        results = [helped(path) if arguments.start_anywhere else read(path, Choices()) for path in files(folder)]
        counted = Counter(one.result for one in results)
        slowest = max((one.seconds for one in results), default=0.0)
        if arguments.markdown:
            for result, count in counted.most_common():
                print(f"| {folder.name} | {count} | {result} |")
        else:
            print(f"{folder}: {len(results)} files, the slowest {slowest:.1f} s")
            for result, count in counted.most_common():
                print(f"  {count:4}  {result}")


if __name__ == "__main__":
    main()
