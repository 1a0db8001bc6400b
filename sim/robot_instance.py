"""One robot of a simulation: its sensors, its commands on their way, its faults and its referee."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sim.faults import (
    BeamsMissing,
    Carried,
    CommandLate,
    CommandLost,
    Fault,
    LaserBlinded,
    LaserFrozen,
    LaserSilent,
    OdometryJump,
    OdometrySilent,
    Watch,
)
from sim.geometry import placed
from sim.lidar import Lidar
from sim.maze import Maze
from sim.noise import disturbed
from sim.odometry import WheelOdometry, displacement
from sim.pose_history import PoseHistory
from sim.referee import Referee, RefereeReport, may_open
from sim.settings import SimulatorSettings
from sim.world import PhysicalWorld
from transport.description import RobotDescription
from transport.messages import STOP, Command, DoorReply, Observation, Pose, Scan, Twist, wrap_angle
from transport.sanity import observed


class RobotInstance:
    """One robot in a world; every random number for it comes from its own streams."""

    def __init__(
        self, description: RobotDescription, maze: Maze, settings: SimulatorSettings, seed: int, index: int
    ) -> None:
        """Args: the robot, its world, the settings, the run's seed, and the robot's place among the others."""
        self.description = description
        self._maze, self._settings, self._index = maze, settings, index
        self._noise, odometry, self._placing = (_stream(seed, index, purpose) for purpose in range(3))
        self._lidar = Lidar(description.laser.geometry(), description.laser.mount)
        self._odometry = WheelOdometry(description.base, settings.odometry, odometry)
        self._watches = [Watch(fault) for fault in settings.faults if fault.concerns(description.name)]
        self._pending: deque[Command] = deque()
        self._obeyed = Command(STOP)
        self._door: DoorReply | None = None
        self._ranges: NDArray[np.float32] | None = None
        self._last: Observation | None = None
        self.pose = self._drawn_start()
        self.path = PoseHistory()
        self.path.append(self.pose)
        self.verdicts: list[RefereeReport] = []
        self.referee = Referee(maze, settings.rules, self.pose)

    def _drawn_start(self) -> Pose:
        start = self._maze.starts[self._index]
        x, y, heading = self._placing.uniform(-1.0, 1.0, 3).tolist()
        return Pose(
            start.pose.x + x * start.spread.x,
            start.pose.y + y * start.spread.y,
            wrap_angle(start.pose.heading + heading * start.spread.heading),
        )

    def faults(self, time: float) -> list[Fault]:
        """The faults in force now."""
        return [watch.fault for watch in self._watches if watch.holds(time, self.pose)] if self._watches else []

    def obey(self, command: Command, time: float, world: PhysicalWorld) -> Twist:
        """Accept a command, unless it is lost or late, ring if requested, and return the target velocity."""
        faults, arrived = self.faults(time), [command]
        if faults or self._pending:
            late = next((fault.ticks for fault in faults if isinstance(fault, CommandLate)), 0)
            self._pending.append(command)
            arrived = [self._pending.popleft() for _ in range(max(len(self._pending) - late, 0))]
            if any(isinstance(fault, CommandLost) for fault in faults):
                arrived = []
        self._door = None
        for heard in arrived:
            self._obeyed = heard
            if heard.ring:
                self._door = self._ring(heard, world)
        return self._obeyed.twist

    def _ring(self, command: Command, world: PhysicalWorld) -> DoorReply:
        pose = self.pose
        corners = placed(world.bases[self.description.name].outline, pose)
        refusals = {
            door: may_open(self._settings.rules, corners, pose, command, door.doorway()) for door in world.doors
        }
        opening = [door for door, refusal in refusals.items() if not refusal]
        for door in opening:
            door.ask()
        self.referee.rang(opening)
        if opening:
            return DoorReply(accepted=True)
        return DoorReply(accepted=False, reason=min(refusals.values(), default="the maze has no door"))

    def advance(self, time: float, duration: float, world: PhysicalWorld, contacts_before: int) -> None:
        """Record the result of a tick."""
        name = self.description.name
        pose = world.bases[name].pose
        self._odometry.count(displacement(self.pose, pose), duration, time)
        self.pose = pose
        touched = tuple([contact for contact in world.contacts[contacts_before:] if contact.robot == name])
        self.referee.watch(time, pose, world, name, touched)
        for watch in self._watches:
            match watch.fault:
                case OdometryJump(by=by) if watch.fires(time, pose):
                    self._odometry.jump(Twist(*by))
                case Carried(to=to) if watch.fires(time, pose):
                    self._put(Pose(*to), world)
        self.path.append(self.pose)

    def observe(self, time: float, stamp: int, world: PhysicalWorld) -> Observation:
        """The robot's current sensor data."""
        faults = self.faults(time)
        scan, odometry = self._measured(faults, stamp, world), self._odometry.reading(stamp)
        if faults and self._last is not None:
            scan = self._last.scan if any(isinstance(fault, LaserSilent) for fault in faults) else scan
            silent = any(isinstance(fault, OdometrySilent) for fault in faults)
            odometry = self._last.odometry if silent else odometry
        self._last = observed(stamp, scan, odometry, self._door)
        return self._last

    def _measured(self, faults: Sequence[Fault], stamp: int, world: PhysicalWorld) -> Scan:
        """The scan at the current pose; its noise is drawn even if the scan is lost."""
        geometry = self._lidar.geometry
        exact = self._lidar.ranges(world.around(self.description.name), self.pose)
        ranges = disturbed(exact, self._settings.noise, geometry, self._noise)
        for fault in faults:
            match fault:
                case LaserFrozen() if self._ranges is not None:
                    ranges = self._ranges.copy()
                case LaserBlinded():
                    ranges[:] = np.nan
                case BeamsMissing(angles=(first, last)):
                    angles = geometry.angles()
                    ranges[(angles >= first) & (angles <= last)] = np.nan
        self._ranges = ranges
        ranges.flags.writeable = False
        return Scan(stamp, geometry, ranges)

    def try_again(self, time: float, world: PhysicalWorld) -> None:
        """Begin the next attempt at the start."""
        self.verdicts.append(self.referee.verdict)
        pose = self._drawn_start()
        self._put(pose, world)
        self.path.append(pose)
        self._obeyed, self._door = Command(STOP), None
        self._pending.clear()
        self.referee = Referee(self._maze, self._settings.rules, pose, time, self.referee.attempt + 1)

    def _put(self, pose: Pose, world: PhysicalWorld) -> None:
        """Carry the robot elsewhere: it is at rest, and its wheels have not turned."""
        self.pose = pose
        world.put(self.description.name, pose)
        self._odometry.stand()
        self.referee.carried(pose)


def _stream(seed: int, robot: int, purpose: int) -> np.random.Generator:
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=(robot, purpose))))
