"""The cost of the link, and its failures: ``python benchmarks/link.py [--rounds N] [--faults N]``.

The first table compares a tick of the pledge machine with the real simulator in one process, over the loopback, and
with a bare Zenoh ping-pong of the same messages in the link's place: tick by tick in turn, so that what else the
computer does meets all three. The second breaks things at random moments and measures how long the robot moves on, and
how long it takes until it moves again. The third measures the cost of readers that cannot keep up.
"""

from __future__ import annotations

import argparse
import itertools
import json
import multiprocessing
import queue
import random
import signal
import socket
import statistics
import sys
import time
from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).parents[1]
# Not this folder, whose scripts have the names of packages.
sys.path[0:1] = [str(ROOT), str(ROOT / "tests" / "transport")]

import zenoh  # noqa: E402
from programs import Program, base, command, told, toy  # noqa: E402
from toy_controller import HANG  # noqa: E402
from toy_world import are_answers, undisturbed  # noqa: E402

from maze_machine.catalogue.profile import load_profile  # noqa: E402
from maze_machine.drive.loop import ticks  # noqa: E402
from maze_machine.drive.mission import Mission, prepare  # noqa: E402
from maze_machine.simulated.world import SimulatedWorld, find_maze  # noqa: E402
from perception import Perception  # noqa: E402
from skills.chain import MotionChain  # noqa: E402
from transport.connect import connect_robot  # noqa: E402
from transport.messages import Command, Observation  # noqa: E402
from transport.robot import Robot  # noqa: E402
from transport.security import Access, make_certificates  # noqa: E402
from transport.world import LockstepRobot  # noqa: E402

SCAN, ODOMETRY, TWIST = 4060, 724, 52
OBSERVATION_TAG, COMMAND_TAG = 48, 40
PING, STEP = bytes(TWIST), b"\1" + bytes(TWIST - 1)
MAZE, SEED = "final_2015", 1
STEPS, ENDLESS = 600, 10**6
TICKS, WARM = 30, 100
"""Ticks a round, short enough that a busy moment of the computer affects one round only; ticks that do not count."""


def free_endpoint() -> str:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        return f"tcp/127.0.0.1:{taken.getsockname()[1]}"


# What a tick costs


def bare_session(listen: str = "", connect: str = "") -> zenoh.Session:
    config = zenoh.Config()
    for path, value in {
        "mode": "peer" if listen else "client",
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "transport/shared_memory/enabled": False,
        "listen/endpoints": [listen] if listen else [],
        "connect/endpoints": [connect] if connect else [],
    }.items():
        config.insert_json5(path, json.dumps(value))
    return zenoh.open(config)


def pong(endpoint: str, ready: Connection, commands: list[Command]) -> None:
    """Answer pings; those that ask for it after a step of the simulator, under commands that were recorded."""
    robot = load_profile().robot
    world, recorded = SimulatedWorld(find_maze(MAZE, robot=robot), robot, SEED), iter(commands)
    with bare_session(listen=endpoint) as session:
        asked: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        subscriber = session.declare_subscriber("bare/ping", lambda sample: asked.put(sample.payload.to_bytes()))
        odometry, scan = session.declare_publisher("bare/odom"), session.declare_publisher("bare/scan", express=True)
        ready.send(1)
        while ping := asked.get(timeout=60):
            if ping == STEP:
                world.step(next(recorded))
            odometry.put(bytes(ODOMETRY), attachment=bytes(OBSERVATION_TAG))
            scan.put(bytes(SCAN), attachment=bytes(OBSERVATION_TAG))
        del subscriber


class PingPong:
    """The same bytes as a tick, with nothing done to them."""

    def __init__(self, commands: list[Command]) -> None:
        endpoint = free_endpoint()
        here, there = multiprocessing.Pipe()
        spawn = multiprocessing.get_context("spawn")
        self.process = spawn.Process(target=pong, args=(endpoint, there, commands), daemon=True)
        self.process.start()
        here.recv()
        self.session = bare_session(connect=endpoint)
        self.answers: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        self.subscribers = [
            self.session.declare_subscriber(key, lambda sample: self.answers.put(sample.payload.to_bytes()))
            for key in ("bare/odom", "bare/scan")
        ]
        self.publisher = self.session.declare_publisher("bare/ping", express=True)
        while not self.publisher.matching_status.matching:
            pass

    def once(self, ping: bytes = PING) -> None:
        """There and back."""
        self.publisher.put(ping, attachment=bytes(COMMAND_TAG))
        self.answers.get(timeout=10)
        self.answers.get(timeout=10)

    def close(self) -> None:
        """Let the other side go."""
        self.publisher.put(b"")
        self.process.join(10)
        self.session.close()


class BareRobot:
    """A robot behind bare Zenoh: a simulator steps over there, but what comes back is known here already."""

    def __init__(self, bare: PingPong, observations: list[Observation]) -> None:
        self._bare, self._observations, self._next = bare, observations, 0

    def observe(self) -> Observation:
        """What is known."""
        return self._observations[self._next]

    def command(self, _command: Command) -> None:
        """Have the simulator over there step."""
        self._bare.once(STEP)
        self._next += 1

    def close(self) -> None:
        """Nothing to release."""


class Lane:
    """One way of driving, tick by tick: a step of it ends when the observation after its command is there."""

    def __init__(self, mission: Mission, robot: Robot) -> None:
        profile = mission.profile
        self.robot = robot
        perception, chain = Perception(profile.robot, profile.perception), MotionChain(profile.robot, profile.skills)
        self.ticks = ticks(robot, mission.machine, mission.parameters, perception, chain)

    def step(self) -> None:
        """One tick."""
        next(self.ticks)
        self.robot.observe()


def costs(rounds: int) -> None:
    """Print what a tick costs in one process, over the link, and over bare Zenoh."""
    profile, endpoint = load_profile(), free_endpoint()
    maze = find_maze(MAZE, robot=profile.robot)
    mission = prepare("pledge", profile)
    run = list(Lane(mission, LockstepRobot(SimulatedWorld(maze, profile.robot, SEED))).ticks)
    rounds = min(rounds, (len(run) - WARM) // TICKS - 1)
    bare = PingPong([tick.command for tick in run])
    flat: list[float] = []
    with command("sim", MAZE, "--listen", endpoint) as simulator:
        simulator.line()
        robots: dict[str, Robot] = {
            "in one process": LockstepRobot(SimulatedWorld(maze, profile.robot, SEED)),
            "over the link": connect_robot(endpoint, profile.robot, profile.link, seed=SEED),
            "over bare Zenoh": BareRobot(bare, [tick.observation for tick in run]),
        }
        steps = {name: Lane(mission, robot).step for name, robot in robots.items()}
        took: dict[str, list[float]] = {name: [] for name in robots}
        for step in [*steps.values()] * WARM:
            step()
        # Which of the three comes after which matters to the processor's caches, so they take turns in that too.
        orders = list(itertools.permutations(steps))
        for index in range(rounds * TICKS):
            for name in orders[index % len(orders)]:
                took[name].append(timed(steps[name]))
            if index % TICKS == TICKS - 1:
                flat += [timed(bare.once) for _ in range(TICKS)]
        robots["over the link"].close()
    bare.close()
    print(f"A tick of pledge in {MAZE}, {rounds} rounds of {TICKS} ticks in turn; ms, median and the fastest round\n")
    print("| | a tick | ticks a second |\n|---|---|---|")
    for name, times in (took | {"bare ping-pong, one after the other": flat}).items():
        middle, least = statistics.median(times), min(in_rounds(times))
        print(f"| {name} | {1e3 * middle:.3f}, {1e3 * least:.3f} | {1 / middle:.0f}, {1 / least:.0f} |")
    here, there, zenoh_only = took.values()
    added, ping = in_rounds(beyond(there, here)), in_rounds(beyond(zenoh_only, here))
    print("\nWhat the link adds to a tick, median and quartiles of the rounds:")
    print(f"- {ratios(added, ping)} times what a bare ping-pong adds to it (at most 1.5 wanted)")
    print(
        f"- {ratios(added, in_rounds(flat))} bare ping-pongs, one after the other with nothing in between\n", flush=True
    )


def beyond(times: list[float], least: list[float]) -> list[float]:
    return [a - b for a, b in zip(times, least, strict=True)]


def ratios(over: list[float], under: list[float]) -> str:
    low, middle, high = statistics.quantiles([a / b for a, b in zip(over, under, strict=True)])
    return f"{middle:.2f} ({low:.2f} to {high:.2f})"


def timed(step: Callable[[], object]) -> float:
    began = time.perf_counter()
    step()
    return time.perf_counter() - began


def in_rounds(times: list[float]) -> list[float]:
    """The median of each round: what disturbs a tick now and then does not show."""
    return [statistics.median(times[first : first + TICKS]) for first in range(0, len(times), TICKS)]


# What a fault costs


@dataclass(frozen=True)
class Figures:
    """The result of one fault: the time until the robot stopped, and until it continued or a message appeared, s."""

    stopped: float | None
    resumed: float


class Bench(ExitStack):
    """The programs of one scenario; all end with it."""

    def __init__(self, chance: random.Random) -> None:
        super().__init__()
        self.chance = chance
        self.endpoint, self.inside = free_endpoint(), free_endpoint()

    def ready(self, program: AbstractContextManager[Program]) -> Program:
        """A program that has said that it is ready."""
        started = self.enter_context(program)
        started.line()
        return started

    def router(self) -> Program:
        """The meeting point."""
        return self.ready(command("router", "--listen", self.endpoint))

    def gate(self) -> Program:
        """One that listens to controllers, in front of a driver inside."""
        return self.ready(command("gate", self.inside, "--listen", self.endpoint, "--set", "robot.name=toy"))

    def robot(self, mode: str, *more: str, inside: bool = False) -> Program:
        """The toy, where controllers dial it or inside."""
        return self.ready(toy("toy_world", self.inside if inside else self.endpoint, mode, *more))

    def controller(self, *more: str) -> Program:
        """One that drives in real time; it may not have begun yet."""
        return self.enter_context(toy("toy_controller", self.endpoint, "1", *more))

    def stepping(self, steps: int = STEPS) -> Program:
        """One that drives in lockstep, and has begun."""
        controller = self.controller(str(steps))
        controller.until("driving")
        return controller

    def wait(self, most: float) -> None:
        """The moment of a fault is random, and so is how long it lasts."""
        time.sleep(self.chance.uniform(0.0, most))

    def heal(self, failing: Program, number: signal.Signals, again: Callable[[], object]) -> float:
        """Continue or restart what failed; since when it is there again."""
        if number == signal.SIGSTOP:
            self.wait(0.5)
            return failing.send(signal.SIGCONT)
        failing.end()
        again()
        return time.monotonic()


Scenario = Callable[[Bench], Figures]


def broken(
    robot: Program, failing: Program, number: signal.Signals, again: Callable[[], object], bench: Bench
) -> Figures:
    """In real time: a program fails, the robot stops; the program is back, the robot moves."""
    base(robot, moving=True)
    bench.wait(0.6)
    failed = failing.send(number)
    stopped = base(robot, moving=False, after=failed)
    # A hanging program comes back by itself.
    remedy = failed + HANG if number == signal.SIGUSR1 else bench.heal(failing, number, again)
    return Figures(stopped - failed, base(robot, moving=True, after=stopped) - remedy)


def broken_controller(number: signal.Signals) -> Scenario:
    def scenario(bench: Bench) -> Figures:
        robot = bench.robot("realtime")
        return broken(robot, bench.controller(), number, bench.controller, bench)

    return scenario


def broken_router(number: signal.Signals) -> Scenario:
    def scenario(bench: Bench) -> Figures:
        router, robot = bench.router(), bench.robot("realtime@router")
        bench.controller()
        return broken(robot, router, number, bench.router, bench)

    return scenario


def broken_gate(number: signal.Signals) -> Scenario:
    """The driver behind the gate stops by itself."""

    def scenario(bench: Bench) -> Figures:
        driver, gate = bench.robot("guarded", inside=True), bench.gate()
        bench.controller()
        return broken(driver, gate, number, bench.gate, bench)

    return scenario


def frozen_robot(bench: Bench) -> Figures:
    """In real time: until the controller of a robot whose side is frozen sees that its data are stale."""
    robot, controller = bench.robot("realtime"), bench.controller()
    base(robot, moving=True)
    bench.wait(0.6)
    failed = robot.send(signal.SIGSTOP)
    controller.until("stale")
    return Figures(None, time.monotonic() - failed)


def same_end(which: str, number: signal.Signals) -> Scenario:
    """In lockstep: a program fails; until the run ends like an undisturbed one."""

    def scenario(bench: Bench) -> Figures:
        router = bench.router() if which == "router" else None
        simulator = bench.robot("lockstep@router" if router else "lockstep")
        controller = bench.stepping()
        failing = {"router": router, "simulator": simulator, "controller": controller}[which]
        bench.wait(0.1)
        failing.send(number)
        remedy = bench.heal(failing, number, bench.router)
        assert controller.line() == undisturbed(1, STEPS)
        return Figures(None, time.monotonic() - remedy)

    return scenario


def killed_simulator(bench: Bench) -> Figures:
    """In lockstep: until a controller knows that the simulator was started again, and its run is lost."""
    simulator, controller = bench.robot("lockstep"), bench.stepping(ENDLESS)
    bench.wait(0.3)
    simulator.send(signal.SIGKILL)
    remedy = bench.heal(simulator, signal.SIGKILL, lambda: bench.robot("lockstep"))
    assert controller.end() == 1
    return Figures(None, time.monotonic() - remedy)


def killed_controller(bench: Bench) -> Figures:
    """In lockstep: until another controller has begun, its start included."""
    bench.robot("lockstep")
    controller = bench.stepping(ENDLESS)
    bench.wait(0.3)
    controller.send(signal.SIGKILL)
    began = time.monotonic()
    heir = bench.stepping()
    resumed = time.monotonic() - began
    assert heir.line() == undisturbed(1, STEPS)
    return Figures(None, resumed)


def bad_network(bench: Bench) -> Figures:
    """In lockstep: one message in five is lost, doubled, late or damaged; until the same end."""
    bench.robot("lockstep", inside=True)
    bench.ready(toy("faulty_relay", bench.inside, bench.endpoint, str(bench.chance.randrange(10**6))))
    controller, began = bench.stepping(), time.monotonic()
    assert controller.line() == undisturbed(1, STEPS)
    return Figures(None, time.monotonic() - began)


def bad_network_in_real_time(bench: Bench) -> Figures:
    """In real time, likewise: nothing but valid commands in their order reach the base; the longest stop."""
    robot = bench.robot("realtime", inside=True)
    bench.ready(toy("faulty_relay", bench.inside, bench.endpoint, str(bench.chance.randrange(10**6))))
    bench.controller()
    standing, longest, twists = None, 0.0, []
    base(robot, moving=True)
    for order in (told(robot) for _ in range(60)):
        twists += [order.twist] * order.moving
        if order.moving and standing is not None:
            longest = max(longest, order.at - standing)
        standing = None if order.moving else standing or order.at
    assert are_answers(twists)
    return Figures(None, longest)


def turned_away(intruder: Callable[[Bench], Program], words: str, *, secret: bool = False) -> Scenario:
    """In real time: a program that must not disturb a run is refused, start included, and the robot keeps driving."""

    def scenario(bench: Bench) -> Figures:
        more = certificates(bench) if secret else ("", "")
        robot = bench.robot("realtime", *more[:1])
        bench.controller(*more[1:])
        base(robot, moving=True)
        bench.wait(0.6)
        began = time.monotonic()
        other = intruder(bench)
        assert other.end() != 0
        ended = time.monotonic()
        assert words in other.errors()
        while (order := told(robot)).at < ended:
            assert order.moving
        return Figures(None, ended - began)

    return scenario


def certificates(bench: Bench) -> tuple[str, str]:
    """The robot's identity and its controller's; the bench's endpoint speaks TLS from now on."""
    bench.folder = Path(bench.enter_context(TemporaryDirectory()))
    for name in ("ours", "forged"):
        make_certificates(bench.folder / name, Access(robots=["toy"], controllers={"alice": ["toy"]}))
    bench.endpoint = bench.endpoint.replace("tcp/", "tls/")
    return f"identity={bench.folder}/ours/toy", f"identity={bench.folder}/ours/alice"


def forger(bench: Bench) -> Program:
    return bench.controller(f"identity={bench.folder}/forged/alice")


def watched(kind: str) -> float:
    """Milliseconds a step in lockstep, of 1000, while somebody watches: ``nobody``, ``slow`` or ``frozen``."""
    with Bench(random.Random(1)) as bench:
        bench.robot("lockstep")
        watcher = bench.ready(toy("toy_watcher", bench.endpoint)) if kind != "nobody" else None
        controller = bench.controller("1000")
        if watcher is not None:
            watcher.until("watching")
        if watcher is not None and kind == "frozen":
            watcher.send(signal.SIGSTOP)
        controller.until("driving")
        began = time.monotonic()
        controller.line()
        return time.monotonic() - began


def readers(count: int) -> None:
    """Print the cost of readers that cannot keep up."""
    print("\nA step in lockstep with a watcher that cannot keep up; ms, median and largest of the runs\n")
    print("| who watches | a step |\n|---|---|")
    kinds = {"nobody": "nobody", "slow": "takes twenty messages a second", "frozen": "frozen (SIGSTOP)"}
    for kind, name in kinds.items():
        times = [watched(kind) for _ in range(count)]
        print(f"| {name} | {statistics.median(times):.2f}, {max(times):.2f} |", flush=True)


FAULTS: dict[str, Scenario] = {
    "controller killed (SIGKILL), another one started (its start included)": broken_controller(signal.SIGKILL),
    "controller frozen (SIGSTOP), then continued": broken_controller(signal.SIGSTOP),
    "controller hung with the interpreter locked, for 1 s": broken_controller(signal.SIGUSR1),
    "router killed, then started again": broken_router(signal.SIGKILL),
    "router frozen, then continued": broken_router(signal.SIGSTOP),
    "robot's side frozen: data known to be stale": frozen_robot,
    "gate killed, then started again; its driver stops by itself after 0.3 s": broken_gate(signal.SIGKILL),
    "gate frozen, then continued; its driver likewise": broken_gate(signal.SIGSTOP),
    "messages lost, doubled, late, damaged (5 % each): longest stop in 6 s": bad_network_in_real_time,
    "a second controller: refused (its start included), the robot drives on": turned_away(
        Bench.controller, "driven by"
    ),
    "a busy port: refused (start included), the robot drives on": turned_away(
        lambda bench: bench.enter_context(command("router", "--listen", bench.endpoint)), "is taken"
    ),
    "another authority's certificate: rejected after `link.connect`, the robot drives on": turned_away(
        forger, "nobody can be reached", secret=True
    ),
    "lockstep: simulator killed and started again, run refused": killed_simulator,
    "lockstep: simulator frozen, then continued, to the same end": same_end("simulator", signal.SIGSTOP),
    "lockstep: controller killed, another one begins (its start included)": killed_controller,
    "lockstep: controller frozen, then continued, to the same end": same_end("controller", signal.SIGSTOP),
    "lockstep: router killed and started again, to the same end": same_end("router", signal.SIGKILL),
    "lockstep: router frozen, then continued, to the same end": same_end("router", signal.SIGSTOP),
    "lockstep: messages lost, doubled, late, damaged (5 % each), to the same end": bad_network,
}


def faults(count: int) -> None:
    """Print the times of all faults."""
    print(f"Faults at random moments, {count} times each, runs in lockstep of {STEPS} steps; ms, median and largest\n")
    print("| fault | until the robot stops | until it continues, or somebody knows |\n|---|---|---|")
    chance = random.Random(1)
    for name, scenario in FAULTS.items():
        figures = []
        for _ in range(count):
            with Bench(chance) as bench:
                figures.append(scenario(bench))
        stops = [figure.stopped for figure in figures if figure.stopped is not None]
        print(f"| {name} | {shown(stops)} | {shown([figure.resumed for figure in figures])} |", flush=True)


def shown(times: list[float]) -> str:
    return f"{1e3 * statistics.median(times):.0f}, {1e3 * max(times):.0f}" if times else "-"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=20)
    parser.add_argument("--faults", type=int, default=10)
    asked = parser.parse_args()
    if asked.rounds:
        costs(asked.rounds)
    if asked.faults:
        faults(asked.faults)
        readers(asked.faults)
