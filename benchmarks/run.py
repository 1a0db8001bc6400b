"""How fast the main job runs on one core, and where a tick's time goes, phase by phase.

    python benchmarks/run.py [MACHINE] [--maze MAZE] [--runs N]

The machine drives an embedded simulator, without trace or picture, a few times with different seeds; the figures are
medians over all ticks of all runs after one that warms up. Perception is lazy: what it takes is part of the phase that
first asks for a fact (its compass: prepare; the machine's signals: coordinate; what the skills look at: act). The last
phase, command, is the simulator: physics, doors, laser, noise, odometry, referee.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path
from statistics import median, quantiles

from rich.console import Console
from rich.table import Table

# Not the folder of the benchmarks, where a script bears the name of a package.
sys.path[0] = str(Path(__file__).parents[1])

from controller.loop import Phases, Tick
from controller.mission import Ending, drive, prepare
from controller.profile import load_profile
from controller.simulation import SimulatedWorld, find_maze
from transport.world import LockstepRobot


def main() -> None:
    """Measure and print both tables."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("machine", nargs="?", default="pledge")
    parser.add_argument("--maze", default="final_2015")
    parser.add_argument("--runs", type=int, default=5)
    arguments = parser.parse_args()
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    profile = load_profile()
    maze = find_maze(arguments.maze)
    mission = prepare(arguments.machine, profile)

    def run(seed: int) -> tuple[Ending, list[Phases]]:
        phases: list[Phases] = []

        def keep(tick: Tick) -> None:
            phases.append(tick.phases)

        world = SimulatedWorld(maze, profile.robot, seed)
        robot = LockstepRobot(world)
        return drive(mission, robot, robot, [keep]), phases

    run(0)
    runs = [run(seed) for seed in range(arguments.runs)]
    console = Console()
    console.print(speed_table(arguments.machine, maze.name, [ending for ending, _ in runs]))
    console.print(phase_table([phases for _, kept in runs for phases in kept]))


def speed_table(machine: str, maze: str, endings: list[Ending]) -> Table:
    """Real-time factors."""
    table = Table("runs", "simulated, s", "ticks a second", "x real time", "slowest run", title=f"{machine} in {maze}")
    factors = [ending.duration / ending.elapsed for ending in endings]
    table.add_row(
        str(len(endings)),
        f"{sum(ending.duration for ending in endings):.0f}",
        f"{median(ending.ticks / ending.elapsed for ending in endings):.0f}",
        f"{median(factors):.0f}",
        f"{min(factors):.0f}",
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
