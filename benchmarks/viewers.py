"""What viewers cost the loop: a run that is open to the network, with none, one, five and one that has stopped reading.

Each round drives the same run once with each crowd, interleaved, at a pace; what is compared is the time that the loop
itself takes for a tick (its phases together), as medians over the ticks. Viewers are processes of their own.

Run as ``python benchmarks/viewers.py [ROUNDS]``.
"""

from __future__ import annotations

import signal
import socket
import statistics
import subprocess
import sys
import time
from pathlib import Path

# Not this folder, whose scripts have the names of packages.
sys.path[0:1] = [str(Path(__file__).parents[1])]

from maze_machine.catalogue.profile import load_profile  # noqa: E402
from maze_machine.drive.mission import drive, prepare  # noqa: E402
from maze_machine.drive.tick import Tick  # noqa: E402
from maze_machine.remote.opened import OpenRun  # noqa: E402
from maze_machine.remote.operated import OperatedRun  # noqa: E402
from maze_machine.report.pages import network_head, run_head  # noqa: E402
from maze_machine.simulated.world import SimulatedWorld, find_maze  # noqa: E402
from maze_machine.view.drawings import Drawings  # noqa: E402
from transport.connect import listening  # noqa: E402
from transport.world import LockstepRobot  # noqa: E402

CROWDS = {"0 viewers": (0, False), "1 viewer": (1, False), "5 viewers": (5, False), "1 stalled": (1, True)}
SPEED = 10.0
SECONDS = 20.0
SETTLE = 1.5


def main() -> None:
    """Print a line for each crowd."""
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    found: dict[str, list[float]] = {name: [] for name in CROWDS}
    for _ in range(rounds):
        for name, (count, stalled) in CROWDS.items():
            found[name].append(one_run(count, stalled=stalled))
    base = found["0 viewers"]
    print(f"pledge in final_2015, {SECONDS:g} s at {SPEED:g} times real time, median of {rounds} rounds")
    for name, times in found.items():
        ratio = statistics.median(time_ / other for time_, other in zip(times, base, strict=True))
        print(f"  {name:<10} {1e3 * statistics.median(times):6.3f} ms a tick, {ratio:5.2f} of none")


def one_run(count: int, *, stalled: bool) -> float:
    """The median time of a tick with a crowd, s."""
    mission = prepare("pledge", load_profile(), time_limit=SECONDS)
    world = SimulatedWorld(find_maze("final_2015", robot=mission.profile.robot), mission.profile.robot)
    robot, operated = LockstepRobot(world), OperatedRun(mission, pausable=True, speed=SPEED)
    endpoint, spent = f"tcp/127.0.0.1:{free_port()}", []
    told = network_head(run_head(mission, world), Drawings(mission.machine))
    with listening(endpoint) as bus, OpenRun(bus, mission, operated, told) as opened:
        command = [sys.executable, "-m", "maze_machine", "watch", "--connect", endpoint, "--json"]
        viewers = [subprocess.Popen(command, stdout=subprocess.DEVNULL) for _ in range(count)]
        time.sleep(SETTLE if count else 0.0)
        if stalled:
            viewers[0].send_signal(signal.SIGSTOP)

        def note(tick: Tick) -> None:
            spent.append(sum(tick.phases))

        drive(mission, robot, robot, [note, opened, operated], operator=operated)
        for viewer in viewers:
            viewer.kill()
            viewer.wait()
    return statistics.median(spent)


def free_port() -> int:
    """A port that is free."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


if __name__ == "__main__":
    main()
