"""What the shipped machines can do: hundreds of mazes and corridors drawn by seed, and the contest mazes.

    python benchmarks/machines.py draw FOLDER [--count N] [--first SEED] [--size S]    draw the mazes and the corridors
    python benchmarks/machines.py run FOLDER [SET ...] [--skip N] [--count N] [--workers N] [--machine NAME ...]
                                                       [--robot PROFILE] [--set KEY=VALUE ...] [--cell METRES]
    python benchmarks/machines.py show FOLDER                               the tables of what has been run

`draw` varies all that the generator offers by seed: cells, corridors' width, loops, islands, open spaces, dead ends,
doors, skew, offset. A maze with a passage narrower than 0.6 m is drawn again. With `--size` all of them are as many
times as large, for a robot of another size; `--cell` is the edge of a contest maze's cell. `run` is `maze-machine
sweep` over the sets below; a set is a results file in the folder, and one that was interrupted continues where it was.
With `--skip` and `--count` only some mazes of a set are taken: the first ones are left out, or all after the first N.
Laser noise, odometry drift and the referee are on; time limits are lifted to those of `SETS`.
"""

from __future__ import annotations

import argparse
import json
import math
import re
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median, quantiles

import numpy as np

# Before the folder of the benchmarks, where a script has the name of a package.
sys.path.insert(0, str(Path(__file__).parents[1]))

from maze_machine.campaign.jobs import Record, Setup, jobs_of
from maze_machine.campaign.results import Results
from maze_machine.campaign.workers import on_cores
from maze_machine.simulated.choices import MazeWords
from maze_machine.simulated.world import find_maze
from sim.corridors import corridor, random_corridor
from sim.formats import write_maze
from sim.generate import Recipe, generate
from sim.geometry import distances
from sim.maze import Maze, MazeError
from sim.scaled import scaled
from sim.solvability import LARGEST, shortest_way
from transport.description import RobotDescription

DATA = Path(__file__).parents[1].parent / "shared" / "data" / "mazes"
NARROWEST = 0.6
"""A maze has no passage narrower than this, m."""
WIDE = 0.8
"""From this width on a robot has to keep its distance to the walls, m, in a maze of PICO's size."""
CRUISE = 0.5
"""The robot's speed, m/s."""
SOLVERS = ("pledge", "pledge_smooth", "tremaux")
CORRIDORS = ("corridor_2015", "corridor_2017")


@dataclass(frozen=True)
class Set:
    """Machines to be driven through mazes.

    Attributes:
        machines: their names.
        mazes: a folder in the folder of the benchmark, or else files.
        seeds: how many.
        time_limit: s; None for the mazes' own.
        count: how many mazes; None for all.
    """

    machines: Sequence[str]
    mazes: str | tuple[str, ...]
    seeds: int = 1
    time_limit: float | None = None
    count: int | None = None


SETS = {
    "mazes": Set(SOLVERS, "mazes", time_limit=3600.0),
    "corridors": Set(CORRIDORS, "corridors"),
    "contest": Set(("pledge", "pledge_smooth"), (str(DATA / "micromouse"),), time_limit=36000.0),
    "contest_tremaux": Set(("tremaux",), (str(DATA / "micromouse"),), time_limit=36000.0),
    "dynamic": Set(SOLVERS, ("dynamic",), seeds=10),
    "challenge": Set(SOLVERS, ("final_2015", str(DATA / "emc" / "heightmap_maze_legacy.pgm")), seeds=10),
    "right_hand": Set(("right_hand", "right_hand_loop"), "mazes", time_limit=600.0, count=100),
    "mouse": Set(("random_mouse",), "mazes", time_limit=600.0, count=30),
}


def recipe_of(generator: np.random.Generator) -> Recipe:
    """Draw what a maze shall be like."""
    doors = int(generator.choice(3, p=(0.4, 0.5, 0.1)))
    corridor = round(float(generator.uniform(0.65, 1.5 if doors else 1.8)), 2)
    crooked, shifted = generator.random(2) < 0.6
    return Recipe(
        columns=int(generator.integers(3, 9)),
        rows=int(generator.integers(3, 8)),
        corridor=corridor,
        loops=int(generator.integers(0, 4)),
        islands=int(generator.choice(3, p=(0.5, 0.35, 0.15))),
        open_spaces=int(generator.choice(3, p=(0.5, 0.35, 0.15))),
        dead_ends=round(float(generator.random()), 2),
        doors=doors,
        skew=round(float(generator.uniform(0, 4)), 1) if crooked else 0.0,
        offset=round(float(generator.uniform(0, min(0.2, corridor / 4))), 3) if shifted else 0.0,
    )


def random_maze(seed: int) -> Maze:
    """The maze of a seed: recipes are drawn until one can be built without a passage too narrow."""
    generator = np.random.Generator(np.random.PCG64(seed))
    while True:
        try:
            maze = generate(recipe_of(generator), seed)
        except MazeError:  # too many islands, doors or open spaces for that few cells
            continue
        if narrowest(maze) >= NARROWEST:
            return replace(maze, time_limit=math.inf)


def narrowest(maze: Maze) -> float:
    """Width of a maze's narrowest passage, m: from an end of a wall to the next wall that it does not touch."""
    away = distances(maze.walls.reshape(-1, 2), maze.walls)
    return float(away[away > 1e-3].min())


def draw(folder: Path, count: int, first: int, size: float) -> None:
    """Write the mazes and the corridors of the seeds, and beside them how narrow and how long each is."""
    known = {}
    for kind in ("mazes", "corridors"):
        (folder / kind).mkdir(parents=True, exist_ok=True)
        for seed in range(first, first + count):
            if kind == "mazes":
                maze = random_maze(seed)
                width = narrowest(maze)
            else:
                wanted = random_corridor(seed)
                maze = corridor(wanted, f"corridor {seed}")
                width = min(wanted.width, wanted.opening)
            file = folder / kind / f"{seed:04}.maze"
            way = shortest_way(maze, radius=RobotDescription().radius)
            write_maze(maze if size == 1 else scaled(maze, size), file)
            known[str(file)] = {"narrowest": round(size * width, 3), "way": size * way, "wide": size * WIDE}
    (folder / "known.json").write_text(json.dumps(known, indent=1))


def run(
    folder: Path,
    names: Iterable[str],
    skip: int,
    count: int | None,
    workers: int,
    *,
    setup: Setup,
    machines: Sequence[str],
) -> None:
    """Do what is still to be done of some sets, with a robot whose profile some settings override.

    Args:
        folder: of the mazes and the results.
        names: of the sets.
        skip: how many mazes are left out.
        count: how many mazes there are with those left out; None for all.
        workers: how many runs at a time.
        setup: the robot, its settings and the size of a cell.
        machines: those of each set to be run; empty for all.
    """
    plain = setup.robot == "pico" and not setup.settings
    variant = "" if plain else "@" + ",".join([setup.robot, *setup.settings])
    for name in names:
        chosen = SETS[name]
        if isinstance(chosen.mazes, str):
            least = min(one for one in (count, chosen.count, len(known(folder))) if one is not None)
            mazes: Sequence[str] = [str(file) for file in sorted((folder / chosen.mazes).iterdir())[skip:least]]
        else:
            mazes = chosen.mazes
        limited = replace(setup, time_limit=chosen.time_limit)
        driven = [one for one in chosen.machines if not machines or one in machines]
        file = folder / f"{'-'.join([name, *machines])}{variant}.jsonl"
        results = Results(file, limited, jobs_of(driven, mazes, chosen.seeds))
        # Maze by maze, so that what there is after an interruption can be compared.
        todo = sorted(results.open_jobs, key=lambda job: (job.maze, job.seed))
        print(f"{name}: {len(todo)} runs", flush=True)
        with on_cores(limited, todo, workers) as done:
            for record in done:
                results.add(record)
                if not record["solved"] and name not in {"right_hand", "mouse"}:
                    print(f"  {record}", flush=True)
        results.write()


def known(folder: Path) -> dict[str, dict[str, float]]:
    """What is known of the mazes drawn: `narrowest`, `way` and from which width on one is `wide`, m."""
    file = folder / "known.json"
    return json.loads(file.read_text()) if file.exists() else {}


def records_of(file: Path) -> list[Record]:
    """The runs of a results file."""
    return [json.loads(line) for line in file.read_text().splitlines()[1:]]


def show(folder: Path) -> None:
    """Print all tables as Markdown."""
    sizes = known(folder)
    for name in SETS:
        for file in sorted(one for one in folder.glob(f"{name}*.jsonl") if re.split("[@.-]", one.name)[0] == name):
            show_set(name, file, sizes)


def show_set(name: str, file: Path, sizes: dict[str, dict[str, float]]) -> None:
    """Print the tables of one results file."""
    records = records_of(file)
    print(f"\n### {file.stem}\n")
    refused = sorted({Path(one["maze"]).stem for one in records if "refused" in one})
    if refused:
        print(f"No way out: {', '.join(refused)}.\n")
    table(name, [one for one in records if "refused" not in one], sizes)
    if name in {"contest", "mazes"} and {"pledge", "pledge_smooth"} <= {one["machine"] for one in records}:
        faster([one for one in records if one["solved"]])
    if name == "right_hand":
        right_hand_and_theory(records)


def table(name: str, records: Sequence[Record], sizes: dict[str, dict[str, float]]) -> None:
    """One line a machine."""
    corridors = name == "corridors"
    wide = [f"clearance from {next((one['wide'] for one in sizes.values()), WIDE):g} m on"]
    heads = ["machine", "runs", "out", "touched", "clearance", *wide, "median time", "90%"]
    heads += ["time / (path / 0.5 m/s)", "time / (shortest way / 0.5 m/s)"] if corridors else []
    print(f"| {' | '.join(heads)} |\n|{'---|' * len(heads)}")
    for machine in dict.fromkeys(one["machine"] for one in records):
        runs = [one for one in records if one["machine"] == machine]
        out = [one for one in runs if one["solved"]]
        drawn = [(one, sizes.get(one["maze"], {"narrowest": math.inf, "wide": WIDE})) for one in runs]
        roomy = [one for one, size in drawn if size["narrowest"] >= size["wide"]]
        cells = [f"`{machine}`", len(runs), len(out), sum(bool(one.get("contacts")) for one in runs)]
        cells += [f"{least(runs):.3f} m", f"{least(roomy):.3f} m"]
        times = [one["time"] for one in out] or [math.nan]
        cells += [f"{median(times):.1f} s", f"{quantiles(times, n=10, method='inclusive')[-1]:.1f} s"]
        if corridors:
            cells.append(f"{median(one['time'] * CRUISE / one['path_length'] for one in out):.2f}")
            cells.append(f"{median(one['time'] * CRUISE / sizes[one['maze']]['way'] for one in out):.2f}")
        print(f"| {' | '.join(map(str, cells))} |")


def least(runs: Iterable[Record]) -> float:
    """The smallest clearance, m."""
    return min((one["clearance"] for one in runs if one.get("clearance") is not None), default=math.nan)


def right_hand_and_theory(records: Iterable[Record]) -> None:
    """Whether the right-hand rule leaves the mazes without doors whose first wall is joined to the outer one."""
    runs = [
        (find_maze(one["maze"], robot=RobotDescription()), one["solved"])
        for one in records
        if one["machine"] == "right_hand"
    ]
    for wanted, said in ((True, "joined to the outer one"), (False, "that of an island")):
        solved = [out for maze, out in runs if not maze.doors and first_wall_is_outer(maze) == wanted]
        print(f"\n`right_hand`, no door, the wall ahead is {said}: {sum(solved)} of {len(solved)} mazes left")


def first_wall_is_outer(maze: Maze) -> bool:
    """Whether the wall straight ahead of the start is joined to the exit's walls."""
    pose, walls = maze.start.pose, maze.walls
    along = np.arange(0.0, LARGEST, 0.02)[:, None]
    ray = np.array([pose.x, pose.y]) + along * np.array([math.cos(pose.heading), math.sin(pose.heading)])
    hit = distances(ray, walls) < 0.03
    joined = hit[int(hit.any(axis=1).argmax())]
    ends = walls.reshape(-1, 2)
    touching = (distances(ends, walls) < 1e-3).reshape(len(walls), 2, len(walls)).any(axis=1)
    touching |= touching.T
    for _ in walls:
        joined = joined | touching[joined].any(axis=0)
    return bool((distances(maze.exits.reshape(-1, 2), walls[joined]) < 1e-3).any())


def faster(solved: Sequence[Record]) -> None:
    """How much less time pledge_smooth takes than pledge over the mazes that both have left."""
    times = {
        machine: {(one["maze"], one["seed"]): one["time"] for one in solved if one["machine"] == machine}
        for machine in ("pledge", "pledge_smooth")
    }
    both = sorted(times["pledge"].keys() & times["pledge_smooth"].keys())
    if not both:
        return
    spent, smooth = (sum(times[machine][one] for one in both) for machine in ("pledge", "pledge_smooth"))
    shares = [times["pledge_smooth"][one] / times["pledge"][one] for one in both]
    print(
        f"\n`pledge` against `pledge_smooth`, {len(both)} runs: {spent:.0f} s and {smooth:.0f} s,"
        f" {spent / smooth - 1:.1%} faster ({1 - smooth / spent:.1%} less time);"
        f" of the single runs the median takes {1 - median(shares):.1%} less, the worst {1 - max(shares):.1%}"
    )


def main() -> None:
    """Draw, run or show."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("do", choices=("draw", "run", "show"))
    parser.add_argument("folder", type=Path)
    parser.add_argument("sets", nargs="*", default=list(SETS), metavar="SET", help=", ".join(SETS))
    parser.add_argument("--count", type=int, help="only the first N")
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--skip", type=int, default=0, help="leave out this many of the first mazes")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--size", type=float, default=1.0, help="the drawn mazes' size as a multiple of PICO's")
    parser.add_argument("--cell", type=float, default=1.0, help="the edge of a contest maze's cell, m")
    parser.add_argument("--machine", action="append", default=[], help="one of the sets' machines; may be repeated")
    parser.add_argument("--robot", default="pico", help="the robot's profile")
    parser.add_argument(
        "--set", action="append", default=[], help="a setting of the profile, such as robot.base=differential"
    )
    arguments = parser.parse_args()
    if arguments.do == "draw":
        draw(arguments.folder, arguments.count or 500, arguments.first, arguments.size)
    elif arguments.do == "run":
        run(
            arguments.folder,
            arguments.sets,
            arguments.skip,
            arguments.count,
            arguments.workers,
            setup=Setup(arguments.robot, tuple(arguments.set), maze=MazeWords(metres_a_cell=arguments.cell)),
            machines=arguments.machine,
        )
    else:
        show(arguments.folder)


if __name__ == "__main__":
    main()
