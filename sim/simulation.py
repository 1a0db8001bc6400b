"""One simulated world with its robots: sensors, commands, referee; everything drawn from one seed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from sim.geometry import placed
from sim.lidar import Lidar
from sim.maze import Maze, Segments
from sim.noise import disturbed
from sim.odometry import WheelOdometry, displacement
from sim.referee import Referee, Verdict, may_open
from sim.settings import SimulatorSettings
from sim.world import World, limited
from transport.description import RobotDescription
from transport.messages import NANOSECONDS, STOP, Command, DoorReply, Observation, Pose, Scan, Twist, wrap_angle


class _Member:
    """One robot in the world: its sensors, its referee and what it knows."""

    def __init__(self, description: RobotDescription, streams: Sequence[np.random.Generator]) -> None:
        self.description = description
        self.noise, odometry, self.placing = streams
        self._odometry_stream = odometry
        self.lidar = Lidar(description.laser.geometry(), description.laser.mount)
        self.door: DoorReply | None = None
        self.path: list[Pose] = []

    def begin(self, maze: Maze, settings: SimulatorSettings) -> None:
        """Everything but the start pose, which `Simulation` draws first."""
        self.odometry = WheelOdometry(settings.odometry, self._odometry_stream)
        self.referee = Referee(maze, settings.rules, self.path[0])


class Simulation:
    """A maze with robots in it, carried on one period at a time.

    Args to create it: the maze, one description or several with different names and equal periods, the seed of all
    that is random, and settings.
    """

    def __init__(
        self,
        maze: Maze,
        descriptions: RobotDescription | Sequence[RobotDescription] | None = None,
        seed: int = 0,
        settings: SimulatorSettings | None = None,
    ) -> None:
        if descriptions is None:
            descriptions = RobotDescription()
        self._descriptions = (descriptions,) if isinstance(descriptions, RobotDescription) else tuple(descriptions)
        if len({description.name for description in self._descriptions}) != len(self._descriptions):
            raise ValueError("robots that share a world need different names")
        if len({description.period for description in self._descriptions}) != 1:
            raise ValueError("robots that share a world need the same period")
        self.maze = maze
        self.settings = settings or SimulatorSettings()
        self.seed = seed
        self.reset()

    def reset(self, seed: int | None = None) -> None:
        """Begin anew, with the same seed or another one: world, doors, objects, noise, odometry, referee."""
        self.seed = self.seed if seed is None else seed
        self.ticks = 0
        self.period_ns = round(self._descriptions[0].period * NANOSECONDS)
        self._substeps = max(round(self._descriptions[0].period / self.settings.substep), 1)
        self._members: dict[str, _Member] = {}
        starts: dict[str, tuple[RobotDescription, Pose]] = {}
        for index, description in enumerate(self._descriptions):
            member = _Member(description, [_stream(self.seed, index, purpose) for purpose in range(3)])
            pose = self._drawn_start(member)
            member.path.append(pose)
            member.begin(self.maze, self.settings)
            self._members[description.name] = member
            starts[description.name] = description, pose
        self.world = World(self.maze, starts, self._descriptions[0].period / self._substeps)
        self._observations = self._observe()

    def _drawn_start(self, member: _Member) -> Pose:
        start = self.maze.start
        x, y, heading = member.placing.uniform(-1.0, 1.0, 3).tolist()
        return Pose(
            start.pose.x + x * start.spread.x,
            start.pose.y + y * start.spread.y,
            wrap_angle(start.pose.heading + heading * start.spread.heading),
        )

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
        """What each robot observes now."""
        return self._observations

    @property
    def observation(self) -> Observation:
        """What the first robot observes now."""
        return self._observations[self.names[0]]

    def verdict(self, name: str | None = None) -> Verdict:
        """The referee's word on a robot, by default the first."""
        return self._member(name).referee.verdict

    def truth(self, name: str | None = None) -> Pose:
        """Where a robot, by default the first, really is; for referees, pictures and tests only."""
        return self._member(name).path[-1]

    def path(self, name: str | None = None) -> Sequence[Pose]:
        """Where a robot, by default the first, really was at each tick."""
        return self._member(name).path

    def _member(self, name: str | None) -> _Member:
        return self._members[self.names[0] if name is None else name]

    def step(self, commands: Command | Mapping[str, Command]) -> None:
        """Carry the world on by one period.

        Args:
            commands: the first robot's command, or each robot's by name; a robot without one stops.
        """
        if isinstance(commands, Command):
            commands = {self.names[0]: commands}
        targets: dict[str, Twist] = {}
        for name, member in self._members.items():
            command = commands.get(name, Command(STOP))
            targets[name] = limited(command.twist, member.description.limits)
            member.door = self._ring(name, member, command) if command.ring else None
        contacts_before = len(self.world.contacts)
        self.world.carry(targets, self._substeps)
        self.ticks += 1
        solids = self.world.solids()
        for name, member in self._members.items():
            pose = self.world.bases[name].pose
            member.odometry.count(displacement(member.path[-1], pose), self.time)
            member.path.append(pose)
            touched = tuple(contact for contact in self.world.contacts[contacts_before:] if contact.robot == name)
            corners = placed(self.world.bases[name].outline, pose)
            member.referee.watch(self.time, pose, corners, self._seen_by(name, solids), touched)
        self._observations = self._observe()

    def _ring(self, name: str, member: _Member, command: Command) -> DoorReply:
        corners = placed(self.world.bases[name].outline, member.path[-1])
        opened, refusals = [], []
        for door in self.world.doors:
            refusal = may_open(self.settings.rules, corners, member.path[-1], command, door.doorway())
            if refusal:
                refusals.append(refusal)
            else:
                door.ask()
                opened.append(door.door.name)
        member.referee.rang(tuple(opened))
        if opened:
            return DoorReply(accepted=True)
        return DoorReply(accepted=False, reason=min(refusals, default="the maze has no door"))

    def _seen_by(self, name: str, solids: Segments) -> Segments:
        others = self.world.outlines(but=name)
        return np.concatenate([solids, *others]) if others else solids

    def _observe(self) -> dict[str, Observation]:
        stamp = self.ticks * self.period_ns
        solids = self.world.solids()
        observations = {}
        for name, member in self._members.items():
            exact = member.lidar.ranges(self._seen_by(name, solids), member.path[-1])
            ranges = disturbed(exact, self.settings.noise, member.lidar.geometry, member.noise)
            scan = Scan(stamp, member.lidar.geometry, ranges)
            odometry = member.odometry.reading(stamp, self.world.bases[name].twist)
            observations[name] = Observation(stamp, scan, odometry, member.door)
        return observations


def _stream(seed: int, robot: int, purpose: int) -> np.random.Generator:
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=(robot, purpose))))
