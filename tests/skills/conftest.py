"""Activities driven in small simulated worlds."""

import math
from dataclasses import dataclass

import numpy as np
import pytest

from hsm.model.registry import Outcome
from perception import Perception
from sim.maze import Maze, Start
from sim.settings import SimulatorSettings
from sim.simulation import Simulation
from skills.chain import MotionChain
from skills.settings import SkillSettings
from transport.description import RobotDescription
from transport.messages import STOP, Command, Pose, Twist


@dataclass
class Drive:
    """What an activity did."""

    outcome: str | None
    path: list[Pose]
    commands: list[Command]
    clearance: float
    touched: bool
    last: Twist

    @property
    def end(self) -> Pose:
        return self.path[-1]


@pytest.fixture
def world():
    def make(walls, pose=Pose(), doors=(), objects=()):  # noqa: B008
        walls = np.asarray(walls, dtype=float).reshape(-1, 4)
        return Maze("test", walls, Start(pose), doors=tuple(doors), objects=tuple(objects))

    return make


@pytest.fixture
def drive():
    """Run an activity until its outcome or for a time (s), through limits and guard, with noise."""

    def run(activity, maze, seed=0, limit=20.0, robot=RobotDescription()):  # noqa: B008
        simulation = Simulation(maze, robot, seed, SimulatorSettings())
        perception, chain = Perception(robot), MotionChain(robot, SkillSettings())
        outcome, commands = None, []
        while simulation.time < limit and outcome is None:
            facts = perception.facts(simulation.observation)
            effect = activity.tick(facts)
            if isinstance(effect, Outcome):
                outcome, effect = effect.name, Command()
            command = chain.shape(effect, facts)
            commands.append(command)
            simulation.step(command)
        while commands[-1].twist != STOP and outcome is not None and simulation.time < limit + 5.0:
            facts = perception.facts(simulation.observation)
            commands.append(chain.shape(Command(), facts))
            simulation.step(commands[-1])
        verdict = simulation.verdict()
        return Drive(
            outcome, list(simulation.path()), commands, verdict.clearance, bool(verdict.contacts), commands[-1].twist
        )

    return run


@pytest.fixture
def corridor():
    """The walls of a corridor along x, with its middle at y = 0, closed at its end."""

    def make(width, length=8.0, behind=2.0):
        half = width / 2
        return [(-behind, half, length, half), (-behind, -half, length, -half), (length, -half, length, half)]

    return make


@pytest.fixture
def side_exit():
    """The walls of a corridor along x that has one exit to a side, from x = 2 on."""

    def make(side, width, opening):
        half = width / 2
        y = math.copysign(half, side)
        out = y + math.copysign(3.0, side)
        return [
            (-2, -y, 2 + opening, -y),
            (-2, y, 2, y),
            (2, y, 2, out),
            (2 + opening, -y, 2 + opening, out),
        ]

    return make


@pytest.fixture
def hall():
    """The walls of a hall, 8 m along x and 6 m along y; the robot stands in its middle line, 2 m from one end."""
    return [(-2, -3, 6, -3), (6, -3, 6, 3), (6, 3, -2, 3), (-2, 3, -2, -3)]


@pytest.fixture
def block():
    """The sides of a block by its middle, length and width."""

    def make(x, y, length, width):
        left, right, low, high = x - length / 2, x + length / 2, y - width / 2, y + width / 2
        return [(left, low, right, low), (right, low, right, high), (right, high, left, high), (left, high, left, low)]

    return make
