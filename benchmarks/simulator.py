"""How fast the simulator is: one scan, one tick, many robots, a large maze, an hour; beside pymunk, shapely and ir-sim.

    python benchmarks/simulator.py                        all tables
    python benchmarks/simulator.py --quick                a tenth of the repetitions, a minute instead of the hour
    python benchmarks/simulator.py --irsim PYTHON         the interpreter of an environment where ir-sim is installed

Scenes are mazes drawn by seed; their walls are halved until there are this many segments. Times are those of one
thread, medians over rounds in which the methods of a table take turns; ir-sim runs in a process of its own and takes
its turn there. Without ir-sim its rows are left out. The tables of whole ticks are those of the compiled kernels,
if they were built; with MAZE_MACHINE_PLAIN=1 in the environment, those of the plain functions.
"""

from __future__ import annotations

import argparse
import json
import math
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from statistics import median

import numpy as np
import pymunk
import shapely

sys.path.insert(0, str(Path(__file__).parents[1]))

from sim.generate import Recipe, generate
from sim.lidar import Kernel, Lidar
from sim.maze import Maze, Segments, Start
from sim.noise import disturbed
from sim.settings import LaserNoise
from sim.simulation import Simulation
from transport.compiled import TWINS
from transport.description import RobotDescription
from transport.messages import Command, Pose, Twist

ROOT = Path(__file__).parents[1]
GEOMETRY = RobotDescription().laser.geometry()
SCENES = {50: Recipe(columns=7, rows=6, loops=3, skew=1.0), 460: Recipe(columns=16, rows=16, loops=6, skew=1.0)}
TICKS, REPEATS = 100, 20
ABOUT = Twist(0.04, 0.0, 0.5)
"""A circle of 8 cm about the start: every tick moves, turns and sees something else, and touches nothing."""


def scene(segments: int) -> Maze:
    """A maze of exactly this many wall segments, the robot at its start with nothing near."""
    maze = generate(replace_rows(SCENES[segments], segments), 1)
    walls = [tuple(wall) for wall in maze.walls.tolist()]
    while len(walls) < segments:
        walls.sort(key=lambda wall: math.dist(wall[:2], wall[2:]))
        ax, ay, bx, by = walls.pop()
        middle = ((ax + bx) / 2, (ay + by) / 2)
        walls += [(ax, ay, *middle), (*middle, bx, by)]
    return replace(maze, walls=np.asarray(walls), time_limit=math.inf)


def replace_rows(recipe: Recipe, segments: int) -> Recipe:
    """A recipe with fewer rows until its maze has no more walls than wanted."""
    while len(generate(recipe, 1).walls) > segments:
        recipe = recipe.model_copy(update={"rows": recipe.rows - 1})
    return recipe


def turns(methods: dict[str, Callable[[], object]], rounds: int) -> dict[str, float]:
    """Median processor time of each method, s, with the methods taking turns."""
    took: dict[str, list[float]] = {name: [] for name in methods}
    for method in methods.values():
        method()
    for _ in range(rounds):
        for name, method in methods.items():
            began = time.thread_time()
            method()
            took[name].append(time.thread_time() - began)
    return {name: median(times) for name, times in took.items()}


def by_pymunk(walls: Segments, pose: Pose) -> Callable[[], object]:
    space = pymunk.Space()
    for ax, ay, bx, by in walls.tolist():
        space.add(pymunk.Segment(space.static_body, (ax, ay), (bx, by), 0.0))
    space.step(0.01)
    angles = GEOMETRY.angles() + pose.heading
    ends = np.stack([pose.x + 10 * np.cos(angles), pose.y + 10 * np.sin(angles)], axis=1).tolist()
    everything = pymunk.ShapeFilter()
    return lambda: [space.segment_query_first((pose.x, pose.y), tuple(end), 0.0, everything) for end in ends]


def by_shapely(walls: Segments, pose: Pose) -> Callable[[], object]:
    lines = shapely.linestrings(walls.reshape(-1, 2, 2))
    tree = shapely.STRtree(lines)
    angles = GEOMETRY.angles() + pose.heading
    here = np.array([pose.x, pose.y])
    ends = here + 10 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    beams = shapely.linestrings(np.stack([np.tile(here, (len(angles), 1)), ends], axis=1))

    def scan() -> object:
        which, wall = tree.query(beams, predicate="intersects")
        away = shapely.distance(shapely.Point(here), shapely.intersection(beams[which], lines[wall]))
        ranges = np.full(len(angles), np.inf)
        np.minimum.at(ranges, which, away)
        return ranges

    return scan


def noisy(kernel: Kernel | None, maze: Maze) -> Callable[[], object]:
    lidar, noise = Lidar(GEOMETRY, kernel=kernel), LaserNoise()
    generator = np.random.Generator(np.random.PCG64(1))

    def scan() -> None:
        for _ in range(REPEATS):
            disturbed(lidar.ranges(maze.walls, maze.start.pose), noise, GEOMETRY, generator)

    return scan


def scans(rounds: int) -> None:
    """One scan with uniform noise, by method and number of segments."""
    print(f"One scan of {GEOMETRY.beams} beams, ms (rows marked * without noise)")
    print(f"{'method':24}" + "".join(f"{count:>8} segments" for count in SCENES))
    rows: dict[str, list[float]] = {}
    for count in SCENES:
        maze = scene(count)
        pose = maze.start.pose
        project = TWINS["sim.project"]
        methods = {"numpy": noisy(project.plain, maze), "pymunk, a query a beam *": by_pymunk(maze.walls, pose)}
        methods["shapely STRtree *"] = by_shapely(maze.walls, pose)
        if project.fast is not None:
            methods = {"compiled": noisy(project.fast, maze), **methods}
        for name, seconds in turns(methods, rounds).items():
            each = seconds / (1 if name.endswith("*") else REPEATS)
            rows.setdefault(name, []).append(1e3 * each)
    for name, times in rows.items():
        print(f"{name:24}" + "".join(f"{value:>17.4f}" for value in times))


def ticker(maze: Maze, robots: list[RobotDescription]) -> Callable[[], object]:
    simulation = Simulation(maze, robots, seed=1)
    commands = {robot.name: Command(ABOUT) for robot in robots}

    def run() -> None:
        for _ in range(TICKS):
            simulation.step(commands)
        assert not simulation.verdict().finished, simulation.verdict().line()

    return run


def crowd(maze: Maze, count: int) -> Maze:
    """The same maze with starts for many robots: the centres of its cells nearest to the first."""
    left, bottom, right, top = maze.bounds
    cells = [(x + 0.5, y + 0.5) for x in range(int(right - left)) for y in range(int(top - bottom))]
    first = maze.start.pose
    near = sorted(cells, key=lambda cell: (math.dist(cell, maze.start_point), cell))[1:count]
    return replace(maze, others=tuple(Start(Pose(x, y, first.heading)) for x, y in near))


class IrSim:
    """ir-sim in a process of its own, with the same walls, laser, noise and period."""

    def __init__(self, python: str, maze: Maze) -> None:
        pose = maze.start.pose
        scene = {
            "walls": maze.walls.tolist(),
            "state": [pose.x, pose.y, pose.heading],
            "action": [ABOUT.forward, ABOUT.turn],
        }
        self._worker = subprocess.Popen(
            [python, str(Path(__file__).with_name("irsim_worker.py"))],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            cwd=tempfile.gettempdir(),
        )
        assert self._worker.stdin is not None
        assert self._worker.stdout is not None
        self._worker.stdin.write(json.dumps(scene) + "\n")
        self.ticks(1)

    def ticks(self, count: int) -> float:
        """Seconds of its processor time for this many ticks."""
        assert self._worker.stdin is not None
        assert self._worker.stdout is not None
        self._worker.stdin.write(f"{count}\n")
        self._worker.stdin.flush()
        while True:
            line = self._worker.stdout.readline()
            if not line:
                raise RuntimeError("ir-sim ended")
            if line.startswith("took "):
                return float(line.split()[1])

    def close(self) -> None:
        """End the process."""
        self._worker.terminate()
        self._worker.wait()


def ticks(rounds: int, irsim: str | None) -> None:
    """A whole tick of 0.1 s: ten physics steps, laser, noise, odometry, referee."""
    print("\nA tick of 0.1 s with everything: simulated time over processor time")
    worlds = {f"{count} segments": (scene(count), [RobotDescription()]) for count in SCENES}
    large = replace(generate(Recipe(columns=32, rows=32, loops=20), 1), time_limit=math.inf)
    worlds[f"32x32 cells ({len(large.walls)} segments)"] = large, [RobotDescription()]
    ten = [RobotDescription(name=f"pico{index}") for index in range(10)]
    many = replace(generate(Recipe(columns=8, rows=8, loops=8), 1), time_limit=math.inf)
    worlds[f"ten robots, {len(many.walls)} segments"] = crowd(many, 10), ten
    ours = {name: ticker(maze, robots) for name, (maze, robots) in worlds.items()}
    peers = {name: IrSim(irsim, worlds[name][0]) for name in list(worlds)[:2]} if irsim else {}
    took: dict[str, list[float]] = {name: [] for name in ours}
    theirs: dict[str, list[float]] = {name: [] for name in peers}
    for _ in range(rounds):
        for name, run in ours.items():
            began = time.thread_time()
            run()
            took[name].append((time.thread_time() - began) / TICKS)
            if name in peers:
                theirs[name].append(peers[name].ticks(3) / 3)
    for peer in peers.values():
        peer.close()
    print(f"{'world':32}{'ms a tick':>10}{'x real time':>13}{'ir-sim':>9}{'ratio':>8}")
    for name, times in took.items():
        each = median(times)
        beside = f"{0.1 / median(theirs[name]):>9.1f}{median(theirs[name]) / each:>8.0f}" if name in theirs else ""
        print(f"{name:32}{1e3 * each:>10.3f}{0.1 / each:>13.0f}{beside}")


def long_run(seconds: float) -> None:
    """Speed and memory over a long simulated time."""
    maze = scene(50)
    simulation = Simulation(maze, seed=1)
    print(f"\n{seconds:.0f} s of simulated time in one run")
    print(f"{'until, s':>10}{'x real time':>13}{'resident, MB':>14}")
    parts = 6
    for part in range(1, parts + 1):
        count = round(seconds / parts * 10)
        began = time.thread_time()
        for _ in range(count):
            simulation.step(Command(ABOUT))
        speed = count / 10 / (time.thread_time() - began)
        print(f"{part * seconds / parts:>10.0f}{speed:>13.0f}{_resident():>14.1f}")


def _resident() -> float:
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * resource.getpagesize() / 1e6


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--irsim", metavar="PYTHON")
    arguments = parser.parse_args()
    rounds = 5 if arguments.quick else 31
    scans(rounds)
    ticks(rounds, arguments.irsim)
    long_run(60.0 if arguments.quick else 3600.0)


if __name__ == "__main__":
    main()
