"""What the link costs and how it fails: ``python benchmarks/link.py [--rounds N] [--faults N]``.

The first table compares a tick of the pledge machine with the real simulator in one process and over the loopback with
a bare Zenoh ping-pong of the same messages; all in one run, interleaved, medians of the rounds. The second breaks
things at random moments and measures how long the robot moves on, and how long it takes until it moves again. The third
says what readers cost that cannot keep up.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
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

from controller.mission import drive, prepare  # noqa: E402
from controller.profile import load_profile  # noqa: E402
from controller.simulation import SimulatedWorld, find_maze  # noqa: E402
from transport.connect import connect_robot  # noqa: E402
from transport.world import LockstepRobot  # noqa: E402

SCAN, ODOMETRY, TWIST = 4060, 724, 52
OBSERVATION_TAG, COMMAND_TAG = 48, 32
MAZE = "final_2015"
STRETCH = 20.0
"""How long a run is, simulated seconds: short, so that a busy moment of the computer spoils one round only."""


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


def processor_time(*processes: int) -> float:
    """Seconds that processes have worked, of all their threads; this measure bears a busy computer."""
    total = 0
    for process in processes:
        fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
        total += int(fields[11]) + int(fields[12])
    return total / os.sysconf("SC_CLK_TCK")


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
        self.times(500)

    def times(self, count: int) -> float:
        """Seconds a round trip."""
        began = time.perf_counter()
        for _ in range(count):
            self.publisher.put(bytes(TWIST), attachment=bytes(COMMAND_TAG))
            self.answers.get(timeout=10)
            self.answers.get(timeout=10)
        return (time.perf_counter() - began) / count

    def close(self) -> None:
        """Let the other side go."""
        self.publisher.put(b"")
        self.process.join(10)
        self.session.close()


def costs(rounds: int) -> None:
    profile = load_profile()
    maze = find_maze(MAZE)
    mission = prepare("pledge", profile, time_limit=STRETCH)
    bare = PingPong()
    endpoint = free_endpoint()
    with command("sim", MAZE, "--listen", endpoint) as simulator:
        simulator.line()

        us, sim, other = os.getpid(), simulator.process.pid, bare.process.pid

        def run(robot: object) -> tuple[float, int]:
            ending = drive(mission, robot, robot)
            return ending.elapsed / ending.ticks, ending.ticks

        table: dict[str, list[tuple[float, float]]] = {"in one process": [], "over the link": [], "bare ping-pong": []}
        for seed in range(rounds + 1):
            worked = [processor_time(us)]
            here, ticks = run(LockstepRobot(SimulatedWorld(maze, profile.robot, seed)))
            worked += [processor_time(us), processor_time(us, sim)]
            there, same = run(connect_robot(endpoint, profile.robot, profile.link, seed=seed))
            assert ticks == same
            worked += [processor_time(us, sim), processor_time(us, other)]
            ping = bare.times(ticks)
            worked.append(processor_time(us, other))
            # The first round compiles and warms up.
            if seed:
                for index, (name, value) in enumerate(zip(table, (here, there, ping), strict=True)):
                    work = (worked[2 * index + 1] - worked[2 * index]) / ticks
                    table[name].append((value, work))
    bare.close()
    print(f"A tick of pledge in {MAZE}, {rounds} rounds of {ticks} ticks: median, and the least disturbed round\n")
    print("| | ms a tick | ticks a second | ms of processor time a tick, both sides |\n|---|---|---|---|")
    for name, values in table.items():
        walls, works = zip(*values, strict=True)
        wall, least = statistics.median(walls), min(walls)
        times = f"{1e3 * statistics.median(works):.3f}, {1e3 * min(works):.3f}"
        print(f"| {name} | {1e3 * wall:.3f}, {1e3 * least:.3f} | {1 / wall:.0f}, {1 / least:.0f} | {times} |")
    here, there, ping = ([wall for wall, _ in values] for values in table.values())
    added = statistics.median((b - a) / c for a, b, c in zip(here, there, ping, strict=True))
    least = (min(there) - min(here)) / min(ping)
    print(f"\nThe link adds {added:.2f}, at the least {least:.2f} bare ping-pongs to a tick (at most 1.5 wanted).\n")


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
