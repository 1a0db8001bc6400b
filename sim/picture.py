"""A picture of a maze: walls, doors with the way they slide, moving objects with their paths, start and exits."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from sim.geometry import placed
from sim.maze import Maze, MazeError, Point, Reach
from transport.arithmetic import atan2, cos, sin
from transport.description import RobotDescription
from transport.files import replacing

SUFFIXES = (".png", ".svg")
METRES_AN_INCH = 1.0
SMALLEST, LARGEST = 4.0, 14.0
"""Limits of the picture's longer side, inches."""
DOTS_AN_INCH = 100
ARROW = 0.35
"""Length of the arrows, m."""


UNKNOWN = "0.6"
"""Grey of the edges of the unknown."""


def save_picture(maze: Maze, path: Path) -> None:
    """Draw a maze into a file.

    Args:
        maze: the maze.
        path: where to; its suffix says whether PNG or SVG.

    Raises:
        MazeError: the suffix is neither ``.png`` nor ``.svg``, or the file cannot be written.
    """
    if path.suffix not in SUFFIXES:
        raise MazeError(str(path), "a picture is a .png or an .svg file")
    try:
        with replacing(path) as file:
            draw(maze).savefig(file, format=path.suffix.removeprefix("."))
    except OSError as error:
        raise MazeError(str(path), f"cannot be written: {error.strerror or error}") from None


def draw(maze: Maze) -> Figure:
    """The picture as a matplotlib figure; x to the right, y up, to scale."""
    left, bottom, right, top = maze.bounds
    width, height = right - left + 1.0, top - bottom + 1.0
    scale = min(max(max(width, height) / METRES_AN_INCH, SMALLEST), LARGEST) / max(width, height)
    figure = Figure(figsize=(width * scale + 0.6, height * scale + 0.6), dpi=DOTS_AN_INCH, layout="constrained")
    axes = figure.add_subplot()
    axes.set_aspect("equal")
    axes.set_xlim(left - 0.5, right + 0.5)
    axes.set_ylim(bottom - 0.5, top + 0.5)
    axes.set_xlabel("x, m")
    axes.set_ylabel("y, m")
    axes.set_title(maze.name)
    _draw_walls(axes, maze)
    _draw_ends(axes, maze)
    _draw_what_moves(axes, maze)
    return figure


def _draw_walls(axes: Axes, maze: Maze) -> None:
    for segments, colour in ((maze.unknown, UNKNOWN), (maze.walls, "black")):
        gap = np.full((len(segments), 1), np.nan)
        x, y = (np.hstack([segments[:, [i, i + 2]], gap]).ravel() for i in (0, 1))
        axes.plot(x, y, color=colour, linewidth=1.5, solid_capstyle="round")


def _draw_ends(axes: Axes, maze: Maze) -> None:
    """The exits, each with an arrow outwards, the goal, and robots at the starts, each with an arrow ahead."""
    if isinstance(maze.goal, Reach):
        axes.add_patch(Circle(maze.goal.place, maze.goal.radius, color="tab:green", alpha=0.4))
    for ax, ay, bx, by in maze.exits.tolist():
        axes.plot([ax, bx], [ay, by], color="tab:green", linewidth=2, linestyle=":")
        _draw_arrow(axes, ((ax + bx) / 2, (ay + by) / 2), atan2(bx - ax, ay - by), "tab:green")
    for start in maze.starts:
        body = placed(np.asarray(RobotDescription().footprint), start.pose)
        axes.fill(body[:, 0], body[:, 1], color="tab:blue", alpha=0.6)
        _draw_arrow(axes, (start.pose.x, start.pose.y), start.pose.heading, "tab:blue")


def _draw_arrow(axes: Axes, at: Point, direction: float, colour: str) -> None:
    head = at[0] + ARROW * cos(direction), at[1] + ARROW * sin(direction)
    axes.annotate("", head, at, arrowprops={"arrowstyle": "->", "color": colour})


def _draw_what_moves(axes: Axes, maze: Maze) -> None:
    """The doors, shut and (dotted) open, and the objects with their paths."""
    for door in maze.doors:
        (ax, ay), (bx, by) = door.leaf
        axes.plot([bx, 2 * bx - ax], [by, 2 * by - ay], color="tab:red", linewidth=1, linestyle=":")
        axes.plot([ax, bx], [ay, by], color="tab:red", linewidth=3, solid_capstyle="butt")
        axes.annotate(
            door.name, ((ax + bx) / 2, (ay + by) / 2), xytext=(4, 4), textcoords="offset points", color="tab:red"
        )
    for thing in maze.objects:
        corners = np.asarray(thing.outline) + np.asarray(thing.path[0])
        axes.fill(corners[:, 0], corners[:, 1], color="tab:orange")
        axes.plot(*np.asarray(thing.path).T, color="tab:orange", linestyle="--", linewidth=1)
