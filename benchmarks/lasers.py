"""Whether machines leave the maze with another laser: beams, ranges, first beams and mountings by machines and mazes.

    python benchmarks/lasers.py [--machines NAME ...] [--mazes N] [--lasers TEXT]

Every number of beams with every range, and with one of them every first beam with every mounting: where a circle
begins and how it is mounted changes nothing (`tests/skills/test_any_seam.py`), so that they need not all be multiplied.
A run is lost where the referee fails it, the machine gives up or 300 s are over. The mazes are `final_2015` and drawn
ones, with doors in every other one.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from statistics import median

# Before the folder of the benchmarks, where a script has the name of a package.
sys.path.insert(0, str(Path(__file__).parents[1]))

from maze_machine.catalogue.profile import Profile, load_profile
from maze_machine.drive.mission import drive, prepare
from maze_machine.simulated.world import SimulatedWorld, find_maze
from sim.generate import Recipe, generate
from sim.maze import Maze
from transport.description import Laser, RobotDescription
from transport.world import LockstepRobot

MACHINES = ("pledge", "right_hand_loop", "tremaux")
LIMIT = 300.0
BEAMS = (180, 360, 1000, 1500)
RANGES = (3.5, 8.0, 12.0)
FIRST = {"at the back": -math.pi, "ahead": 0.0, "left": math.pi / 2, "in between": 1.0}
MOUNTS = {"straight": (0.0, 0.0, 0.0), "turned round": (0.0, 0.0, math.pi), "askew, off the middle": (0.05, 0.03, 1.0)}


@dataclass(frozen=True)
class Kind:
    """A laser, and what it is called."""

    name: str
    laser: Laser


def all_round(beams: int, reach: float, first: float, mount: tuple[float, float, float]) -> Laser:
    """A laser that sees all round."""
    span = math.tau * (1 - 1 / beams)
    x, y, heading = mount
    ends = {"angle_min": first, "angle_max": first + span}
    return Laser(beams=beams, range_min=0.12, range_max=reach, mount_x=x, mount_y=y, mount_heading=heading, **ends)


def kinds() -> Iterator[Kind]:
    """The lasers to try."""
    yield Kind("PICO's: 1000 beams over 4 rad, 10 m", Laser())
    for beams in BEAMS:
        for reach in RANGES:
            yield Kind(f"{beams} beams all round, {reach:g} m", all_round(beams, reach, 0.0, MOUNTS["straight"]))
    for where, first in FIRST.items():
        for how, mount in MOUNTS.items():
            yield Kind(f"360 beams, 8 m, begins {where}, {how}", all_round(360, 8.0, first, mount))


def mazes(drawn: int) -> Iterator[Maze]:
    """The mazes to drive in."""
    yield find_maze("final_2015", robot=RobotDescription())
    for seed in range(drawn):
        yield generate(Recipe(columns=5, rows=4, corridor=1.0, loops=1, doors=seed % 2, skew=1.0), seed)


def run(machine: str, maze: Maze, laser: Laser) -> tuple[bool, bool, float]:
    """Whether the robot got out, whether it touched a wall, and its time, s."""
    profile = load_profile()
    described = Profile(robot=profile.robot.model_copy(update={"laser": laser}), skills=profile.skills)
    mission = prepare(machine, described, time_limit=LIMIT)
    robot = LockstepRobot(SimulatedWorld(maze, described.robot))
    ending = drive(mission, robot, robot)
    return bool(ending.report["escaped"]), bool(ending.report["contacts"]), ending.duration


def main() -> None:
    """Drive, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--machines", nargs="*", default=MACHINES)
    parser.add_argument("--mazes", type=int, default=2, help="how many mazes to draw")
    parser.add_argument("--lasers", default="", help="only those whose name has this in it")
    arguments = parser.parse_args()
    places = list(mazes(arguments.mazes))
    print("| laser | out | touched | median time of those that got out |\n|---|---|---|---|")
    for kind in kinds():
        if arguments.lasers in kind.name:
            runs = [run(machine, maze, kind.laser) for machine in arguments.machines for maze in places]
            out, touched = (sum(one[index] for one in runs) for index in (0, 1))
            time = f"{median([time for out, _, time in runs if out]):.0f} s" if out else "-"
            print(f"| {kind.name} | {out} of {len(runs)} | {touched} | {time} |", flush=True)


if __name__ == "__main__":
    main()
