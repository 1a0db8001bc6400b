"""A simulated robot in memory, in lockstep: a command advances the world by one period."""

from __future__ import annotations

from collections.abc import Sequence

from sim.maze import Maze
from sim.referee import RefereeReport
from sim.settings import SimulatorSettings
from sim.simulation import Simulation
from transport.description import RobotDescription
from transport.messages import Command, Observation, Pose


class SimulatedRobot:
    """The `transport.robot.Robot` whose far side is a `Simulation` in the same process."""

    def __init__(
        self,
        maze: Maze,
        description: RobotDescription | None = None,
        seed: int = 0,
        settings: SimulatorSettings | None = None,
    ) -> None:
        self.simulation = Simulation(maze, description, seed, settings)

    def observe(self) -> Observation:
        """The observation of this moment; the same one until the next command."""
        return self.simulation.observation

    def command(self, command: Command) -> None:
        """Advance the world by one period."""
        self.simulation.step(command)

    def close(self) -> None:
        """Nothing to release."""

    @property
    def verdict(self) -> RefereeReport:
        """The referee's verdict on the attempt so far."""
        return self.simulation.verdict()

    @property
    def finished(self) -> bool:
        """Whether the referee has ended the attempt."""
        return self.simulation.finished()

    @property
    def truth(self) -> Pose:
        """The true pose of the robot; for referees, pictures and tests, never for a controller."""
        return self.simulation.truth()

    @property
    def path(self) -> Sequence[Pose]:
        """The true pose of the robot at each tick."""
        return self.simulation.path()
