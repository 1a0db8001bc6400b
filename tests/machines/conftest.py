"""Shipped machines driven in small simulated mazes."""

import math
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest

from maze_machine.catalogue.profile import load_profile
from maze_machine.drive.mission import drive, prepare
from perception import Perception
from sim.maze import Maze, Start
from sim.robot import SimulatedRobot
from transport.messages import Pose


@cache
def mission(name, parameters=()):
    return prepare(name, load_profile(), parameters)


class Referee:
    def __init__(self, robot):
        self._robot = robot

    @property
    def finished(self):
        return self._robot.finished

    def report(self):
        return {}


@dataclass
class Run:
    """What became of a machine in a maze."""

    verdict: object
    outcome: str | None
    states: list[str]
    path: list[Pose]
    perception: Perception


@pytest.fixture(scope="session")
def solve():
    """Drive a machine by name through a maze until the referee or the time limit (s) ends it.

    With a run before it, `known`, the robot knows what it learned there.
    """

    def run(name, maze, seed=0, limit=400.0, known=None, **parameters):
        chosen = replace(mission(name, tuple(parameters.items())), time_limit=limit)
        robot = SimulatedRobot(maze, chosen.profile.robot, seed)
        states, profile = [], chosen.profile
        learned = known.perception.world.from_the_start() if known else None
        perception = Perception(profile.robot, profile.perception, learned)
        watch = [lambda tick: states.extend(tick.configuration)]
        ending = drive(chosen, robot, Referee(robot), watch, perception)
        return Run(robot.verdict, ending.outcome, list(dict.fromkeys(states)), list(robot.path), perception)

    return run


@pytest.fixture(scope="session")
def maze():
    """A maze drawn in characters, one metre each: `#` solid, `s` the start, `E` a gap of the outer wall."""

    def draw(text, heading=90.0):
        rows = text.strip("\n").split("\n")
        width = max(map(len, rows))
        rows = [row.ljust(width, "#") for row in reversed(rows)]
        walls, exits, start = [], [], None
        for j, row in enumerate(rows):
            for i, character in enumerate(row):
                if character == "#":
                    continue
                if character == "s":
                    start = Pose(i + 0.5, j + 0.5, math.radians(heading))
                sides = {
                    (1, 0): (i + 1, j + 1, i + 1, j),
                    (-1, 0): (i, j, i, j + 1),
                    (0, 1): (i, j + 1, i + 1, j + 1),
                    (0, -1): (i + 1, j, i, j),
                }
                for (di, dj), wall in sides.items():
                    outside = not (0 <= i + di < width and 0 <= j + dj < len(rows))
                    if outside and character == "E":
                        exits.append(wall)
                    elif outside or rows[j + dj][i + di] == "#":
                        walls.append(wall)
        exits = np.asarray(exits[:1], dtype=float)
        return Maze("drawn", np.asarray(walls, dtype=float), Start(start), exits, time_limit=math.inf)

    return draw
