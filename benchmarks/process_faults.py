"""The families of ``faults.py`` that need processes of their own: workers, routers, clusters, commands."""

from __future__ import annotations

import multiprocessing
import os
import random
import signal
import socket
import subprocess
import sys
import threading
from collections import Counter
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path

from toy_world import PERIOD, ToyWorld, seen, wander

from maze_machine.campaign.cluster import on_cluster
from maze_machine.campaign.jobs import Setup, jobs_of
from maze_machine.campaign.results import Results
from maze_machine.campaign.workers import on_cores
from transport.connect import connect_robot, dialling
from transport.description import RobotDescription
from transport.lockstep import LockstepServer
from transport.recording import RecordingError, read_recording
from transport.robot import LinkError
from transport.settings import LinkSettings
from transport.world import LockstepRobot

ROOT = Path(__file__).parents[1]
LENGTH = 60
"""Of a run through a router, periods."""
PATIENCE = 60.0
"""After which a process that should have ended is a broken promise, s."""
COMMAND = """
import resource, sys
import matplotlib.pyplot, maze_machine.cli, maze_machine.drive.mission, maze_machine.simulated.world
import maze_machine.report.outputs, transport.recording
_, name, room, *sys.argv[1:] = sys.argv
used = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize() if name == "AS" else 0
resource.setrlimit(getattr(resource, "RLIMIT_" + name), (used + int(room),) * 2)
maze_machine.cli.main()
"""
"""The command, that has room for that many bytes more only."""
STATUSES = range(5)
"""What a command may end with."""
ROUTER = """
import signal, sys
from transport.connect import routing
with routing(sys.argv[1]):
    print("up", flush=True)
    signal.pause()
"""


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        return int(taken.getsockname()[1])


def started(*arguments: object) -> subprocess.Popen[str]:
    """A Python process of this project."""
    return subprocess.Popen(
        [sys.executable, *map(str, arguments)],
        env={**os.environ, "PYTHONPATH": str(ROOT), "NO_COLOR": "1", "OPENBLAS_NUM_THREADS": "1"},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def ended(process: subprocess.Popen[str]) -> None:
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.communicate()


# A campaign


def campaign_faults(seed: int, count: int, folder: Path) -> Counter[tuple[str, str, str]]:
    """A campaign whose workers are killed or stopped at random moments, and which is itself interrupted and resumed."""
    chance, setup = random.Random(seed), Setup(time_limit=1.5)
    jobs = jobs_of(["right_hand"], ["corridor"], max(40, 8 * count))
    plain, path = folder / "plain.jsonl", folder / "broken.jsonl"
    found = Counter[tuple[str, str, str]]()
    done: list[str] = []
    while len(done) < count and (not path.exists() or len(Results(path, setup, jobs).open_jobs)):
        results = Results(path, setup, jobs)
        with on_cores(setup, results.open_jobs, 2) as records:
            for record in records:
                results.add(record)
                if chance.random() < 0.15 and len(done) < count:
                    kind = chance.choice(["kill", "stop", "break off"])
                    done.append(kind)
                    if kind == "break off":
                        break
                    workers = multiprocessing.active_children()
                    worker = chance.choice(workers) if workers else None
                    if worker is None or worker.pid is None:
                        continue
                    os.kill(worker.pid, signal.SIGKILL if kind == "kill" else signal.SIGSTOP)
                    if kind == "stop":
                        threading.Timer(chance.uniform(0.05, 0.5), resume, (worker.pid,)).start()
    results = Results(path, setup, jobs)
    with on_cores(setup, results.open_jobs, 2) as records:
        for record in records:
            results.add(record)
    results.write()
    results = Results(plain, setup, jobs)
    with on_cores(setup, results.open_jobs, 2) as records:
        for record in records:
            results.add(record)
    results.write()
    outcome = "good" if path.read_bytes() == plain.read_bytes() else "other results"
    for kind in done:
        found["campaign" if kind == "break off" else "worker", kind, outcome] += 1
    return found


def resume(pid: int) -> None:
    try:
        os.kill(pid, signal.SIGCONT)
    except ProcessLookupError:
        return


# The router


def router_faults(seed: int, count: int) -> Counter[tuple[str, str, str]]:
    """Runs in lockstep through a router that is killed and started again, or stopped for a moment."""
    chance, found = random.Random(seed), Counter[tuple[str, str, str]]()
    for number in range(count):
        kind = chance.choice(["kill", "stop", "restart"])
        found["router", kind, through_router(seed + number, kind, chance)] += 1
    return found


def through_router(seed: int, kind: str, chance: random.Random) -> str:
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    routers = [started("-c", ROUTER, endpoint)]
    assert routers[0].stdout is not None
    routers[0].stdout.readline()
    gone = threading.Event()
    rows: list[object] = []
    plain = LockstepRobot(ToyWorld(seed, 1000))
    expected = [turn(plain) for _ in range(LENGTH)]
    at = chance.randrange(5, LENGTH - 5)
    try:
        description, settings = RobotDescription(name="toy"), LinkSettings(step=8.0)
        # A link that is not closed keeps threads, and this process, alive.
        with (
            serving_through(endpoint, gone),
            closing(connect_robot(endpoint, description, settings, seed=seed)) as robot,
        ):
            for index in range(LENGTH):
                if index == at and kind == "stop":
                    os.kill(routers[0].pid, signal.SIGSTOP)
                    threading.Timer(chance.uniform(0.05, 1.0), os.kill, (routers[0].pid, signal.SIGCONT)).start()
                elif index == at:
                    ended(routers[0])
                    if kind == "restart":
                        routers.append(started("-c", ROUTER, endpoint))
                rows.append(turn(robot))
    except LinkError:
        # A router that does not come back ends the run, with what it brought until then.
        return "good" if kind != "stop" and rows == expected[: len(rows)] else "given up"
    finally:
        gone.set()
        for router in routers:
            ended(router)
    return "good" if rows == expected else "another run"


@contextmanager
def serving_through(endpoint: str, gone: threading.Event) -> Iterator[None]:
    """A simulator that dials the router."""
    with dialling(endpoint, wait=20.0) as bus:
        server = LockstepServer(bus, "toy", PERIOD, lambda seed: ToyWorld(seed or 0, 1000), patience=20.0)

        def serve() -> None:
            for _ in server.episodes(gone.is_set, heartbeat=0.02):
                pass

        thread = threading.Thread(target=serve)
        thread.start()
        try:
            yield
        finally:
            gone.set()
            thread.join(PATIENCE)


def turn(robot: object) -> object:
    """One step of a run, as a value that holds every bit of it."""
    observation = robot.observe()  # type: ignore[attr-defined]
    command = wander(observation)
    robot.command(command)  # type: ignore[attr-defined]
    return seen(observation), command


# The scheduler of a cluster


def scheduler_faults(seed: int, count: int, folder: Path) -> Counter[tuple[str, str, str]]:
    """Campaigns on a dask cluster whose scheduler and workers are killed, and come again."""
    chance, found = random.Random(seed), Counter[tuple[str, str, str]]()
    setup, jobs = Setup(time_limit=1.5), jobs_of(["right_hand"], ["corridor"], 12 * count)
    port = free_port()
    address = f"tcp://127.0.0.1:{port}"
    scheduler = ("-m", "dask", "scheduler", "--host", "127.0.0.1", "--port", port, "--no-dashboard")
    worker = ("-m", "dask", "worker", address, "--host", "127.0.0.1", "--nthreads", 1, "--no-dashboard")
    schedulers, workers = [started(*scheduler)], [started(*worker), started(*worker)]
    path, plain, done = folder / "cluster.jsonl", folder / "cores.jsonl", list[tuple[str, str]]()
    results = Results(path, setup, jobs)
    try:
        with on_cluster(setup, results.open_jobs, address) as records:
            for index, record in enumerate(records):
                results.add(record)
                if index % 10 == 5 and len(done) < count:
                    if chance.random() < 0.5:
                        ended(schedulers[-1])
                        # Dask's workers end with their scheduler.
                        schedulers.append(started(*scheduler))
                        workers = [started(*worker), started(*worker)]
                        done.append(("scheduler", "restart"))
                    else:
                        ended(workers.pop(0))
                        workers.append(started(*worker))
                        done.append(("worker of a cluster", "kill"))
        results.write()
    finally:
        for process in (*workers, *schedulers):
            ended(process)
    undisturbed = Results(plain, setup, jobs)
    with on_cores(setup, undisturbed.open_jobs, 2) as records:
        for record in records:
            undisturbed.add(record)
    undisturbed.write()
    outcome = "good" if path.read_bytes() == plain.read_bytes() else "other results"
    for where, kind in done:
        found[where, kind, outcome] += 1
    return found


# Commands short of memory, or on a full disk


def command_fault(seed: int, folder: Path) -> tuple[str, str, str]:
    """One run of the command that may use that much memory only, or write files of that many bytes only."""
    chance = random.Random(seed)
    kind = chance.choice(["memory limit", "disk full"])
    trace, recording = folder / f"{seed}.jsonl", folder / f"{seed}.mcap"
    for file in (trace, recording):
        file.write_bytes(b"before")
    room = chance.randrange(0, 400_000) if kind == "disk full" else chance.randrange(0, 60_000_000)
    process = started(
        *("-c", COMMAND, "FSIZE" if kind == "disk full" else "AS", room),
        *("run", "right_hand", "--maze", "corridor", "--time-limit", 2, "--no-picture"),
        *("--trace", trace, "--record", recording),
    )
    try:
        out, err = process.communicate(timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        return "command", kind, "hangs"
    finally:
        ended(process)
    return "command", kind, broken(process.returncode, out, err) or lost(trace, recording) or "good"


def broken(status: int, out: str, err: str) -> str:
    """What a command that was short of something did that it must not, or nothing."""
    if status not in STATUSES or "Traceback" in err:
        return f"status {status}: {err.strip().splitlines()[-1] if err.strip() else ''}"
    return "" if "right_hand" in out or status != 1 else "no verdict"


def lost(trace: Path, recording: Path) -> str:
    """Whether a file that was there before is neither what it was nor a whole new one."""
    if trace.read_bytes()[:6] != b"before" and not trace.read_bytes().endswith(b"\n"):
        return "half a trace"
    if recording.read_bytes()[:6] == b"before":
        return ""
    try:
        return "" if read_recording(recording).ticks else "an empty recording"
    except RecordingError as error:
        return f"unreadable: {error}"
