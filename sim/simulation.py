"""One simulated world with its robots, advanced period by period; all random values come from one seed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from sim.faults import DoorStuck, ObjectStops
from sim.maze import Maze
from sim.referee import AttemptOutcome, RefereeReport
from sim.robot_instance import RobotInstance
from sim.settings import SimulatorSettings
from sim.world import PhysicalWorld
from transport.description import RobotDescription
from transport.messages import NANOSECONDS, STOP, Command, Observation, Pose


class Simulation:
    """A maze with robots in it.

    The same maze, robots, seed, settings and commands give the same observations, bit by bit.
    """

    def __init__(
        self,
        maze: Maze,
        robots: RobotDescription | Sequence[RobotDescription] | None = None,
        seed: int = 0,
        settings: SimulatorSettings | None = None,
    ) -> None:
        """Put robots into a maze.

        Args:
            maze: where.
            robots: one robot or several; they differ in name and share the period. By default PICO.
            seed: the seed of all random values.
            settings: noise, rules, faults.

        Raises:
            ValueError: two robots have one name, or different periods, or there are more robots than starts.
        """
        robots = RobotDescription() if robots is None else robots
        self._robots = (robots,) if isinstance(robots, RobotDescription) else tuple(robots)
        if len({robot.name for robot in self._robots}) != len(self._robots):
            raise ValueError("robots that share a world need different names")
        if len({robot.period for robot in self._robots}) != 1:
            raise ValueError("robots that share a world need the same period")
        if len(self._robots) > len(maze.starts):
            raise ValueError(f"{len(self._robots)} robots need as many starts; the maze has {len(maze.starts)}")
        self._first = self._robots[0].name
        self.maze = maze
        self.settings = settings or SimulatorSettings()
        self.seed = seed
        self.period_ns = round(self._robots[0].period * NANOSECONDS)
        self._substeps = max(round(self._robots[0].period / self.settings.substep), 1)
        self.reset()

    def reset(self, seed: int | None = None) -> None:
        """Restart with the same seed or another one; nothing of the previous state remains."""
        self.seed = self.seed if seed is None else seed
        self.ticks = 0
        self._members = {
            robot.name: RobotInstance(robot, self.maze, self.settings, self.seed, index)
            for index, robot in enumerate(self._robots)
        }
        self.world = self._new_world()
        self._observe()

    def _new_world(self) -> PhysicalWorld:
        placed = {name: (member.description, member.pose) for name, member in self._members.items()}
        return PhysicalWorld(self.maze, placed, self._robots[0].period / self._substeps, self.time)

    @property
    def names(self) -> tuple[str, ...]:
        """The robots' names."""
        return tuple(self._members)

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self.ticks * self.period_ns / NANOSECONDS

    @property
    def observations(self) -> Mapping[str, Observation]:
        """The current observation of each robot."""
        return self._observations

    @property
    def observation(self) -> Observation:
        """The current observation of the first robot."""
        return self._observations[self._first]

    def verdict(self, name: str | None = None) -> RefereeReport:
        """The referee's verdict on the current attempt of a robot, by default the first."""
        return self._member(name).referee.verdict

    def verdicts(self, name: str | None = None) -> tuple[RefereeReport, ...]:
        """The referee's verdicts on all attempts so far of a robot, by default the first."""
        member = self._member(name)
        return (*member.verdicts, member.referee.verdict)

    def finished(self, name: str | None = None) -> bool:
        """Whether the present attempt of a robot, by default the first, is over."""
        return self._member(name).referee.finished

    def truth(self, name: str | None = None) -> Pose:
        """The true pose of a robot, by default the first; for referees, pictures and tests only."""
        return self._member(name).pose

    def path(self, name: str | None = None) -> Sequence[Pose]:
        """The true poses of a robot, by default the first, at each tick."""
        return self._member(name).path

    def _member(self, name: str | None) -> RobotInstance:
        return self._members[self._first if name is None else name]

    def step(self, commands: Command | Mapping[str, Command]) -> None:
        """Advance the world by one period.

        Args:
            commands: the first robot's command, or each robot's by name; a robot without one stops.
        """
        if isinstance(commands, Command):
            commands = {self._first: commands}
        time = self.time
        if self.settings.faults:
            self._apply_world_faults()
        targets = {
            name: member.description.limited(member.obey(commands.get(name, Command(STOP)), time, self.world))
            for name, member in self._members.items()
        }
        contacts_before = len(self.world.contacts)
        self.world.carry(targets, self._substeps)
        self.ticks += 1
        for member in self._members.values():
            member.advance(self.time, self._robots[0].period, self.world, contacts_before)
        self._observe()

    def _apply_world_faults(self) -> None:
        faults = [fault for member in self._members.values() for fault in member.faults(self.time)]
        stuck = [fault.door for fault in faults if isinstance(fault, DoorStuck)]
        halted = [fault.thing for fault in faults if isinstance(fault, ObjectStops)]
        for door in self.world.doors:
            door.stuck = "" in stuck or door.door.name in stuck
        for thing in self.world.objects:
            thing.halted = "" in halted or thing.thing.name in halted

    def _observe(self) -> None:
        stamp = self.ticks * self.period_ns
        self._observations = {
            name: member.observe(self.time, stamp, self.world) for name, member in self._members.items()
        }

    def try_again(self, name: str | None = None) -> bool:
        """Begin the next attempt of a robot, by default the first: it is put back to the start, and time runs on.

        A robot that is alone in its world finds the doors shut and the objects where they began.

        Returns:
            Whether there is another attempt; there is none after a success, unless it is practice, nor when attempts or
            time are used up.
        """
        member = self._member(name)
        verdict = member.referee.verdict
        spent = member.referee.attempt >= self.settings.rules.attempts
        final = verdict.solved and verdict.finished and not self.settings.rules.practice
        if spent or final or verdict.outcome in (AttemptOutcome.RUNNING, AttemptOutcome.OUT_OF_TIME):
            return False
        member.try_again(self.time, self.world)
        if len(self._members) == 1:
            self.world = self._new_world()
        self._observe()
        return True
