"""How fast the main job runs on one core, and where a tick's time goes, phase by phase.

    python benchmarks/run.py [MACHINE] [--maze MAZE] [--runs N] [--bare]

The machine drives an embedded simulator, without trace or picture, a few times with different seeds; the figures are
medians over all ticks of all runs after one that warms up. Perception is lazy: what it takes is part of the phase that
first asks for a fact (its compass: prepare; the machine's signals: coordinate; what the skills look at: act). The
phase command is the simulator: physics, doors, laser, noise, odometry, referee. The last one, watch, looks at the
machine's properties.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path
from statistics import median, quantiles
from time import process_time

from rich.console import Console
from rich.table import Table

# Before the folder of the benchmarks, where a script has the name of a package.
sys.path.insert(0, str(Path(__file__).parents[1]))

from maze_machine.catalogue.profile import load_profile
from maze_machine.drive.mission import Ending, drive, prepare
from maze_machine.drive.tick import Phases, Tick
from maze_machine.simulated.world import SimulatedWorld, find_maze
from transport.world import LockstepRobot


def main() -> None:
    """Measure and print both tables."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("machine", nargs="?", default="pledge")
    parser.add_argument("--maze", default="final_2015")
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--bare", action="store_true", help="print the factor by processor time alone")
    arguments = parser.parse_args()
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    profile = load_profile()
    maze = find_maze(arguments.maze, robot=profile.robot)
    mission = prepare(arguments.machine, profile)

    def run(seed: int) -> tuple[Ending, float, list[Phases]]:
        phases: list[Phases] = []

        def keep(tick: Tick) -> None:
            phases.append(tick.phases)

        world = SimulatedWorld(maze, profile.robot, seed)
        robot = LockstepRobot(world)
        began = process_time()
        ending = drive(mission, robot, robot, [keep])
        return ending, process_time() - began, phases

    run(0)
    runs = [run(seed) for seed in range(arguments.runs)]
    if arguments.bare:
        print(median(ending.duration / used for ending, used, _ in runs))
        return
    console = Console()
    console.print(speed_table(arguments.machine, maze.name, [(ending, used) for ending, used, _ in runs]))
    console.print(phase_table([phases for _, _, kept in runs for phases in kept]))


def speed_table(machine: str, maze: str, runs: list[tuple[Ending, float]]) -> Table:
    """Real-time factors: by the clock on the wall, and by processor time where others keep the core busy."""
    table = Table(
        "runs", "simulated, s", "ticks a second", "x real time", "by processor time", title=f"{machine} in {maze}"
    )
    table.add_row(
        str(len(runs)),
        f"{sum(ending.duration for ending, _ in runs):.0f}",
        f"{median(ending.ticks / ending.elapsed for ending, _ in runs):.0f}",
        f"{median(ending.duration / ending.elapsed for ending, _ in runs):.0f}",
        f"{median(ending.duration / used for ending, used in runs):.0f}",
    )
    return table


def phase_table(kept: list[Phases]) -> Table:
    """Where the time of a tick goes."""
    table = Table("phase", "median, us", "95%, us", "mean, us", "share", title="one tick")
    total = sum(map(sum, kept))
    for name in Phases._fields:
        times = [getattr(phases, name) * 1e6 for phases in kept]
        mean = sum(times) / len(times)
        share = sum(times) / total / 1e6
        table.add_row(name, f"{median(times):.0f}", f"{quantiles(times, n=20)[-1]:.0f}", f"{mean:.0f}", f"{share:.0%}")
    table.add_row("all", f"{median(map(sum, kept)) * 1e6:.0f}", "", f"{total / len(kept) * 1e6:.0f}", "100%")
    return table


if __name__ == "__main__":
    main()
