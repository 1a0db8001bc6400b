"""A robot with failing or odd sensors: when it stops, how far it rolls, and what is reported.

    python benchmarks/habits.py [HABIT ...] [--json]

Each habit begins while `right_hand` drives along a corridor at full speed. Three robots have it: a bare ROS 2 driver,
the same driver behind a gate whose controller does not look at its sensors (so the gate is alone), and the simulator in
lockstep, where it has such a fault. Controller, gate and driver run on one clock that is turned by hand, so that the
figures are exact and the same on every computer. Time and distance count from the last datum that was good to the first
moment at which the robot is truly at rest; its base brakes as its profile says.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

# Before the folder of the benchmarks, where a script has the name of a package.
sys.path.insert(0, str(Path(__file__).parents[1]))

from maze_machine.catalogue.profile import Profile, load_profile
from maze_machine.drive.loop import ticks
from maze_machine.drive.mission import prepare
from maze_machine.drive.tick import Tick
from maze_machine.simulated.settings import simulator_settings
from maze_machine.simulated.world import SimulatedWorld
from perception import Perception
from sim.maze import Maze, Start
from skills.chain import MotionChain
from transport.codec import decode_twist, encode_odometry, encode_scan
from transport.connect import open_robot
from transport.description import Laser
from transport.driver import RosDriver
from transport.gate import DriverBase, Gate
from transport.keys import RobotKeys
from transport.memory_bus import MemoryNetwork
from transport.messages import NANOSECONDS, STOP, Command, Observation, Odometry, Pose, Scan, ScanGeometry, Twist
from transport.robot import LinkError, Robot
from transport.settings import LinkSettings
from transport.world import LockstepRobot

ONSET = 2.0
"""When a habit begins, s after the start: the robot drives at full speed."""
LENGTH = 7.0
"""How long a run is watched, s after the habit began."""
FINE = 0.02
"""Step of the simulated driver, s: so exactly is its standstill known."""
PUBLISHED = 0.1
"""A driver's sensors are published this often, s."""
BARE = LinkSettings(gate=False)
BEGIN = 1000.0
"""What a driver's clock shows at the start, s."""
STANDING = 0.001
"""A robot that moves less than this in a step is at rest, m."""

PICO = Laser()

Sent = tuple[Scan | None, Odometry | None]
Change = Callable[[Scan, Odometry, int], Sent]
"""What a driver publishes in place of a scan and an odometry, for the k-th time since the habit began."""


@dataclass(frozen=True)
class Habit:
    """What a robot's driver does to its data.

    Attributes:
        name: for the table.
        change: what becomes of a scan and an odometry.
        from_start: it has always done so.
        laser: the laser, as the profile says.
        fault: the same as a fault of the simulator, where there is one.
    """

    name: str
    change: Change
    from_start: bool = False
    laser: Laser = PICO
    fault: str = ""


def _ranges(scan: Scan, change: Callable[[np.ndarray], None]) -> Scan:
    ranges = scan.ranges.copy()
    change(ranges)
    return replace(scan, ranges=ranges)


def _filled(scan: Scan, value: float, first: int = 0, last: int | None = None) -> Scan:
    return _ranges(scan, lambda ranges: ranges.__setitem__(slice(first, last), value))


def _stamped(scan: Scan, odometry: Odometry, ahead: float | None) -> tuple[Scan, Odometry]:
    """Stamps that are so far ahead, s; None for none at all."""
    scan_stamp = 0 if ahead is None else scan.stamp + round(ahead * NANOSECONDS)
    odometry_stamp = 0 if ahead is None else odometry.stamp + round(ahead * NANOSECONDS)
    return replace(scan, stamp=scan_stamp), replace(odometry, stamp=odometry_stamp)


def _jittered(scan: Scan, k: int) -> Scan:
    shape = scan.geometry
    beams = shape.beams + (0, -1, 1, 0, -2)[k % 5]
    ranges = np.append(scan.ranges, scan.ranges[-1])[:beams]
    return Scan(scan.stamp, replace(shape, beams=beams), ranges)


def _mixed(scan: Scan) -> Scan:
    ranges = scan.ranges.copy()
    for first, value in ((0, -math.inf), (7, math.inf), (14, math.nan)):
        ranges[first::21] = value
    return replace(scan, ranges=ranges)


def _clockwise(scan: Scan) -> Scan:
    shape = scan.geometry
    turned = ScanGeometry(shape.beams, shape.angle_max, -shape.angle_increment, shape.range_min, shape.range_max)
    return Scan(scan.stamp, turned, scan.ranges[::-1].copy())


def _other_laser(scan: Scan) -> Scan:
    return Scan(scan.stamp, replace(scan.geometry, beams=500), scan.ranges[:500].copy())


ALL_ROUND = Laser(beams=360, angle_min=0.0, angle_max=6.26573, range_min=0.12, range_max=3.5)

HABITS = (
    Habit("the scans stop", lambda scan, odometry, k: (None, odometry), fault="laser_silent"),
    Habit("the odometry stops", lambda scan, odometry, k: (scan, None), fault="odometry_silent"),
    Habit("both stop", lambda scan, odometry, k: (None, None)),
    Habit("the scans stop for a second", lambda scan, odometry, k: (None if k < 10 else scan, odometry)),
    Habit("every other scan is lost", lambda scan, odometry, k: (scan if k % 2 else None, odometry)),
    Habit("odometry comes each half second", lambda scan, odometry, k: (scan, None if k % 5 else odometry)),
    Habit("the last scan again and again", lambda scan, odometry, k: (replace(scan, stamp=1_000_000_000), odometry)),
    Habit("all beams NaN", lambda scan, odometry, k: (_filled(scan, math.nan), odometry), fault="laser_blinded"),
    Habit("all beams 0", lambda scan, odometry, k: (_filled(scan, 0.0), odometry)),
    Habit("negative ranges", lambda scan, odometry, k: (_filled(scan, -1.0, last=5), odometry)),
    Habit("another laser's scans", lambda scan, odometry, k: (_other_laser(scan), odometry)),
    Habit("odometry NaN", lambda scan, odometry, k: (scan, replace(odometry, x=math.nan))),
    Habit("five beams -inf", lambda scan, odometry, k: (_filled(scan, -math.inf, last=5), odometry)),
    Habit("all beams +inf", lambda scan, odometry, k: (_filled(scan, math.inf), odometry)),
    Habit("-inf, +inf and NaN in a seventh of the beams", lambda scan, odometry, k: (_mixed(scan), odometry)),
    Habit("stamps 100 s back", lambda scan, odometry, k: _stamped(scan, odometry, -100.0)),
    Habit("stamps an hour ahead", lambda scan, odometry, k: _stamped(scan, odometry, 3600.0)),
    Habit("stamps anywhere within 50 s", lambda scan, odometry, k: _stamped(scan, odometry, 37.0 * k % 101.0 - 50.0)),
    Habit("all stamps 0", lambda scan, odometry, k: _stamped(scan, odometry, None), from_start=True),
    Habit("the number of beams varies", lambda scan, odometry, k: (_jittered(scan, k), odometry), from_start=True),
    Habit("clockwise", lambda scan, odometry, k: (_clockwise(scan), odometry), from_start=True),
    Habit("all round from 0", lambda scan, odometry, k: (scan, odometry), from_start=True, laser=ALL_ROUND),
    Habit(
        "odometry jumps 5 m",
        lambda scan, odometry, k: (scan, replace(odometry, x=odometry.x + 5.0)),
        fault="odometry_jump by=5,0,0",
    ),
)


@dataclass(frozen=True)
class Row:
    """The result for one robot.

    Attributes:
        habit: its name.
        robot: `bare`, `gate` or `simulated`.
        stood: from the last good datum to standstill, s; None where the robot drove on.
        rolled: how far it moved meanwhile, m.
        said: what was said of it.
        moves: whether it moves again at the end of the run.
    """

    habit: str
    robot: str
    stood: float | None
    rolled: float | None
    said: str
    moves: bool


class HandClock:
    """Time passes only while a thread waits; meanwhile the others work."""

    def __init__(self) -> None:
        self.time = 0.0
        self.others: list[Callable[[], object]] = []

    def now(self) -> float:
        """Seconds since the start."""
        return self.time

    def wait(self, seconds: float) -> None:
        """Let this much time pass."""
        end = self.time + seconds
        while self.time < end - 1e-9:
            self.time = min(end, self.time + 0.005)
            for work in self.others:
                work()
        self.time = end


class Driver:
    """A bare ROS 2 driver of a simulated robot, with a habit.

    Attributes:
        places: where the robot truly was, and when.
        good: when the last good scan and odometry were sent.
    """

    def __init__(self, network: MemoryNetwork, keys: RobotKeys, clock: HandClock, habit: Habit, profile: Profile):
        self.places: list[tuple[float, Pose]] = []
        self.good = 0.0
        self.onset = math.inf
        self._clock, self._habit, self._k = clock, habit, 0
        self._world = SimulatedWorld(long_corridor(), profile.robot.model_copy(update={"period": FINE}))
        self._twist = STOP
        self._steps = 0
        bus = network.bus()
        self._scan, self._odometry = bus.publisher(keys.scan), bus.publisher(keys.odometry)
        bus.subscribe(keys.command, lambda message: setattr(self, "_twist", decode_twist(message.payload)))

    def pump(self) -> None:
        """Move on, and publish, when it is time."""
        while self._clock.now() >= self._steps * FINE - 1e-9:
            observation = self._world.step(Command(self._twist))
            self.places.append((self._clock.now(), self._world.path[-1]))
            if self._steps % round(PUBLISHED / FINE) == 0:
                self._publish(observation)
            self._steps += 1

    def _publish(self, observation: Observation) -> None:
        scan: Scan | None
        odometry: Odometry | None
        scan, odometry = _stamped(observation.scan, observation.odometry, BEGIN)
        late = self._clock.now() >= self.onset
        if late or self._habit.from_start:
            scan, odometry = self._habit.change(scan, odometry, self._k)
            self._k += late
        if not late:
            self.good = self._clock.now()
        if scan is not None:
            self._scan.put(encode_scan(scan))
        if odometry is not None:
            self._odometry.put(encode_odometry(odometry))


def long_corridor() -> Maze:
    """A corridor, 1 m wide and too long to be driven through."""
    walls = [(-1.0, 0.5, 30.0, 0.5), (-1.0, -0.5, 30.0, -0.5), (-1.0, -0.5, -1.0, 0.5), (30.0, -0.5, 30.0, 0.5)]
    return Maze("corridor", np.array(walls), Start(Pose()))


def profile_of(habit: Habit) -> Profile:
    """The profile of a robot with a habit's laser."""
    profile = load_profile()
    return profile.model_copy(update={"robot": profile.robot.model_copy(update={"laser": habit.laser}), "link": BARE})


def driven(robot: Robot, profile: Profile) -> Iterator[Tick]:
    """The ticks of `right_hand` on a robot."""
    mission = prepare("right_hand", profile)
    perception, chain = Perception(profile.robot, profile.perception), MotionChain(profile.robot, profile.skills)
    return ticks(robot, mission.machine, mission.parameters, perception, chain, settings=profile.link)


def bare(habit: Habit) -> Row:
    """A driver without a gate: the controller's loop is all that watches its sensors."""
    clock, profile = HandClock(), profile_of(habit)
    network = MemoryNetwork(clock=clock)
    driver = Driver(network, RobotKeys(profile.robot.name, BARE), clock, habit, profile)
    clock.others = [driver.pump]
    said = ""
    try:
        robot = open_robot(network.bus(), profile.robot, BARE, clock=clock)
        driver.onset = clock.now() + ONSET
        for tick in driven(robot, profile):
            said = said or tick.blind
            if clock.now() >= driver.onset + LENGTH:
                break
        said = said or ", ".join(f"the robot's clock {fault}" for fault in robot.clock_faults)  # type: ignore[union-attr]
    except LinkError as error:
        said = f"{said}; {error}" if said else str(error)
    return row(habit, "bare", driver.good, driver.places, said)


def gated(habit: Habit) -> Row:
    """A driver behind a gate, whose controller commands full speed whatever it sees."""
    clock, profile = HandClock(), profile_of(habit)
    network = MemoryNetwork(clock=clock)
    inside = RobotKeys("base", BARE)
    driver = Driver(network, inside, clock, habit, profile)
    base = DriverBase(RosDriver(network.bus(), inside), profile.robot.laser, clock)
    gate = Gate(network.bus(), base, profile.robot, LinkSettings(), clock)
    reasons: list[str] = []
    clock.others = [driver.pump, gate.pump, lambda: reasons.append(gate.trust.reason)]
    clock.wait(0.5)
    robot = open_robot(network.bus(), profile.robot, LinkSettings(), clock=clock)
    driver.onset = clock.now() + ONSET
    try:
        while clock.now() < driver.onset + LENGTH:
            observation = robot.observe()
            command = STOP if observation.link.stopped else Twist(0.5)
            robot.command(Command(command, answers=observation.stamp))
    except LinkError:
        clock.wait(max(0.0, driver.onset + LENGTH - clock.now()))
    return row(habit, "gate", driver.good, driver.places, next(filter(None, reasons), ""))


def simulated(habit: Habit) -> Row:
    """The simulator in lockstep, with the habit as one of its faults."""
    profile = profile_of(habit)
    settings = simulator_settings(faults=[f"{habit.fault} at={ONSET}"])
    world = SimulatedWorld(long_corridor(), profile.robot, settings=settings)
    places, said = [], ""
    for tick in driven(LockstepRobot(world), profile):
        places.append((tick.time, world.pose(tick.index)))
        said = said or tick.blind
        if tick.time >= ONSET + LENGTH:
            break
    return row(habit, "simulated", ONSET - profile.robot.period, places, said)


def row(habit: Habit, robot: str, good: float, places: list[tuple[float, Pose]], said: str) -> Row:
    """The figures of a run from where the robot truly was."""
    after = [(time, pose) for time, pose in places if time >= good - 1e-9]
    steps = list(pairwise(after))
    still = (early for early, late in steps if math.dist(_point(early[1]), _point(late[1])) < STANDING)
    stood = next(still, None)
    (_, before), (_, last) = steps[-1]
    moves = math.dist(_point(before), _point(last)) >= STANDING
    if stood is None:
        return Row(habit.name, robot, None, None, said, moves)
    return Row(habit.name, robot, stood[0] - good, math.dist(_point(after[0][1]), _point(stood[1])), said, moves)


def _point(pose: Pose) -> tuple[float, float]:
    return pose.x, pose.y


def measured(habit: Habit) -> Iterator[Row]:
    """All rows of a habit."""
    yield bare(habit)
    yield gated(habit)
    if habit.fault:
        yield simulated(habit)


def main() -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("habits", nargs="*", help="their names; by default all")
    parser.add_argument("--json", action="store_true", help="one JSON object a line")
    arguments = parser.parse_args()
    if not arguments.json:
        print("| habit | robot | stops after | rolled | what is said | at the end |\n|---|---|---|---|---|---|")
    for habit in HABITS:
        if arguments.habits and habit.name not in arguments.habits:
            continue
        for one in measured(habit):
            if arguments.json:
                print(json.dumps(asdict(one)), flush=True)
                continue
            figures = "drives on | -" if one.stood is None else f"{one.stood:.2f} s | {one.rolled:.2f} m"
            end = "drives" if one.moves else "stopped"
            print(f"| {one.habit} | {one.robot} | {figures} | {one.said or '-'} | {end} |", flush=True)


if __name__ == "__main__":
    main()
