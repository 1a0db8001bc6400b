"""The corridor challenge: a straight corridor with one exit to a side, generated from a seed."""

from __future__ import annotations

import math
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from sim.maze import Maze, Start
from sim.solvability import checked
from transport.arithmetic import tan
from transport.description import RobotDescription
from transport.messages import Pose
from transport.section import Positive, Settings

START = 0.5
"""From the wall behind the start to the robot, m."""
WIDTHS = (0.6, 1.5)
"""Widths of the generated corridors and exits, m."""
TIME_LIMIT = 300.0
"""Time for the corridor challenge, s."""

Width = Annotated[float, Field(ge=0.6, le=2.0)]


class Corridor(Settings):
    """The parameters of a corridor. It runs along y; the robot faces along it."""

    width: Width = 1.0
    """From wall to wall, m."""
    opening: Width = 1.0
    """Width of the exit, m."""
    side: Literal["left", "right"] = "right"
    """Where the exit is."""
    length: Positive = 3.0
    """From the wall behind the start to the exit's near corner, m."""
    beyond: Positive = 1.0
    """How far the corridor continues after the exit, m."""
    depth: Positive = 0.8
    """How long the walls on both sides of the exit are, m."""
    lean: Annotated[float, Field(ge=-5, le=5)] = 0.0
    """The exit leaves at a right angle except for this many degrees."""
    misplaced: float = 0.0
    """How far to the left of the corridor's middle the robot starts, m."""
    misaligned: float = 0.0
    """How far the robot is turned out of the corridor's direction at the start, degrees."""


def corridor(wanted: Corridor, name: str = "corridor") -> Maze:
    """Build a corridor.

    Args:
        wanted: its parameters.
        name: of the maze.

    Raises:
        UnsolvableError: no robot gets through it.
    """
    sign = 1.0 if wanted.side == "left" else -1.0
    half, near, far = wanted.width / 2, wanted.length, wanted.length + wanted.opening
    end = far + wanted.beyond
    aside = sign * (half + wanted.depth)
    shift = wanted.depth * tan(math.radians(wanted.lean))
    gate = [(aside, near + shift), (aside, far + shift)]
    walls = [
        (-half, 0.0, half, 0.0),
        (-sign * half, 0.0, -sign * half, end),
        (-half, end, half, end),
        (sign * half, 0.0, sign * half, near),
        (sign * half, near, *gate[0]),
        (sign * half, far, *gate[1]),
        (sign * half, far, sign * half, end),
    ]
    start = Start(Pose(wanted.misplaced, START, math.radians(90.0 + wanted.misaligned)))
    exits = np.array([(*gate[0], *gate[1])])
    maze = Maze(name, np.asarray(walls), start, exits, time_limit=TIME_LIMIT)
    return checked(maze, radius=RobotDescription().radius)  # drawn for PICO


def random_corridor(seed: int) -> Corridor:
    """Draw the parameters of a corridor: 0.6 to 1.5 m wide, the exit left or right, the robot placed imprecisely.

    Args:
        seed: its seed.
    """
    generator = np.random.Generator(np.random.PCG64(seed))
    width, opening = (round(float(drawn), 3) for drawn in generator.uniform(*WIDTHS, 2))
    aside = max(0.0, width / 2 - 0.3)
    return Corridor(
        width=width,
        opening=opening,
        side="left" if generator.random() < 0.5 else "right",
        length=round(float(generator.uniform(1.5, 6.0)), 3),
        beyond=round(float(generator.uniform(0.5, 3.0)), 3),
        depth=round(float(generator.uniform(0.4, 1.5)), 3),
        lean=round(float(generator.uniform(-3.0, 3.0)), 2),
        misplaced=round(float(generator.uniform(-0.5, 0.5)) * aside, 3),
        misaligned=round(float(generator.uniform(-5.0, 5.0)), 2),
    )
