"""A seeded campaign of random faults: ``python benchmarks/faults.py [--seed N] [--scale N] [--out FILE]``.

Seven families, each with its promise, which is checked after every fault:

- in real time, behind the gate, on a clock turned by hand: the base moves only by whole answers of the lease's holder
  to fresh observations, and stops within the command time-out after the last one; after the fault it is driven again;
- in lockstep, over a bad network, with threads and real timers: the run is the undisturbed one, bit for bit;
- the recorder on a bad disk: the run continues, what the recording holds is as it was, what was there before is kept;
- a campaign with workers that are killed, stopped or cut off: its results file is the undisturbed one, byte for byte;
- the same on a dask cluster whose scheduler and workers are killed and come again;
- in lockstep through a router that is killed, stopped or started again: the run is the undisturbed one, or it ends with
  what it was until then;
- the command with room for a little more memory only, or for small files only: it ends with a documented status and one
  line, and a file that was there before is as it was or whole and new.

The scale multiplies the number of faults; 1 makes some 1,200. With ``--out`` each fault is a line of that file, and a
campaign that was interrupted continues where it was. The table is printed in any case, of all that was done. The exit
status is 1 if any promise was broken, and 3 if the campaign was interrupted.
"""

from __future__ import annotations

import argparse
import heapq
import json
import math
import multiprocessing
import os
import random
import signal
import sys
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).parents[1]
# Not this folder, whose scripts have the names of packages.
sys.path[0:1] = [str(ROOT), str(ROOT / "tests" / "transport")]
sys.path.append(str(ROOT / "benchmarks"))

from process_faults import campaign_faults, command_fault, router_faults, scheduler_faults  # noqa: E402
from toy_world import PERIOD, ToyWorld, answer_to, seen, wander  # noqa: E402

from transport.connect import open_robot  # noqa: E402
from transport.description import RobotDescription  # noqa: E402
from transport.gate import Gate, PacedWorld  # noqa: E402
from transport.lockstep import LockstepServer  # noqa: E402
from transport.memory_bus import MemoryBus, MemoryNetwork  # noqa: E402
from transport.messages import STOP, Command, Observation, Twist  # noqa: E402
from transport.realtime import RealtimeRobot  # noqa: E402
from transport.recording import Recorder, RecordingError, read_recording  # noqa: E402
from transport.robot import LinkError  # noqa: E402
from transport.settings import LinkSettings  # noqa: E402
from transport.world import LockstepRobot  # noqa: E402

Message = tuple[str, object]
Outcomes = Counter[tuple[str, str, str]]
"""How many faults had an outcome: by what they befell, what they were, and ``good`` or what was wrong."""

TOY = RobotDescription(name="toy")
LINK = LinkSettings()
STEP = 0.005
"""Of the hand-turned clock, s."""


# In real time


class Hand:
    """A clock that its waiters turn; meanwhile all actors act."""

    def __init__(self) -> None:
        self.time = 1000.0
        self.actors: list[Callable[[], object]] = []

    def now(self) -> float:
        """Seconds since some moment."""
        return self.time

    def wait(self, seconds: float) -> None:
        """Turn the clock on; all actors act meanwhile."""
        until = self.time + max(seconds, STEP)
        while self.time < until - 1e-9:
            self.time += STEP
            for act in tuple(self.actors):
                act()


class Network(MemoryNetwork):
    """A network that can be cut, slow, lossy, out of order or damaging."""

    def __init__(self, clock: Hand, chance: random.Random) -> None:
        super().__init__(clock=clock)
        self.fault = self._carry
        self.trouble = ""
        self._clock, self._chance = clock, chance
        self._late: list[tuple[float, int, str, object]] = []
        self._count = 0
        self._delivering = False
        clock.actors.append(self._deliver)

    def _carry(self, key: str, message: object) -> Iterable[object]:
        if self._delivering or not self.trouble:
            return (message,)
        match self.trouble:
            case "cut":
                return ()
            case "stall":
                return self._later(key, message, 0.8)
            case "drip":
                return (message,) if self._chance.random() < 0.15 else ()
            case "reorder":
                return self._later(key, message, self._chance.uniform(0.0, 0.3))
            case "double":
                return (message, message)
        payload = bytearray(message.payload)
        payload[self._chance.randrange(len(payload))] ^= 1 << self._chance.randrange(8)
        return (type(message)(bytes(payload), message.attachment),) if self._chance.random() < 0.5 else (message,)

    def _later(self, key: str, message: object, seconds: float) -> tuple[()]:
        self._count += 1
        heapq.heappush(self._late, (self._clock.now() + seconds, self._count, key, message))
        return ()

    def _deliver(self) -> None:
        while self._late and self._late[0][0] <= self._clock.now():
            _, _, key, message = heapq.heappop(self._late)
            self._delivering = True
            self.put(key, message)
            self._delivering = False


class WatchedBase(PacedWorld):
    """A base that notes what it gets, and when."""

    def __init__(self, clock: Hand, told: list[tuple[float, Twist]]) -> None:
        super().__init__(lambda seed: ToyWorld(seed, 10**9), PERIOD, clock)
        self._clock, self._told = clock, told
        self.jump = 100 * 10**9
        """By how much the robot's clock is ahead of the simulation's, ns."""

    def sense(self) -> Observation | None:
        """What the robot senses, by its own clock."""
        observation = super().sense()
        if observation is None:
            return observation
        scan, odometry = observation.scan, observation.odometry
        return replace(
            observation,
            stamp=observation.stamp + self.jump,
            scan=replace(scan, stamp=scan.stamp + self.jump),
            odometry=replace(odometry, stamp=odometry.stamp + self.jump),
        )

    def move(self, twist: Twist) -> None:
        """Take note of what the base gets."""
        super().move(twist)
        self._told.append((self._clock.now(), twist))


class Scene:
    """A controller and a robot's side on a hand-turned clock, both of which may die and come again."""

    def __init__(self, seed: int) -> None:
        self.clock, self.chance = Hand(), random.Random(seed)
        self.network = Network(self.clock, self.chance)
        self.told: list[tuple[float, Twist]] = []
        self.sent: list[tuple[float, Twist]] = []
        self.gate: Gate | None = None
        self.frozen = False
        self.clock.actors.append(self._pump)
        self.serve()
        self.robot = self.take()

    def _pump(self) -> None:
        if self.gate is not None and not self.frozen:
            self.gate.pump()

    def serve(self) -> None:
        """Start the robot's side."""
        self.bus = self.network.bus()
        self.base = WatchedBase(self.clock, self.told)
        self.gate = Gate(self.bus, self.base, TOY, LINK, self.clock)

    def kill_gate(self) -> None:
        """End the robot's side without a word."""
        self.gate = None
        self.bus.close()
        self.stand()

    def stand(self) -> None:
        """Note that the base stops by itself: a driver has its own time-out, a frozen simulation is frozen."""
        self.told.append((self.clock.now(), STOP))

    def take(self) -> RealtimeRobot:
        """Take the robot."""
        robot = open_robot(self.network.bus(), TOY, LINK, seed=1, clock=self.clock)
        assert isinstance(robot, RealtimeRobot)
        return robot

    def drive(self, seconds: float) -> bool:
        """Drive for this long; whether the base moved by it."""
        until, before = self.clock.now() + seconds, len(self.told)
        while self.clock.now() < until:
            observation = self.robot.observe()
            stale = max(observation.link.scan_age, observation.link.odometry_age) > LINK.stale
            twist = STOP if stale or observation.link.stopped else answer_to(observation.stamp)
            self.sent.append((self.clock.now(), twist))
            self.robot.command(Command(twist, answers=observation.stamp))
        return any(twist != STOP for _, twist in self.told[before:])

    def wrong(self, since: float) -> str:
        """What the base did that it must not, or nothing."""
        sent = [(at, twist) for at, twist in self.sent if at >= since - 1.0]
        moving: Twist | None = None
        for at, twist in [*self.told, (self.clock.now(), STOP)]:
            if moving is not None and at >= since:
                if moving not in [one for _, one in sent]:
                    return "moved by what nobody sent"
                last = max((when for when, one in sent if when <= at and one != STOP), default=-math.inf)
                if at - last > LINK.dead_man + LINK.answer_age + 2 * STEP:
                    return "moved on for too long"
            moving = None if twist == STOP else twist
        return ""


NETWORK = ("cut", "stall", "drip", "reorder", "double", "corrupt")


def realtime_fault(seed: int) -> tuple[str, str, str]:
    """One fault of a scene of its own: what it befell, what it was, and what came of it."""
    scene = Scene(seed)
    chance, clock = scene.chance, scene.clock
    scene.drive(chance.uniform(0.5, 1.2))
    since, length = clock.now(), chance.uniform(0.1, 2.5)
    where, kind = chance.choice(
        [("network", one) for one in NETWORK]
        + [("controller", one) for one in ("kill", "stop", "hang")]
        + [("robot's side", one) for one in ("kill", "stop", "restart", "clock")]
    )
    try:
        match where, kind:
            case "network", _:
                scene.network.trouble = kind
                scene.drive(length)
                scene.network.trouble = ""
            case "controller", "kill":
                clock.wait(length)
                scene.robot = scene.take()
            case "robot's side", "clock":
                scene.base.jump += round(chance.uniform(-4.0, 4.0) * 1e9)
                scene.drive(length)
            case "controller", _:
                clock.wait(length)
            case "robot's side", "stop":
                scene.frozen = True
                scene.stand()
                scene.drive(min(length, 2.0))
                scene.frozen = False
            case _:
                scene.kill_gate()
                if kind == "kill":
                    clock.wait(min(length, 2.0))
                scene.serve()
                scene.drive(0.5)
        again = scene.drive(3.0) or scene.drive(LINK.silence + 1.0)
    except LinkError:
        # A real-time simulator that was started again has lost its episode: the run ends, and another can begin.
        scene.network.trouble, scene.frozen = "", False
        scene.robot.close()
        clock.wait(1.5)
        scene.robot = scene.take()
        again = scene.drive(1.5)
    fault = scene.wrong(since)
    return where, kind, fault or ("good" if again else "not driven again")


# In lockstep

LENGTH = 30


def lockstep_fault(seed: int) -> tuple[str, str, str]:
    """One run over a bad network, or with a controller or a simulator that comes and goes."""
    chance = random.Random(seed)
    kind = chance.choice(["lose", "double", "reorder", "corrupt", "stall", "restart", "kill"])
    network = MemoryNetwork()
    with serving(network.bus()) as stop:
        robot = open_robot(network.bus(), TOY, LinkSettings(step=30.0), seed=seed)
        at = chance.randrange(5, LENGTH - 5)
        held: list[tuple[str, object]] = []

        def fault(key: str, message: object) -> Iterable[object]:
            if chance.random() > 0.2:
                return (message,)
            if kind == "lose":
                return ()
            if kind == "double":
                return (message,) * 3
            if kind == "reorder":
                held.append((key, message))
                return [one for where, one in held[-3:-1] if where == key]
            payload = bytearray(message.payload)
            payload[chance.randrange(len(payload))] ^= 1 << chance.randrange(8)
            return (type(message)(bytes(payload), message.attachment),)

        if kind in ("lose", "double", "reorder", "corrupt"):
            network.fault = fault
        rows, expected = [], undisturbed(seed)
        try:
            for index in range(LENGTH):
                if index == at and kind == "stall":
                    time.sleep(chance.uniform(0.01, 0.3))
                if index == at and kind == "kill":
                    robot = open_robot(network.bus(), TOY, LinkSettings(connect=10.0), seed=seed)
                    rows.clear()
                    at = -1
                    for _ in range(LENGTH):
                        rows.append(turn(robot))
                    break
                if index == at and kind == "restart":
                    stop()
                rows.append(turn(robot))
        except LinkError:
            return "simulator", kind, "good" if kind == "restart" and rows == expected[: len(rows)] else "given up"
        finally:
            network.fault = lambda _key, message: (message,)
            robot.close()
    where = {"restart": "simulator", "kill": "controller"}.get(kind, "network")
    if kind == "restart":
        return where, kind, "continued with a simulator that was gone"
    return where, f"{kind} (lockstep)", "good" if rows == expected else "another run"


@contextmanager
def serving(bus: MemoryBus) -> Iterator[Callable[[], None]]:
    """A simulator in a thread; what is yielded ends it permanently."""
    ended = threading.Event()
    server = LockstepServer(bus, "toy", PERIOD, lambda seed: ToyWorld(seed, 1000), patience=0.3)
    thread = threading.Thread(target=lambda: deque(server.episodes(ended.is_set, heartbeat=0.01), maxlen=0))
    thread.start()

    def stop() -> None:
        ended.set()
        thread.join(30)
        bus.close()

    try:
        yield stop
    finally:
        stop()


def turn(robot: object) -> object:
    """One step of a run, as a value that holds every bit of it."""
    observation = robot.observe()
    command = wander(observation)
    robot.command(command)
    return seen(observation), command


def undisturbed(seed: int) -> list[object]:
    robot = LockstepRobot(ToyWorld(seed, 1000))
    return [turn(robot) for _ in range(LENGTH)]


# The recorder


class BadDisk:
    """A file on a disk that is slow, or full after this many bytes."""

    def __init__(self, file: object, room: float, delay: float) -> None:
        self._file, self._room, self._delay = file, room, delay

    def __getattr__(self, name: str) -> object:
        return getattr(self._file, name)

    def __enter__(self) -> BadDisk:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def write(self, content: bytes) -> int:
        """Write as slowly as the disk is, and as much as there is room for."""
        time.sleep(self._delay)
        if len(content) > self._room:
            self._file.write(content[: int(self._room)])
            self._room = 0
            raise OSError(28, "No space left on device")
        self._room -= len(content)
        return self._file.write(content)


def recorder_fault(seed: int, folder: Path) -> tuple[str, str, str]:
    """One recording on a bad disk."""
    chance = random.Random(seed)
    kind, there = chance.choice(["disk full", "slow disk", "kill"]), chance.random() < 0.5
    path = folder / f"{seed}.mcap"
    if there:
        path.write_bytes(b"before")
    world = LockstepRobot(ToyWorld(seed, 1000))
    rows = [(world.observe(), world.command(wander(world.observe())))[0] for _ in range(120)]
    if kind == "kill":
        process = multiprocessing.get_context("fork").Process(target=killed, args=(path, rows, chance.randrange(120)))
        process.start()
        process.join()
    else:
        recorder = Recorder(path, "toy", patience=10.0)
        recorder._stream.file = BadDisk(
            recorder._stream.file,
            chance.uniform(0, 300_000) if kind == "disk full" else math.inf,
            chance.uniform(0, 0.002) if kind == "slow disk" else 0.0,
        )
        for observation in rows:
            recorder.record(observation, Command())
        try:
            recorder.close()
        except RecordingError as error:
            if kind == "slow disk" or "No space left on device" not in str(error):
                return "recorder", kind, "the wrong cause"
    if there and kind != "slow disk" and path.read_bytes()[:6] != b"before" and kind == "kill":
        return "recorder", kind, "what was there is lost"
    found = next((one for one in (path.with_name(path.name + ".part"), path) if one.exists()), path)
    if found.read_bytes()[:6] == b"before":
        return "recorder", kind, "good"
    try:
        ticks = read_recording(found).ticks
    except RecordingError as error:
        return "recorder", kind, "good" if kind != "slow disk" else f"unreadable: {error}"
    whole = all(seen(tick.observation) == seen(row) for tick, row in zip(ticks, rows, strict=False))
    return "recorder", kind, "good" if whole and (kind != "slow disk" or len(ticks) == 120) else "another recording"


def killed(path: Path, rows: list[object], after: int) -> None:
    """Record, and die while it is done."""
    recorder = Recorder(path, "toy", patience=10.0)
    for observation in rows[:after]:
        recorder.record(observation, Command())
    os.kill(os.getpid(), signal.SIGKILL)


def table(found: Outcomes) -> str:
    """The outcomes as Markdown."""
    rows: dict[tuple[str, str], Counter[str]] = {}
    for (where, kind, outcome), count in found.items():
        rows.setdefault((where, kind), Counter())[outcome] += count
    lines = ["| where | fault | how many | promise kept |", "|---|---|---|---|"]
    for (where, kind), outcomes in sorted(rows.items()):
        bad = "; ".join(f"{count} {outcome}" for outcome, count in outcomes.items() if outcome != "good")
        lines.append(f"| {where} | {kind} | {outcomes.total()} | {bad or 'always'} |")
    return "\n".join([*lines, "", f"{sum(found.values())} faults"])


Family = Callable[[int], Outcomes]
"""The outcomes for a seed."""


@dataclass
class Done:
    """What was done: the outcomes by family and seed, kept in a file where one is named."""

    path: Path | None
    outcomes: dict[tuple[str, int], Outcomes] = field(default_factory=dict)

    def read(self) -> None:
        """Take in what an interrupted campaign has left; a line that it was writing is done again."""
        if self.path is None or not self.path.exists():
            return
        for line in self.path.read_text(encoding="utf-8").splitlines():
            try:
                family, seed, found = json.loads(line)
            except ValueError:
                continue
            self.outcomes[family, seed] = Counter({(where, kind, outcome): n for where, kind, outcome, n in found})

    def add(self, family: str, seed: int, found: Outcomes) -> None:
        """Note the outcomes of a seed."""
        self.outcomes[family, seed] = found
        if self.path is not None:
            with self.path.open("a", encoding="utf-8") as file:
                file.write(json.dumps([family, seed, [[*key, count] for key, count in found.items()]]) + "\n")

    def total(self) -> Outcomes:
        """All outcomes."""
        return sum(self.outcomes.values(), Counter())


def one(fault: Callable[..., tuple[str, str, str]], *more: object) -> Family:
    """A family of faults that are made one at a time."""
    return lambda seed: Counter([fault(seed, *more)])


def families(scale: float, folder: Path) -> Iterator[tuple[str, int, Family]]:
    """Each family: its name, how many seeds, and what makes the faults of a seed."""

    def count(faults: int) -> int:
        return round(faults * scale)

    yield "real time", count(1000), one(realtime_fault)
    yield "lockstep", count(60), one(lockstep_fault)
    yield "recorder", count(100), one(recorder_fault, folder)
    yield "campaign", min(1, count(20)), lambda seed: campaign_faults(seed, count(20), folder)
    yield "command", count(12), one(command_fault, folder)
    yield "router", count(6), lambda seed: router_faults(seed, 1)
    yield "cluster", min(1, count(4)), lambda seed: scheduler_faults(seed, count(4), folder)


def make(done: Done, first: int, scale: float) -> None:
    """Make all faults that are not done yet."""
    with TemporaryDirectory() as folder:
        for name, count, faults in families(scale, Path(folder)):
            for seed in range(first, first + count):
                if (name, seed) not in done.outcomes:
                    done.add(name, seed, faults(seed))


def interrupt(*_: object) -> None:
    """End the campaign as Ctrl-C does."""
    raise KeyboardInterrupt


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1, help="what all that is random is drawn from")
    parser.add_argument("--scale", type=float, default=1.0, help="multiplies the number of faults")
    parser.add_argument("--out", type=Path, help="where each fault is noted, and what was done is not done again")
    asked = parser.parse_args()
    signal.signal(signal.SIGTERM, interrupt)
    done, status = Done(asked.out), 0
    done.read()
    try:
        make(done, 1_000_000 * asked.seed, asked.scale)
    except KeyboardInterrupt:
        status = 3
    found = done.total()
    print(table(found))
    return 1 if any(outcome != "good" for _, _, outcome in found) else status


if __name__ == "__main__":
    sys.exit(main())
