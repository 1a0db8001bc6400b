"""A world small enough to reason about, and a program that shows it: ``toy_world.py ENDPOINT MODE [identity=...]``.

MODE is ``lockstep`` or ``realtime``, with ``@router`` behind it to dial a router instead of listening, or ``bare``:
a ROS 2 driver named ``base`` that obeys whoever speaks, or ``guarded``: the same with a command time-out of its own.
The identity is a certificate, as ``FOLDER/NAME``.
"""

from __future__ import annotations

import hashlib
import math
import signal
import sys
import time
from pathlib import Path

import numpy as np

from transport.bus import Bus, Mailbox, Message
from transport.clock import MonotonicClock, Pace
from transport.codec import decode_twist, encode_odometry, encode_scan
from transport.connect import dialling, listening
from transport.description import Laser, RobotDescription
from transport.gate import Gate, PacedWorld
from transport.keys import RobotKeys
from transport.lockstep import LockstepServer
from transport.messages import STOP, Command, DoorReply, Observation, Odometry, Pose, Scan, Twist
from transport.security import Identity
from transport.session import Open
from transport.settings import LinkSettings
from transport.world import LockstepRobot

GEOMETRY = Laser().geometry()
PERIOD = 0.1
TIMEOUTS = {"bare": math.inf, "guarded": 0.3}


class ToyWorld:
    """A robot on a plane with noise in its eyes; every command changes everything that follows."""

    def __init__(self, seed: int | None, length: int = 50) -> None:
        self.seed = 0 if seed is None else seed
        self.commands: list[Command] = []
        self._random = np.random.default_rng(self.seed)
        self._length = length
        self._pose = Pose()
        self._observation = self._sense(None, Twist())

    @property
    def observation(self) -> Observation:
        return self._observation

    @property
    def finished(self) -> bool:
        return len(self.commands) >= self._length

    def step(self, command: Command) -> Observation:
        self.commands.append(command)
        twist, pose = command.twist, self._pose
        heading = pose.heading + PERIOD * twist.turn
        self._pose = Pose(
            pose.x + PERIOD * (twist.forward * math.cos(heading) - twist.left * math.sin(heading)),
            pose.y + PERIOD * (twist.forward * math.sin(heading) + twist.left * math.cos(heading)),
            heading,
        )
        door = DoorReply(twist.speed == 0, "" if twist.speed == 0 else "the robot moves") if command.ring else None
        self._observation = self._sense(door, twist)
        return self._observation

    def report(self) -> dict[str, object]:
        return {"seed": self.seed, "steps": len(self.commands), "rings": sum(c.ring for c in self.commands)}

    def _sense(self, door: DoorReply | None, twist: Twist) -> Observation:
        stamp = 100_000_000 * (len(self.commands) + 1)
        ranges = (2 + math.sin(self._pose.x) + self._random.uniform(-0.01, 0.01, GEOMETRY.beams)).astype(np.float32)
        return Observation(stamp, Scan(stamp, GEOMETRY, ranges), Odometry.at(stamp, self._pose, twist), door)


def seen(observation: Observation) -> tuple[object, ...]:
    """All bits of an observation, for comparison."""
    scan, odometry = observation.scan, observation.odometry
    return (observation.stamp, scan.stamp, scan.geometry, scan.ranges.tobytes(), odometry, observation.door)


def wander(observation: Observation) -> Command:
    """A controller that depends on every bit that it sees."""
    nearest = float(observation.scan.ranges.min())
    return Command(
        Twist(nearest % 0.3, observation.odometry.x % 0.1, math.sin(1e6 * nearest)),
        ring=int(1e4 * nearest) % 7 == 0,
        answers=observation.stamp,
    )


def undisturbed(seed: int, steps: int) -> str:
    """What the toy controller prints at the end of a run in lockstep."""
    robot, digest = LockstepRobot(ToyWorld(seed, 1000)), hashlib.sha256()
    for _ in range(steps):
        observation = robot.observe()
        digest.update(repr((seen(observation), wander(observation))).encode())
        robot.command(wander(observation))
    return f"{digest.hexdigest()} {steps}"


def answer_to(stamp: int) -> Twist:
    """What the toy is told in real time: faster with each observation, so that one can tell which it answers."""
    return Twist(1e-12 * stamp, 0.0, 0.0)


def are_answers(twists: list[tuple[float, float, float]]) -> bool:
    """Whether all these are answers to observations of the toy, whole, and none comes after that to a later one."""
    stamps = [round(1e3 * PERIOD * round(1e4 * twist[0])) * 1_000_000 for twist in twists]
    return twists == [(answer_to(stamp).forward, 0.0, 0.0) for stamp in stamps] and stamps == sorted(stamps)


def identity() -> Identity | None:
    """The certificate that this program was started with."""
    given = [argument for argument in sys.argv if argument.startswith("identity=")]
    return Identity.at(Path(given[0].removeprefix("identity="))) if given else None


class ToldBase(PacedWorld):
    """A paced world that says with each thing it is told when, on the monotonic clock, whether to move, and how."""

    def move(self, twist: Twist) -> None:
        super().move(twist)
        print(time.monotonic(), int(twist != STOP), twist.forward, twist.left, twist.turn, flush=True)


def drive_bare(bus: Bus, timeout: float) -> None:
    """Publish what is sensed and do what is said, ten times a second; stand when nothing was said for too long."""
    keys = RobotKeys("base", LinkSettings(gate=False))
    told: Mailbox[Message] = Mailbox()
    bus.subscribe(keys.command, told.put)
    odometry, scan = bus.publisher(keys.odometry), bus.publisher(keys.scan)
    base, pace = ToldBase(lambda seed: ToyWorld(seed, 10**6), PERIOD), Pace(PERIOD, MonotonicClock())
    base.begin(Open(request="", controller=""))
    heard = time.monotonic()
    while True:
        if (message := told.take(max(0.001, pace.due()))) is not None:
            heard = time.monotonic()
            base.move(decode_twist(message.payload))
        elif time.monotonic() - heard > timeout:
            base.move(STOP)
        if pace.due() <= 0:
            pace.beat()
            if (observation := base.sense()) is not None:
                odometry.put(encode_odometry(observation.odometry))
                scan.put(encode_scan(observation.scan))


def main() -> None:
    """Show the toy; the first line says when it can be reached."""
    endpoint, mode = sys.argv[1:3]
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    known = identity()
    security = None if known is None else known.listening()
    with (dialling if mode.endswith("@router") else listening)(endpoint, security=security) as bus:
        if mode in TIMEOUTS:
            print("ready", flush=True)
            drive_bare(bus, TIMEOUTS[mode])
        if mode.startswith("lockstep"):
            server = LockstepServer(bus, "toy", PERIOD, lambda seed: ToyWorld(seed, 1000), patience=0.5)
        else:
            base = ToldBase(lambda seed: ToyWorld(seed, 10**6), PERIOD)
            server = Gate(bus, base, RobotDescription(name="toy"), LinkSettings())
        print("ready", flush=True)
        for report in server.episodes():
            print(report, flush=True)


if __name__ == "__main__":
    main()
