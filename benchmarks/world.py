"""How well the robot knows where it is and what it has seen.

    python benchmarks/world.py logs [--json] FILE...      laser logs in CARMEN's format, plain or compressed by gzip
    python benchmarks/world.py simulator [--json] [--mazes NAME...] [--limit S]      tremaux in the simulator
    python benchmarks/world.py faults [--json] [--mazes NAME...] [--count N]      explorer, disturbed
    python benchmarks/world.py lasers [--mazes NAME...] [--limit S]      other bases and lasers
    python benchmarks/world.py cost [--mazes NAME...] [--limit S]      time a tick by size of the map

`logs` reads the increments of raw odometry and the scans, nothing else, with one set of thresholds, and compares the
trajectory with the corrected poses that the log holds. Those come from a mapper, too: they are a reference, not the
truth. A line has the fields

    log             the file's name
    raw             absolute trajectory error of raw odometry, m
    ate             that of the map's poses at the end, m
    without_loops   that of scan matching alone, m
    largest         the map's largest deviation, m

The absolute trajectory error is the root mean square distance of the positions after the rigid motion that makes it
smallest (Sturm et al., "A benchmark for the evaluation of RGB-D SLAM systems", 2012).

`simulator` drives tremaux for 420 s, by default in final_2015, five contest mazes and five generated ones with skewed
walls, each with standard odometry and with a bad one (wheels 3 % off, 20 % slip). Two perceptions see the same: one
that keeps a map and one that does not, the baseline. All is in the frame of the first pose, in which the robot does not
know its future: no alignment afterwards.

    rms, largest    deviation of the position, m
    heading         root mean square deviation of the heading, degrees
    baseline        deviation of the position by dead reckoning with the compass, root mean square, m
    keyframes       in the map at the end
    loops, false    closed; and of them those more than 0.3 m from the truth
    nees            squared deviation of the last pose over its covariance, per degree of freedom
    tick            processor time of perception with its map, mean, ms; `worst` the worst, ms

`lasers` drives tremaux on both bases with lasers of 180 to 1500 beams and 3.5 to 12 m; a line has the fields of
`simulator`.

`cost` drives tremaux and prints for each hundred keyframes of the map the processor time of perception with its map, a
tick: the mean, what 99 of 100 ticks stay below, and the worst, ms.

`faults` lets something go wrong in the middle of a run of explorer, drawn from the run's number: odometry jumps by up
to 1 m and 90 degrees, the laser is blind for 5 s, or the robot is carried to another place. A line has the fields

    answered        time from the fault until the place is known within 3 cm or `place.lost` is true, s
    wrong           longest time for which the place was said to be known and was wrong by more than 0.2 m, s
    found           time from `place.lost` until the place is known again, s; empty where that was not
    off             deviation of the position at the end, m, where the place is known
    outcome         how the machine ended, or who ended the run
"""

from __future__ import annotations

import argparse
import gc
import json
import math
import sys
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, field, replace
from itertools import accumulate
from pathlib import Path
from time import process_time

import numpy as np

# Before the folder of the benchmarks, where a script has the name of a package.
sys.path.insert(0, str(Path(__file__).parents[1]))

from maze_machine.catalogue.profile import Profile, load_profile
from maze_machine.drive.mission import Ending, drive, prepare
from maze_machine.drive.tick import Tick
from maze_machine.simulated.world import SimulatedWorld, find_maze
from perception import Perception
from perception.mapping import Mapper, MappingSettings, cloud_of
from perception.mapping.confidence import Knowledge
from perception.mapping.frames import between, compose
from perception.sweep import ScanPoints
from sim.faults import Carried, Fault, LaserBlinded, OdometryJump
from sim.generate import Recipe, generate
from sim.geometry import distances
from sim.maze import Maze
from sim.settings import OdometryNoise, SimulatorSettings
from tests.perception import carmen
from transport.description import RobotDescription
from transport.messages import Pose
from transport.world import LockstepRobot

CONTEST = Path(__file__).parents[1].parent / "shared" / "data" / "mazes" / "micromouse"
MAZES = ("final_2015", "iee88", "japan1989", "us91", "taisho", "uk1987f", *(f"skewed{seed}" for seed in range(1, 6)))
ODOMETRY = {"standard": OdometryNoise(), "bad": OdometryNoise(scale=0.03, slip=0.2)}
FALSE = 0.3
"""A loop farther from the truth than this is false, m."""


@dataclass(frozen=True, slots=True)
class LogResult:
    """The result for a log; lengths in m, the fields as in the module's description."""

    log: str
    raw: float
    ate: float
    without_loops: float
    largest: float


def map_of(records: Sequence[carmen.Record], settings: MappingSettings) -> tuple[list[Pose], list[Pose]]:
    """The pose at each scan, with loops closed and by scan matching alone."""
    mapper = Mapper(settings)
    places: list[tuple[int, Pose]] = []
    for number, record in enumerate(records):
        if number:
            mapper.move(record.step)
        sweep = ScanPoints.of(record.scan, record.robot.laser.mount)
        mapper.see(cloud_of(sweep, settings.cloud), measured=not number or record.step is not None)
        mapper.work(sys.maxsize)
        places.append((len(mapper.clouds) - 1, mapper.offset))
    mapper.finish()
    chain = list(accumulate((link.measured for link in mapper.graph.steps), compose, initial=Pose()))
    closed = [compose(mapper.graph.poses[keyframe], offset) for keyframe, offset in places]
    return closed, [compose(chain[keyframe], offset) for keyframe, offset in places]


def errors(poses: Sequence[Pose], reference: Sequence[Pose]) -> tuple[float, float]:
    """Absolute trajectory error and largest deviation after the best rigid motion, m."""
    here, there = (np.array([(pose.x, pose.y) for pose in one]).T for one in (poses, reference))
    here, there = here - here.mean(axis=1)[:, None], there - there.mean(axis=1)[:, None]
    turn = math.atan2(
        float(np.sum(here[0] * there[1] - here[1] * there[0])), float(np.sum(here[0] * there[0] + here[1] * there[1]))
    )
    cosine, sine = math.cos(turn), math.sin(turn)
    apart = np.hypot(here[0] * cosine - here[1] * sine - there[0], here[0] * sine + here[1] * cosine - there[1])
    return math.sqrt(float(np.mean(apart * apart))), float(apart.max())


def log_result(file: Path, settings: MappingSettings) -> LogResult:
    """Map a log and compare.

    Raises:
        carmen.LogError: the file cannot be read or holds no scans.
    """
    records = carmen.read_log(file)
    reference = [record.corrected for record in records]
    raw = list(accumulate((record.step or Pose() for record in records[1:]), compose, initial=Pose()))
    closed, chain = map_of(records, settings)
    ate, largest = errors(closed, reference)
    return LogResult(file.name, errors(raw, reference)[0], ate, errors(chain, reference)[0], largest)


def logs(files: Iterable[Path], *, as_json: bool) -> None:
    """Print a line for each log."""
    if not as_json:
        print(f"{'log':32} {'raw':>8} {'ate':>8} {'without_loops':>14} {'largest':>8}   m")
    for file in files:
        result = log_result(file, MappingSettings())
        if as_json:
            fields = asdict(result)
            name = fields.pop("log")
            print(json.dumps({"log": name, **{key: round(value, 4) for key, value in fields.items()}}), flush=True)
        else:
            numbers = f"{result.raw:8.3f} {result.ate:8.3f} {result.without_loops:14.3f} {result.largest:8.3f}"
            print(f"{result.log:32} {numbers}", flush=True)


@dataclass(frozen=True, slots=True)
class RunResult:
    """The result of a run in the simulator; the fields as in the module's description."""

    maze: str
    odometry: str
    ticks: int
    rms: float
    largest: float
    heading: float
    baseline: float
    keyframes: int
    loops: int
    false: int
    nees: float
    tick: float
    worst: float


@dataclass(slots=True)
class Observer:
    """Sees what the robot sees, with a map and without one, and knows the truth."""

    world: SimulatedWorld
    robot: RobotDescription
    mapping: Perception = field(init=False)
    baseline: Perception = field(init=False)
    off: list[Pose] = field(default_factory=list)
    baseline_off: list[Pose] = field(default_factory=list)
    truth: list[Pose] = field(default_factory=list)
    times: list[float] = field(default_factory=list)
    sizes: list[int] = field(default_factory=list)
    _first: tuple[Pose, Pose, Pose] | None = None

    def __post_init__(self) -> None:
        self.mapping, self.baseline = Perception(self.robot), Perception(self.robot)

    @property
    def mapper(self) -> Mapper:
        """The map."""
        assert self.mapping.world.surveyor is not None
        return self.mapping.world.surveyor.mapper

    def __call__(self, tick: Tick) -> None:
        """Look at a tick."""
        began = process_time()
        facts = self.mapping.facts(tick.observation)
        self.mapping.world.begin_map(facts.sweep)
        self.times.append(process_time() - began)
        self.sizes.append(len(self.mapper.clouds))
        self.baseline.facts(tick.observation)
        here, mapped, reckoned = self.world.pose(tick.index), self.mapping.world.pose, self.baseline.world.pose
        self._first = self._first or (here, mapped, reckoned)
        driven = between(self._first[0], here)
        self.off.append(between(driven, between(self._first[1], mapped)))
        self.baseline_off.append(between(driven, between(self._first[2], reckoned)))
        if len(self.truth) < len(self.mapper.clouds):
            self.truth.append(here)

    def false_loops(self) -> int:
        """How many loops are far from the truth."""
        off = (
            between(between(self.truth[loop.first], self.truth[loop.second]), loop.measured)
            for loop in self.mapper.graph.loops
        )
        return sum(math.hypot(one.x, one.y) > FALSE for one in off)

    def nees(self) -> float:
        """The last keyframe's squared deviation from the first one over the covariance, per degree of freedom."""
        graph, last = self.mapper.graph, len(self.truth) - 1
        if not last:
            return math.nan
        covariance = self.mapper.certainties()[last]
        true = between(self.truth[0], self.truth[last])
        found = between(graph.poses[0], graph.poses[last])
        turn = math.remainder(found.heading - true.heading, math.tau)
        return covariance.inverse().square(found.x - true.x, found.y - true.y, turn) / 3


def root_mean_square(values: Iterable[float]) -> float:
    """The root of the mean of the squares."""
    squares = [value * value for value in values]
    return math.sqrt(math.fsum(squares) / len(squares))


def maze_of(name: str) -> Maze:
    """A maze by its name: a shipped one, one of the contest's, or `skewed` with a seed; without its time limit."""
    if name.startswith("skewed"):
        maze = generate(Recipe(columns=12, rows=12, loops=3, skew=6.0, offset=0.1), int(name.removeprefix("skewed")))
    elif (CONTEST / f"{name}.txt").exists():
        maze = find_maze(str(CONTEST / f"{name}.txt"), robot=RobotDescription())
    else:
        maze = find_maze(name, robot=RobotDescription())
    return replace(maze, time_limit=math.inf)


def observed(name: str, odometry: str, limit: float, profile: Profile, seed: int = 0) -> tuple[Observer, Ending]:
    """Drive tremaux, and watch."""
    world = SimulatedWorld(maze_of(name), profile.robot, seed, SimulatorSettings(odometry=ODOMETRY[odometry]))
    observer = Observer(world, profile.robot)
    robot = LockstepRobot(world)
    gc.collect()
    return observer, drive(prepare("tremaux", profile, time_limit=limit), robot, robot, [observer])


def run_result(name: str, odometry: str, limit: float, profile: Profile | None = None) -> RunResult:
    """Drive tremaux and compare."""
    observer, ending = observed(name, odometry, limit, profile or load_profile())
    apart = [math.hypot(off.x, off.y) for off in observer.off]
    return RunResult(
        maze=Path(name).stem,
        odometry=odometry,
        ticks=ending.ticks,
        rms=root_mean_square(apart),
        largest=max(apart),
        heading=math.degrees(root_mean_square(off.heading for off in observer.off)),
        baseline=root_mean_square(math.hypot(off.x, off.y) for off in observer.baseline_off),
        keyframes=len(observer.truth),
        loops=len(observer.mapper.graph.loops),
        false=observer.false_loops(),
        nees=observer.nees(),
        tick=1000 * math.fsum(observer.times) / len(observer.times),
        worst=1000 * max(observer.times),
    )


def simulator(mazes: Iterable[str], limit: float, *, as_json: bool) -> None:
    """Print a line for each maze and odometry."""
    if not as_json:
        print("maze         odometry  ticks    rms largest heading baseline keyframes loops false  nees  tick worst")
    for name in mazes:
        for odometry in ODOMETRY:
            result = run_result(name, odometry, limit)
            if as_json:
                fields = asdict(result)
                rounded = {key: round(value, 4) if isinstance(value, float) else value for key, value in fields.items()}
                print(json.dumps(rounded), flush=True)
                continue
            print(
                f"{result.maze:12} {odometry:8} {result.ticks:6} {result.rms:6.4f} {result.largest:7.4f}"
                f" {result.heading:7.3f} {result.baseline:8.3f} {result.keyframes:9} {result.loops:5} {result.false:5}"
                f" {result.nees:5.2f} {result.tick:5.2f} {result.worst:5.1f}",
                flush=True,
            )


BASES = ("holonomic", "differential")
LASERS = {
    "180 beams, 180 deg, 10 m": ("beams=180", "angle_min=-1.5708", "angle_max=1.5708"),
    "180 beams, all round, 3.5 m": ("beams=180", "angle_min=-3.1416", "angle_max=3.1066", "range_max=3.5"),
    "360 beams, all round, 3.5 m": ("beams=360", "angle_min=-3.1416", "angle_max=3.1241", "range_max=3.5"),
    "720 beams, all round, 8 m": ("beams=720", "angle_min=-3.1416", "angle_max=3.1328", "range_max=8"),
    "1000 beams, 229 deg, 10 m": (),
    "1500 beams, all round, 12 m": ("beams=1500", "angle_min=-3.1416", "angle_max=3.1374", "range_max=12"),
}
"""By what they are called: how they differ from PICO's."""


def lasers(mazes: Iterable[str], limit: float) -> None:
    """Print a line for each base, laser and maze."""
    print("base          laser                         maze        ticks    rms largest heading false  tick worst")
    for base in BASES:
        for laser, differences in LASERS.items():
            profile = load_profile(overrides=[f"robot.base={base}", *(f"robot.laser.{one}" for one in differences)])
            for name in mazes:
                result = run_result(name, "standard", limit, profile)
                print(
                    f"{base:13} {laser:29} {result.maze:10} {result.ticks:6} {result.rms:6.4f} {result.largest:7.4f}"
                    f" {result.heading:7.3f} {result.false:5} {result.tick:5.2f} {result.worst:5.1f}",
                    flush=True,
                )


SIZE = 100
"""Maps are sorted by how often they hold this many keyframes."""


def cost(mazes: Iterable[str], limit: float) -> None:
    """Print a line for each maze and size of the map."""
    print("maze          keyframes   ticks    mean     99%   worst   ms")
    for name in mazes:
        observer, _ = observed(name, "standard", limit, load_profile())
        times, sizes = 1000 * np.array(observer.times), np.array(observer.sizes) // SIZE
        for size in np.unique(sizes).tolist():
            these = times[sizes == size]
            print(
                f"{Path(name).stem:12} {SIZE * size:5}-{SIZE * size + SIZE - 1:<5} {len(these):7} {these.mean():7.2f}"
                f" {np.quantile(these, 0.99):7.2f} {these.max():7.2f}",
                flush=True,
            )


FAULTS = ("odometry_jump", "laser_blinded", "carried")
"""What goes wrong, one after the other."""
AFTER = 45.0
"""A run goes on for this long after its fault, s."""
CLEAR = 0.45
"""A robot is placed no nearer to a wall than this, m."""
RIGHT, WRONG = 0.03, 0.2
"""A place is right up to here, and wrong from there on, m."""


def drawn_fault(kind: str, maze: Maze, number: int) -> Fault:
    """A fault of a kind, drawn from a number."""
    rng = np.random.default_rng(number)
    at = round(float(rng.uniform(12.0, 25.0)), 1)
    if kind == "laser_blinded":
        return LaserBlinded(at=at, lasts=5.0)
    if kind == "odometry_jump":
        way, direction, turn = rng.uniform((0.0, -math.pi, -math.pi / 2), (1.0, math.pi, math.pi / 2)).tolist()
        return OdometryJump(at=at, by=(way * math.cos(direction), way * math.sin(direction), turn))
    low, high = maze.walls.reshape(-1, 2).min(axis=0), maze.walls.reshape(-1, 2).max(axis=0)
    while True:
        x, y = rng.uniform(low, high).tolist()
        if float(distances(np.array([[x, y]]), maze.barriers).min()) > CLEAR:
            return Carried(at=at, to=(x, y, float(rng.uniform(-math.pi, math.pi))))


@dataclass(frozen=True, slots=True)
class FaultResult:
    """The result of a run with a fault; the fields as the module describes them."""

    maze: str
    fault: str
    number: int
    answered: float
    wrong: float
    found: float | None
    off: float | None
    outcome: str


@dataclass(slots=True)
class Witness:
    """Compares the robot's estimated place with the truth, from a fault on."""

    world: SimulatedWorld
    began: float
    answered: float = math.inf
    wrong: float = 0.0
    lost: float | None = None
    found: float | None = None
    off: float | None = None
    _wrong_since: float | None = None
    _first: tuple[Pose, Pose] | None = None

    def __call__(self, tick: Tick) -> None:
        """Look at a tick."""
        assert tick.facts is not None
        model, here = tick.facts.world, self.world.pose(tick.index)
        if model.surveyor is None:
            return
        # The machine begins the map in the first tick, where its frame is fixed.
        self._first = self._first or (here, model.pose)
        off = between(between(self._first[0], here), between(self._first[1], model.pose))
        apart, now = math.hypot(off.x, off.y), tick.time
        known, lost = model.place_known, model.surveyor.knowledge is Knowledge.LOST
        self.off = apart if known else None
        wrong = known and apart > WRONG
        self._wrong_since = (now if self._wrong_since is None else self._wrong_since) if wrong else None
        if self._wrong_since is not None:
            self.wrong = max(self.wrong, now - self._wrong_since)
        if now < self.began:
            return
        if math.isinf(self.answered) and (lost or (known and apart <= RIGHT and now > self.began)):
            self.answered = now - self.began
        if lost and self.lost is None:
            self.lost = now
        if known and self.lost is not None and self.found is None:
            self.found = now - self.lost


def fault_result(name: str, number: int) -> FaultResult:
    """Drive explorer, disturb its place, and compare."""
    profile, maze, kind = load_profile(), maze_of(name), FAULTS[number % len(FAULTS)]
    fault = drawn_fault(kind, maze, number)
    world = SimulatedWorld(maze, profile.robot, number, SimulatorSettings(faults=(fault,)))
    witness = Witness(world, fault.at)
    robot = LockstepRobot(world)
    mission = prepare("explorer", profile, time_limit=fault.at + AFTER)
    ending = drive(mission, robot, robot, [witness])
    outcome = ending.outcome or ending.reason
    return FaultResult(name, kind, number, witness.answered, witness.wrong, witness.found, witness.off, outcome)


def faults(mazes: Sequence[str], count: int, *, as_json: bool) -> None:
    """Print a line for each fault, and how many were answered late or left a wrong place known."""
    late = wrong = 0
    for number in range(count):
        result = fault_result(mazes[number // len(FAULTS) % len(mazes)], number)
        late, wrong = late + (result.answered > 2.0), wrong + (result.wrong > 2.0)
        if as_json:
            print(json.dumps(asdict(result)), flush=True)
            continue
        found, off = (f"{value:6.2f}" if value is not None else "     -" for value in (result.found, result.off))
        times = f"{result.answered:6.1f} {result.wrong:6.1f} {found} {off}"
        print(f"{result.number:4} {result.maze:12} {result.fault:14} {times}  {result.outcome}", flush=True)
    if not as_json:
        print(
            f"{count} faults: {late} answered after more than 2 s, {wrong} with a wrong place known for more than 2 s"
        )


def main() -> int:
    """Do what is asked for; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    what = parser.add_subparsers(dest="what", required=True)
    of_logs = what.add_parser("logs", help="absolute trajectory error on laser logs")
    of_logs.add_argument("files", nargs="+", type=Path, metavar="FILE")
    of_logs.add_argument("--json", action="store_true", dest="as_json", help="a line of JSON each")
    of_runs = what.add_parser("simulator", help="deviation from the truth in the simulator")
    of_runs.add_argument("--mazes", nargs="+", default=MAZES, metavar="NAME", help="shipped, contest, or skewedSEED")
    of_runs.add_argument("--limit", type=float, default=420.0, metavar="S", help="length of a run, s")
    of_runs.add_argument("--json", action="store_true", dest="as_json", help="a line of JSON each")
    of_lasers = what.add_parser("lasers", help="other bases and lasers in the simulator")
    of_lasers.add_argument("--mazes", nargs="+", default=("skewed1",), metavar="NAME", help="shipped, or skewedSEED")
    of_lasers.add_argument("--limit", type=float, default=120.0, metavar="S", help="length of a run, s")
    of_cost = what.add_parser("cost", help="time a tick by size of the map")
    of_cost.add_argument("--mazes", nargs="+", default=("skewed1",), metavar="NAME", help="shipped, or skewedSEED")
    of_cost.add_argument("--limit", type=float, default=1200.0, metavar="S", help="length of a run, s")
    of_faults = what.add_parser("faults", help="what becomes of the place where something goes wrong")
    of_faults.add_argument("--mazes", nargs="+", default=MAZES, metavar="NAME", help="shipped, contest, or skewedSEED")
    of_faults.add_argument("--count", type=int, default=200, metavar="N", help="number of runs")
    of_faults.add_argument("--json", action="store_true", dest="as_json", help="a line of JSON each")
    arguments = parser.parse_args()
    if arguments.what == "faults":
        faults(arguments.mazes, arguments.count, as_json=arguments.as_json)
        return 0
    if arguments.what == "lasers":
        lasers(arguments.mazes, arguments.limit)
        return 0
    if arguments.what == "cost":
        cost(arguments.mazes, arguments.limit)
        return 0
    if arguments.what == "simulator":
        simulator(arguments.mazes, arguments.limit, as_json=arguments.as_json)
        return 0
    try:
        logs(arguments.files, as_json=arguments.as_json)
    except carmen.LogError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
