"""What the link costs and how it fails: ``python benchmarks/link.py [--rounds N] [--faults N]``.

The first table compares a tick of the pledge machine with the real simulator in one process and over the loopback with
a bare Zenoh ping-pong of the same messages: tick by tick in turn, so that what else the computer does meets all three.
The second breaks things at random moments and measures how long the robot moves on, and how long it takes until it
moves again. The third says what readers cost that cannot keep up.
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
from contextlib import ExitStack
from multiprocessing.connection import Connection
from pathlib import Path

ROOT = Path(__file__).parents[1]
# Not this folder, whose scripts bear the names of packages.
sys.path[0:1] = [str(ROOT), str(ROOT / "tests" / "transport")]

import zenoh  # noqa: E402
from programs import base, command, toy  # noqa: E402

from controller.loop import ticks  # noqa: E402
from controller.mission import Mission, prepare  # noqa: E402
from controller.profile import load_profile  # noqa: E402
from controller.simulation import SimulatedWorld, find_maze  # noqa: E402
from perception import Perception  # noqa: E402
from skills.chain import MotionChain  # noqa: E402
from transport.connect import connect_robot  # noqa: E402
from transport.robot import Robot  # noqa: E402
from transport.world import LockstepRobot  # noqa: E402

SCAN, ODOMETRY, TWIST = 4060, 724, 52
OBSERVATION_TAG, COMMAND_TAG = 48, 32
MAZE = "final_2015"
TICKS, WARM = 30, 100
"""Ticks a round, short enough that a busy moment of the computer spoils one round only; ticks that do not count."""


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


def pong(endpoint: str, ready: Connection) -> None:
    with bare_session(listen=endpoint) as session:
        asked: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        subscriber = session.declare_subscriber("bare/ping", lambda sample: asked.put(sample.payload.to_bytes()))
        odometry, scan = session.declare_publisher("bare/odom"), session.declare_publisher("bare/scan", express=True)
        ready.send(1)
        while asked.get(timeout=60):
            odometry.put(bytes(ODOMETRY), attachment=bytes(OBSERVATION_TAG))
            scan.put(bytes(SCAN), attachment=bytes(OBSERVATION_TAG))
        del subscriber


class PingPong:
    """The same bytes as a tick, with nothing done to them."""

    def __init__(self) -> None:
        endpoint = free_endpoint()
        here, there = multiprocessing.Pipe()
        spawn = multiprocessing.get_context("spawn")
        self.process = spawn.Process(target=pong, args=(endpoint, there), daemon=True)
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

    def once(self) -> None:
        """There and back."""
        self.publisher.put(bytes(TWIST), attachment=bytes(COMMAND_TAG))
        self.answers.get(timeout=10)
        self.answers.get(timeout=10)

    def close(self) -> None:
        """Let the other side go."""
        self.publisher.put(b"")
        self.process.join(10)
        self.session.close()


class Lane:
    """One way of driving, tick by tick: a step of it ends when the observation after its command is there."""

    def __init__(self, mission: Mission, robot: Robot) -> None:
        profile = mission.profile
        self.robot = robot
        perception, chain = Perception(profile.robot, profile.perception), MotionChain(profile.robot, profile.skills)
        self._ticks = ticks(robot, mission.machine, mission.parameters, perception, chain)

    def step(self) -> None:
        """One tick."""
        next(self._ticks)
        self.robot.observe()


def costs(rounds: int) -> None:
    """Print what a tick costs in one process and over the link, and a bare ping-pong."""
    profile, maze, endpoint = load_profile(), find_maze(MAZE), free_endpoint()
    mission = prepare("pledge", profile)
    bare = PingPong()
    took: dict[str, list[float]] = {"in one process": [], "over the link": [], "bare ping-pong, in turn with both": []}
    flat: list[float] = []
    with command("sim", MAZE, "--listen", endpoint) as simulator:
        simulator.line()
        here = Lane(mission, LockstepRobot(SimulatedWorld(maze, profile.robot, 1)))
        there = Lane(mission, connect_robot(endpoint, profile.robot, profile.link, seed=1))
        steps = dict(zip(took, (here.step, there.step, bare.once), strict=True))
        for _ in range(WARM):
            for step in steps.values():
                step()
        # Which of the three comes after which matters to the processor's caches, so they take turns in that too.
        orders = list(itertools.permutations(steps))
        for index in range(rounds * TICKS):
            for name in orders[index % len(orders)]:
                took[name].append(timed(steps[name]))
            if index % TICKS == TICKS - 1:
                flat += [timed(bare.once) for _ in range(TICKS)]
        there.robot.close()
    bare.close()
    print(f"A tick of pledge in {MAZE}, {rounds} rounds of {TICKS} ticks in turn; ms, median and the round at rest\n")
    print("| | a tick | ticks a second |\n|---|---|---|")
    for name, times in (took | {"bare ping-pong, flat out": flat}).items():
        middle, least = statistics.median(times), min(in_rounds(times))
        print(f"| {name} | {1e3 * middle:.3f}, {1e3 * least:.3f} | {1 / middle:.0f}, {1 / least:.0f} |")
    local, remote, ping = took.values()
    added = in_rounds([b - a for a, b in zip(local, remote, strict=True)])
    print("\nThe link adds to a tick, in bare ping-pongs, median and quartiles of the rounds:")
    for name, pings in (("in turn", ping), ("flat out", flat)):
        low, middle, high = statistics.quantiles([a / b for a, b in zip(added, in_rounds(pings), strict=True)])
        print(f"- {name}: {middle:.2f} ({low:.2f} to {high:.2f})")
    print(flush=True)


def timed(step: Callable[[], object]) -> float:
    began = time.perf_counter()
    step()
    return time.perf_counter() - began


def in_rounds(times: list[float]) -> list[float]:
    """The median of each round: what disturbs a tick now and then does not show."""
    return [statistics.median(times[first : first + TICKS]) for first in range(0, len(times), TICKS)]


# What a fault costs


def broken_controller(number: signal.Signals) -> Callable[[random.Random], tuple[float, float]]:
    """The controller is killed, frozen or hung; resumed by another one, or by itself."""

    def once(chance: random.Random) -> tuple[float, float]:
        endpoint = free_endpoint()
        with toy("toy_world", endpoint, "realtime") as robot:
            robot.line()
            with toy("toy_controller", endpoint, "1") as controller:
                base(robot, moving=True)
                time.sleep(chance.uniform(0.2, 0.6))
                failed = controller.send(number)
                stopped = base(robot, moving=False, after=failed)
                if number == signal.SIGKILL:
                    controller.end()
                    with toy("toy_controller", endpoint, "1") as heir:
                        restarted = time.monotonic()
                        heir.line()
                        return stopped - failed, base(robot, moving=True, after=stopped) - restarted
                if number == signal.SIGSTOP:
                    remedy = controller.send(signal.SIGCONT)
                    return stopped - failed, base(robot, moving=True, after=stopped) - remedy
                # It hangs for a second and comes back by itself.
                return stopped - failed, base(robot, moving=True, after=stopped) - failed - 1.0

    return once


def broken_router(number: signal.Signals) -> Callable[[random.Random], tuple[float, float]]:
    """Both sides are cut off from each other; resumed when the router is back."""

    def once(chance: random.Random) -> tuple[float, float]:
        endpoint = free_endpoint()
        with command("router", "--listen", endpoint) as router:
            router.line()
            with toy("toy_world", endpoint, "realtime@router") as robot:
                robot.line()
                with toy("toy_controller", endpoint, "1"):
                    base(robot, moving=True)
                    time.sleep(chance.uniform(0.2, 0.6))
                    failed = router.send(number)
                    stopped = base(robot, moving=False, after=failed)
                    if number == signal.SIGSTOP:
                        remedy = router.send(signal.SIGCONT)
                        return stopped - failed, base(robot, moving=True, after=stopped) - remedy
                    router.end()
                    with command("router", "--listen", endpoint) as again:
                        again.line()
                        remedy = time.monotonic()
                        return stopped - failed, base(robot, moving=True, after=stopped) - remedy

    return once


def broken_simulator(chance: random.Random) -> tuple[float, float]:
    """A simulator in lockstep is killed and restarted: the time until the controller knows, from the restart on."""
    endpoint = free_endpoint()
    with toy("toy_world", endpoint, "lockstep") as simulator:
        simulator.line()
        with toy("toy_controller", endpoint, "1", "1000000") as controller:
            controller.until("driving")
            time.sleep(chance.uniform(0.0, 0.3))
            simulator.send(signal.SIGKILL)
            simulator.end()
            with toy("toy_world", endpoint, "lockstep") as again:
                again.line()
                restarted = time.monotonic()
                assert controller.end() == 1
                return 0.0, time.monotonic() - restarted


def frozen_simulator(chance: random.Random) -> tuple[float, float]:
    """A simulator in lockstep is frozen for a moment: the time until the run goes on, and to the same end."""
    endpoint = free_endpoint()
    with toy("toy_world", endpoint, "lockstep") as simulator:
        simulator.line()
        with toy("toy_controller", endpoint, "1", "600") as undisturbed:
            undisturbed.until("driving")
            expected = undisturbed.line()
            undisturbed.end()
        with toy("toy_controller", endpoint, "1", "600") as controller:
            controller.until("driving")
            simulator.send(signal.SIGSTOP)
            time.sleep(chance.uniform(0.0, 0.5))
            remedy = simulator.send(signal.SIGCONT)
            assert controller.line() == expected
            return 0.0, time.monotonic() - remedy


def noticed_silence(chance: random.Random) -> tuple[float, float]:
    """The robot's side is frozen: the time until its controller sees that the data are stale."""
    endpoint = free_endpoint()
    with toy("toy_world", endpoint, "realtime") as robot:
        robot.line()
        with toy("toy_controller", endpoint, "1") as controller:
            base(robot, moving=True)
            time.sleep(chance.uniform(0.2, 0.6))
            failed = robot.send(signal.SIGSTOP)
            controller.until("stale")
            return 0.0, time.monotonic() - failed


def broken_gate(number: signal.Signals) -> Callable[[random.Random], tuple[float, float]]:
    """The gate fails: its driver stops by itself, and the controller takes the robot again when the gate is back."""

    def once(chance: random.Random) -> tuple[float, float]:
        inside, endpoint = free_endpoint(), free_endpoint()
        guarded = ["gate", inside, "--listen", endpoint, "--set", "robot.name=toy"]
        with toy("toy_world", inside, "guarded") as driver, ExitStack() as stack:
            driver.line()
            gate = stack.enter_context(command(*guarded))
            gate.line()
            stack.enter_context(toy("toy_controller", endpoint, "1"))
            base(driver, moving=True)
            time.sleep(chance.uniform(0.2, 0.6))
            failed = gate.send(number)
            stopped = base(driver, moving=False, after=failed)
            if number == signal.SIGSTOP:
                remedy = gate.send(signal.SIGCONT)
            else:
                gate.end()
                stack.enter_context(command(*guarded)).line()
                remedy = time.monotonic()
            return stopped - failed, base(driver, moving=True, after=stopped) - remedy

    return once


def broken_network(chance: random.Random) -> tuple[float, float]:
    """The router between a simulator in lockstep and its controller is restarted: the time until the same end."""
    endpoint = free_endpoint()
    with command("router", "--listen", endpoint) as router:
        router.line()
        with toy("toy_world", endpoint, "lockstep@router") as simulator:
            simulator.line()
            with toy("toy_controller", endpoint, "1", "600") as undisturbed:
                undisturbed.until("driving")
                expected = undisturbed.line()
                undisturbed.end()
            with toy("toy_controller", endpoint, "1", "600") as controller:
                controller.until("driving")
                time.sleep(chance.uniform(0.0, 0.1))
                router.send(signal.SIGKILL)
                router.end()
                with command("router", "--listen", endpoint) as again:
                    again.line()
                    remedy = time.monotonic()
                    assert controller.line() == expected
                    return 0.0, time.monotonic() - remedy


def watched(kind: str) -> float:
    """Milliseconds a step in lockstep, of 1000, while somebody looks on: ``nobody``, ``slow`` or ``frozen``."""
    endpoint = free_endpoint()
    with toy("toy_world", endpoint, "lockstep") as simulator, ExitStack() as stack:
        simulator.line()
        watcher = stack.enter_context(toy("toy_watcher", endpoint)) if kind != "nobody" else None
        if watcher is not None:
            watcher.until("ready")
        controller = stack.enter_context(toy("toy_controller", endpoint, "1", "1000"))
        if watcher is not None:
            watcher.until("watching")
            if kind == "frozen":
                watcher.send(signal.SIGSTOP)
        controller.until("driving")
        began = time.monotonic()
        controller.line()
        return time.monotonic() - began


def readers(count: int) -> None:
    """Print what readers cost that cannot keep up."""
    print("\nA step in lockstep while somebody looks on who cannot keep up; ms, median and largest of the runs\n")
    print("| who looks on | a step |\n|---|---|")
    kinds = {"nobody": "nobody", "slow": "takes twenty messages a second", "frozen": "frozen (SIGSTOP)"}
    for kind, name in kinds.items():
        times = [watched(kind) for _ in range(count)]
        print(f"| {name} | {statistics.median(times):.2f}, {max(times):.2f} |", flush=True)


FAULTS: dict[str, Callable[[random.Random], tuple[float, float]]] = {
    "controller killed (SIGKILL), another one started (its start included)": broken_controller(signal.SIGKILL),
    "controller frozen (SIGSTOP), then continued": broken_controller(signal.SIGSTOP),
    "controller hung with the interpreter locked, for 1 s": broken_controller(signal.SIGUSR1),
    "router killed, then started again": broken_router(signal.SIGKILL),
    "router frozen, then continued": broken_router(signal.SIGSTOP),
    "robot's side frozen: data known to be stale": noticed_silence,
    "gate killed, then started again; its driver stops by itself after 0.3 s": broken_gate(signal.SIGKILL),
    "gate frozen, then continued; its driver likewise": broken_gate(signal.SIGSTOP),
    "lockstep: simulator killed and started again, run refused": broken_simulator,
    "lockstep: router killed and started again, to the same end (600 steps)": broken_network,
    "lockstep: simulator frozen, then continued to the same end (600 steps)": frozen_simulator,
}


def faults(count: int) -> None:
    print(f"Faults at random moments, {count} times each; ms, median and largest\n")
    print("| fault | until the robot stands | until it goes on, or the controller knows |\n|---|---|---|")
    chance = random.Random(1)
    for name, once in FAULTS.items():
        stops, resumes = zip(*(once(chance) for _ in range(count)), strict=True)
        shown = [f"{1e3 * statistics.median(times):.0f}, {1e3 * max(times):.0f}" for times in (stops, resumes)]
        print(f"| {name} | {shown[0] if any(stops) else '-'} | {shown[1]} |", flush=True)


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
