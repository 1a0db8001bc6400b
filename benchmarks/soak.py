"""Whether anything grows: ``python benchmarks/soak.py [--minutes N] [--runs N]``.

The first part drives a simulated robot over a Zenoh link for that many minutes of its time, at ten periods a second,
the second makes this many short runs in one process. Memory, file descriptors and threads are read after a tenth of
part and at its end; the exit status is 1 if they grew by more than the limits.
"""

from __future__ import annotations

import argparse
import ctypes
import gc
import os
import socket
import sys
import threading
from collections import deque
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path[0:1] = [str(ROOT)]  # not this folder, whose scripts have the names of packages

from maze_machine.catalogue.profile import load_profile  # noqa: E402
from maze_machine.drive.mission import drive, prepare  # noqa: E402
from maze_machine.simulated.world import SimulatedWorld, find_maze  # noqa: E402
from transport.connect import connect_robot, listening  # noqa: E402
from transport.lockstep import LockstepServer  # noqa: E402
from transport.messages import Command, Twist  # noqa: E402
from transport.world import LockstepRobot  # noqa: E402

PERIODS = 10
"""A second of simulated time."""
_C = ctypes.CDLL(None)
LIMITS = {"memory": 8.0, "descriptors": 0.0, "threads": 0.0}
"""By how much each may grow, in MiB and in pieces."""


def used() -> dict[str, float]:
    """What the process has now: memory in MiB, file descriptors, threads.

    What glibc's allocator holds free is returned first where that can be done: when it grows differs from run to run.
    """
    gc.collect()
    if hasattr(_C, "malloc_trim"):
        _C.malloc_trim(0)
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    descriptors = len(list(Path("/proc/self/fd").iterdir()))
    return {
        "memory": pages * os.sysconf("SC_PAGESIZE") / 2**20,
        "descriptors": float(descriptors),
        "threads": float(len(list(Path("/proc/self/task").iterdir()))),
    }


def over_the_link(minutes: float) -> tuple[dict[str, float], dict[str, float]]:
    """Drive back and forth over the loopback; what was used after a tenth of the time and at the end."""
    profile = load_profile()
    maze = find_maze("corridor", robot=profile.robot)
    with socket.create_server(("127.0.0.1", 0)) as taken:
        endpoint = f"tcp/127.0.0.1:{taken.getsockname()[1]}"
    ended = threading.Event()
    with listening(endpoint) as bus:

        def begin(seed: int | None) -> SimulatedWorld:
            return SimulatedWorld(maze, profile.robot, seed or 0)

        server = LockstepServer(bus, profile.robot.name, profile.robot.period, begin)
        thread = threading.Thread(target=lambda: deque(server.episodes(ended.is_set), maxlen=0))
        thread.start()
        robot = connect_robot(endpoint, profile.robot, profile.link, seed=1)
        steps, first = round(60 * PERIODS * minutes), used()
        for step in range(steps):
            observation = robot.observe()
            turn = 0.5 if step // 20 % 2 else -0.5
            robot.command(Command(Twist(turn=turn), answers=observation.stamp))
            if step == steps // 10:
                first = used()
        last = used()
        robot.close()
        ended.set()
        thread.join()
    return first, last


def short_runs(count: int) -> tuple[dict[str, float], dict[str, float]]:
    """Run a machine again and again; what was used after a tenth of the runs and at the end."""
    profile = load_profile()
    maze, first = find_maze("corridor", robot=profile.robot), used()
    for number in range(count):
        mission = prepare("right_hand", profile, time_limit=1.0)
        robot = LockstepRobot(SimulatedWorld(maze, profile.robot, number))
        drive(mission, robot, robot)
        if number == count // 10:
            first = used()
    return first, used()


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=60.0, help="simulated time over the link")
    parser.add_argument("--runs", type=int, default=1000, help="short runs in one process")
    asked = parser.parse_args()
    print("| part | what | after a tenth | at the end |\n|---|---|---|---|")
    grown = False
    for part, (first, last) in (
        (f"{asked.runs} runs of 1 s", short_runs(asked.runs)),
        (f"{asked.minutes:g} min over the link", over_the_link(asked.minutes)),
    ):
        for what, limit in LIMITS.items():
            print(f"| {part} | {what} | {first[what]:.1f} | {last[what]:.1f} |", flush=True)
            grown = grown or last[what] - first[what] > limit
    return int(grown)


if __name__ == "__main__":
    sys.exit(main())
