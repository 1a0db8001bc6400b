"""A simulator to drive in: mazes by name, a world in lockstep, the referee's verdict as a report."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from maze_machine.catalogue.shipped import find_file
from sim.formats import AS_THE_FILE_SAYS, Choices, read_maze
from sim.maze import Maze, Nothing
from sim.referee import RefereeReport
from sim.settings import SimulatorSettings
from sim.shipped import shipped_mazes
from sim.simulation import Simulation
from transport.clock import Pace
from transport.description import RobotDescription
from transport.messages import STOP, Command, Observation, Pose


def maze_file(name: str) -> Path:
    """The file of a maze.

    Args:
        name: a file, or the name of a shipped maze.

    Raises:
        FileError: there is neither.
    """
    return find_file("maze", name, shipped_mazes())


def find_maze(name: str, choices: Choices = AS_THE_FILE_SAYS, *, robot: RobotDescription) -> Maze:
    """Read a maze of any format from a file, or a shipped one by its name.

    Args:
        name: a file, or the name of a shipped maze.
        choices: the user's choices: start, exits, goal, scale.
        robot: the robot that must fit through it.

    Raises:
        FileError: there is neither.
        MazeError: the file is not a maze, or one in which the robot cannot reach the goal.
    """
    return read_maze(maze_file(name), choices, radius=robot.radius)


class SimulatedWorld:
    """One episode in a simulation, of one attempt or several: ``transport.world.World`` for a single robot."""

    def __init__(
        self,
        maze: Maze,
        robot: RobotDescription,
        seed: int = 0,
        settings: SimulatorSettings | None = None,
        pace: Pace | None = None,
    ) -> None:
        """Args: the maze, the robot, the seed, the simulator's settings, and a clock; None not to wait."""
        self._simulation = Simulation(maze, robot, seed, settings)
        self._pace = pace
        self._began = 0

    @property
    def maze(self) -> Maze:
        """Where it takes place."""
        return self._simulation.maze

    @property
    def observation(self) -> Observation:
        """The current sensor data of the robot."""
        return self._simulation.observation

    @property
    def finished(self) -> bool:
        """Whether the referee has ended the attempt."""
        return self._simulation.finished()

    @property
    def path(self) -> Sequence[Pose]:
        """The true pose of the robot at each tick of the current attempt, in the maze's frame."""
        return self._simulation.path()[self._began :]

    def pose(self, tick: int) -> Pose:
        """The true pose of the robot at a tick of the current attempt, in the maze's frame."""
        return self._simulation.path()[self._began + tick]

    def step(self, command: Command) -> Observation:
        """Execute a command for one period."""
        if self._pace is not None:
            self._pace.wait()
        self._simulation.step(command)
        return self._simulation.observation

    def report(self) -> Mapping[str, object]:
        """The referee's verdict so far, of JSON values."""
        return {
            "maze": self._simulation.maze.name,
            "seed": self._simulation.seed,
            **as_report(self._simulation.verdict()),
        }

    def attempts(self) -> list[Mapping[str, object]]:
        """The referee's verdict on each attempt so far, in order, of JSON values."""
        return [as_report(verdict) for verdict in self._simulation.verdicts()]

    def try_again(self) -> bool:
        """Begin the next attempt at the start, if the rules allow one; time continues.

        A robot that is still inside is there until the referee has ended its attempt.

        Returns:
            Whether they did. Without a goal there is one attempt.
        """
        if isinstance(self.maze.goal, Nothing):
            return False
        while not self.finished:
            self.step(Command(STOP))
        began = len(self._simulation.path())
        granted = self._simulation.try_again()
        if granted:
            self._began = began
        return granted


def as_report(verdict: RefereeReport) -> dict[str, object]:
    """A verdict as JSON values; lengths in m, times in s."""
    return {
        "attempt": verdict.attempt,
        "goal": str(verdict.goal),
        "solved": verdict.solved,
        "escaped": verdict.escaped,
        "outcome": verdict.outcome.value,
        "reason": verdict.reason,
        "line": verdict.line(),
        "time": verdict.time,
        "path_length": verdict.path_length,
        "clearance": verdict.clearance if math.isfinite(verdict.clearance) else None,
        "doors_opened": list(verdict.doors_opened),
        "contacts": [str(contact) for contact in verdict.contacts],
        "rings": verdict.rings,
    }
