"""How accurate and how fast perception is, on generated scenes and on real laser logs, beside OpenCV and scikit-image.

    python benchmarks/perception.py            all tables
    python benchmarks/perception.py --quick    a tenth of the scenes

Scenes are made by seed: straight walls seen by 1000 beams from -2 to 2 rad with uniform noise of 1 cm. Times are
medians over the scenes of the best of three runs, in processor time of one thread, the methods of a table taking turns
on every scene. The peers are opencv-python-headless and scikit-image; where one is not installed, its rows are left
out. So are the rows of the real logs where the logs are absent.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

# Before the folder of the benchmarks, where this script has the name of a package.
sys.path.insert(0, str(Path(__file__).parents[1]))

from hsm.dsl import load_model
from hsm.model.expressions import SignalValue
from maze_machine.catalogue.library import robot_library
from maze_machine.catalogue.machines import shipped_machines
from perception import Facts, Perception, PerceptionSettings, WorldModel, signals
from perception.compass import compass_of
from perception.hough import hough_compass
from perception.junction import Junction
from perception.lines import find_lines, split
from perception.sweep import ScanPoints
from tests.perception import carmen, doors, junctions, mazes
from tests.perception.scenes import PICO, observation_of, observe, scan_of
from transport.messages import Observation, Pose

try:
    import cv2
except ImportError:
    cv2 = None
try:
    from skimage.transform import hough_line
except ImportError:
    hough_line = None

SETTINGS = PerceptionSettings()
RIGHT = math.pi / 2
PIXEL = 0.02


def processor_time(function: Callable[[], Any]) -> float:
    """What a call takes of the processor, ms."""
    start = time.thread_time_ns()
    function()
    return (time.thread_time_ns() - start) / 1e6


def timed(function: Callable[[], Any]) -> tuple[Any, float]:
    """A function's result and what it took at best of three, ms."""
    took = []
    for _ in range(3):
        start = time.thread_time_ns()
        result = function()
        took.append((time.thread_time_ns() - start) / 1e6)
    return result, min(took)


def fresh(facts: Facts, name: str) -> Any:
    """A fact computed again."""
    facts.__dict__.pop(name, None)
    return getattr(facts, name)


def whole_junction(facts: Facts) -> Junction:
    """The junction with all its parts, computed again."""
    found = fresh(facts, "junction")
    for part in ("kind", "end", "left_wall", "right_wall", "d2", "d3"):
        getattr(found, part)
    return found


def quantiles(values: list[float], *shares: float) -> list[float]:
    return [float(np.quantile(values, share)) if values else math.nan for share in shares]


def image_of(points: np.ndarray) -> np.ndarray:
    """The hits as pixels of 2 cm, for the peers."""
    half = round(10 / PIXEL)
    points = points[(np.abs(points) <= 10).all(axis=1)]
    image = np.zeros((2 * half + 1, 2 * half + 1), np.uint8)
    cells = np.rint(points / PIXEL).astype(int) + half
    image[cells[:, 1], cells[:, 0]] = 255
    return image


# --- compass ---


def by_lines(sweep: ScanPoints) -> float | None:
    lines = find_lines(sweep, split(sweep, SETTINGS.lines), SETTINGS.lines)
    compass = compass_of(lines, SETTINGS.compass)
    return compass.misalignment if compass.known else None


def by_hough(sweep: ScanPoints) -> float | None:
    compass = hough_compass(sweep.points, SETTINGS.hough, RIGHT)
    return compass.misalignment if compass.known else None


def by_opencv(sweep: ScanPoints) -> float | None:
    found = cv2.HoughLines(image_of(sweep.points), 1, math.pi / 180, 20)
    return None if found is None else float(found.reshape(-1, 2)[0, 1]) - RIGHT


def by_skimage(sweep: ScanPoints) -> float | None:
    angles = np.deg2rad(np.arange(-90, 90))
    votes, angles, _ = hough_line(image_of(sweep.points), theta=angles)
    return float(angles[np.unravel_index(votes.argmax(), votes.shape)[1]]) - RIGHT


COMPASSES: dict[str, Callable[[ScanPoints], float | None]] = {"end-point split, weighted least squares": by_lines}
COMPASSES["Hough transform, the seeds' way"] = by_hough
if cv2:
    COMPASSES["OpenCV HoughLines"] = by_opencv
if hough_line:
    COMPASSES["scikit-image hough_line"] = by_skimage


def compass(count: int) -> None:
    rng = np.random.default_rng(1)
    errors, times = defaultdict(list), defaultdict(list)
    for _ in range(count):
        walls, pose = mazes.place(rng)
        scan = scan_of(walls, pose, rng=rng)
        for name, method in COMPASSES.items():
            found, took = timed(lambda scan=scan, method=method: method(ScanPoints.of(scan)))
            times[name].append(took)
            if found is not None:
                errors[name].append(abs(math.degrees(math.remainder(found + pose.heading, RIGHT))))
    print(f"\n## Compass, {count} scans; error in degrees; target 0.02 / 0.1 in 0.3 ms\n")
    print("| compass | ms | median | p95 | max | unknown |\n|---|---|---|---|---|---|")
    for name in COMPASSES:
        median, p95, worst = quantiles(errors[name], 0.5, 0.95, 1.0)
        lost = count - len(errors[name])
        print(f"| {name} | {np.median(times[name]):.3f} | {median:.4f} | {p95:.3f} | {worst:.2f} | {lost} |")


def logs() -> None:
    targets = {"intel": 0.69, "seattle": 0.31}
    print("\n## Compass on real logs: deviation from the building's direction by the mapper's poses, degrees\n")
    print("| log | scans | compass | ms | median | p95 | unknown | target |\n|---|---|---|---|---|---|---|---|")
    for name, target in targets.items():
        entries = list(carmen.scans(name))
        for method_name, method in COMPASSES.items():
            directions, times = [], []
            for robot, scan, pose in entries:
                found, took = timed(lambda s=scan, r=robot, m=method: m(ScanPoints.of(s, r.laser.mount)))
                times.append(took)
                if found is not None:
                    directions.append(pose.heading + found)
            off = carmen.deviations(directions)
            median, p95 = quantiles(off, 0.5, 0.95)
            lost = len(entries) - len(directions)
            row = f"| {name} | {len(entries)} | {method_name} | {np.median(times):.3f} | {median:.3f} | {p95:.2f} "
            print(row + f"| {lost} | {target} |")


# --- lines ---


def fitted(sweep: ScanPoints) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    lines = find_lines(sweep, split(sweep, SETTINGS.lines), SETTINGS.lines)
    return ((np.array(line.start), np.array(line.end)) for line in lines)


def approximated(sweep: ScanPoints) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    points = sweep.points
    for first, last in split(sweep, SETTINGS.lines).runs:
        chain = cv2.approxPolyDP(points[first : last + 1, None].astype(np.float32), 0.03, closed=False)[:, 0]
        yield from pairwise(chain)


def probabilistic(sweep: ScanPoints) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    found = cv2.HoughLinesP(image_of(sweep.points), 1, math.pi / 180, 15, minLineLength=10, maxLineGap=8)
    for x0, y0, x1, y1 in [] if found is None else found.reshape(-1, 4):
        half = round(10 / PIXEL)
        yield (np.array([x0, y0]) - half) * PIXEL, (np.array([x1, y1]) - half) * PIXEL


LINES: dict[str, Callable[[ScanPoints], Any]] = {"end-point split, weighted least squares": fitted}
if cv2:
    LINES["OpenCV approxPolyDP"] = approximated
    LINES["OpenCV HoughLinesP"] = probabilistic


def against_walls(start: np.ndarray, end: np.ndarray, walls: np.ndarray, pose: Pose) -> tuple[float, float] | None:
    """Error of a line's angle, degrees, and of its middle's place across the wall, m; None for no wall at all."""
    cosine, sine = math.cos(pose.heading), math.sin(pose.heading)
    turn = np.array([[cosine, sine], [-sine, cosine]])
    start, end = start @ turn + (pose.x, pose.y), end @ turn + (pose.x, pose.y)
    direction = math.atan2(end[1] - start[1], end[0] - start[0])
    axis = round(direction / RIGHT) % 2
    middle = (start + end) / 2
    along = walls[np.isclose(walls[:, 1 - axis], walls[:, 3 - axis])]
    low, high = np.minimum(along[:, axis], along[:, 2 + axis]), np.maximum(along[:, axis], along[:, 2 + axis])
    beside = (low - 0.05 <= middle[axis]) & (middle[axis] <= high + 0.05)
    offsets = np.abs(along[beside, 1 - axis] - middle[1 - axis])
    if not len(offsets) or offsets.min() > 0.2:
        return None
    return abs(math.degrees(math.remainder(direction, RIGHT))), float(offsets.min())


def lines(count: int) -> None:
    rng = np.random.default_rng(2)
    results: dict[str, list[tuple[float, float, float]]] = defaultdict(list)
    times, strays = defaultdict(list), Counter()
    for _ in range(count):
        walls, pose = mazes.place(rng)
        scan = scan_of(walls, pose, rng=rng)
        for name, method in LINES.items():
            found, took = timed(lambda scan=scan, method=method: list(method(ScanPoints.of(scan))))
            times[name].append(took)
            for start, end in found:
                length = math.dist(start, end)
                error = against_walls(np.asarray(start, float), np.asarray(end, float), walls, pose)
                if length >= 0.1 and error is None:
                    strays[name] += 1
                elif length >= 0.1 and error is not None:
                    results[name].append((length, *error))
    print(f"\n## Lines, {count} scans; target 0.05 degrees and 0.3 mm in 0.4 ms\n")
    print("| lines | ms | a scan | angle, degrees: median | p95 | offset at the middle, mm: median | p95 | no wall |")
    print("|---|---|---|---|---|---|---|---|")
    for name in LINES:
        for least in (0.1, 0.3):
            chosen = [row for row in results[name] if row[0] >= least]
            angle, angle95 = quantiles([row[1] for row in chosen], 0.5, 0.95)
            offset, offset95 = quantiles([1000 * row[2] for row in chosen], 0.5, 0.95)
            row = f"| {name}, from {least} m | {np.median(times[name]):.3f} | {len(chosen) / count:.1f} "
            print(row + f"| {angle:.3f} | {angle95:.2f} | {offset:.2f} | {offset95:.1f} | {strays[name]} |")


# --- junctions and doors ---


def junction(count: int) -> None:
    rng = np.random.default_rng(3)
    errors, totals = Counter(), Counter()
    times, false_openings = [], 0
    for scene in junctions.scenes(np.random.default_rng([3, 1]), count):
        facts = Perception(PICO, SETTINGS).facts(observe(scene.walls, scene.pose, rng=rng))
        found, took = timed(lambda facts=facts: whole_junction(facts))
        times.append(took)
        totals[scene.kind] += 1
        if found.kind != scene.kind:
            errors[scene.kind, scene.group, str(found.kind)] += 1
        ways = junctions.OPEN_WAYS.get(scene.kind, "LAR")
        false_openings += (found.left.open and "L" not in ways) + (found.right.open and "R" not in ways)
    right = count - sum(errors.values())
    print(f"\n## Junctions, {count} generated; target 99.5% right, no false opening\n")
    print(f"right {right / count:.2%}; openings into which the robot does not fit: {false_openings}; ", end="")
    print(f"{np.median(times):.3f} ms beyond lines and compass")
    print("\n| kind | scenes | wrong | taken for |\n|---|---|---|---|")
    for kind, total in totals.items():
        wrong = {f"{group}: {taken}": number for (one, group, taken), number in errors.items() if one == kind}
        print(f"| {kind} | {total} | {sum(wrong.values())} | {wrong or ''} |")
    print(f"\ngaps narrower than the robot reported as openings: {narrow_gaps(count // 5)} of {count // 5}")


def narrow_gaps(count: int) -> int:
    """How many side walls with a gap of 5 to 40 cm, thin or deep, anywhere along the window, gave an opening."""
    rng = np.random.default_rng(4)
    false = 0
    for _ in range(count):
        half, near, width = rng.uniform(0.35, 0.75), rng.uniform(-0.6, 1.2), rng.uniform(0.05, 0.4)
        side = rng.choice([-1, 1])
        walls = [(-6, half, 6, half), (-6, -half, 6, -half)]
        walls[0 if side == 1 else 1] = (-6, side * half, near, side * half)
        walls.append((near + width, side * half, 6, side * half))
        if rng.random() < 0.5:
            walls += [(x, side * half, x, side * 4) for x in (near, near + width)]
        pose = Pose(0.0, rng.uniform(-1, 1) * max(half - 0.26, 0), math.radians(rng.uniform(-10, 10)))
        found = Perception(PICO, SETTINGS).facts(observe(walls, pose, rng=rng)).junction
        false += found.left.open or found.right.open
    return false


def door(count: int) -> None:
    rng = np.random.default_rng(5)
    totals, found_in, times = Counter(), Counter(), []
    for scene in doors.scenes(np.random.default_rng([5, 1]), count):
        facts = Perception(PICO, SETTINGS).facts(observe(scene.walls, scene.pose, rng=rng))
        found, took = timed(lambda facts=facts: fresh(facts, "door"))
        times.append(took)
        totals[scene.kind] += 1
        found_in[scene.kind] += found is not None
    print(f"\n## Doors, {count} scenes; target no false door, 99% found; {np.median(times):.3f} ms beyond lines\n")
    print("| scene | scenes | door reported |\n|---|---|---|")
    for kind in sorted(totals):
        print(f"| {kind} | {totals[kind]} | {found_in[kind]} |")


# --- time of all ---


def named(part: Any) -> Iterator[str]:
    """The signals that any part of a machine names."""
    if isinstance(part, SignalValue):
        yield part.signal.name
    if is_dataclass(part):
        yield from (name for one in fields(part) for name in named(getattr(part, one.name)))
    elif isinstance(part, list | tuple):
        yield from (name for one in part for name in named(one))


def supervisors() -> dict[str, list[str]]:
    """The signals of perception that each shipped machine names."""
    library = robot_library()
    models = {name: load_model(path, library) for name, path in shipped_machines().items()}
    return {name: sorted(set(named(model)) & signals.LIBRARY.signals.keys()) for name, model in models.items()}


def tick(perception: Perception, observation: Observation, called: list[Callable[[Facts], Any]]) -> None:
    """One tick's perception as a machine asks for it."""
    facts = perception.facts(observation)
    for function in called:
        function(facts)


def times(count: int) -> None:
    rng = np.random.default_rng(6)
    jobs: list[tuple[str, Callable[[], Any]]] = []
    functions = {name: signal.function for name, signal in signals.LIBRARY.signals.items()}
    called = {f"what {machine} names": names for machine, names in supervisors().items()}
    called["all signals"] = list(functions)
    for _ in range(count):
        walls, pose = mazes.place(rng)
        observation = observation_of(scan_of(walls, pose, rng=rng), pose)
        for label, names in called.items():
            asked = [functions[name] for name in names]
            jobs.append((label, partial(tick, Perception(PICO, SETTINGS), observation, asked)))
        for name in ("sweep", "lines", "compass", "space", "centre", "wall_right", "clearance", "repulsion",
                     "doors", "junction", "landmarks", "nodes", "minimap", "hough_compass"):  # fmt: skip
            facts = Facts(observation, PICO, SETTINGS, WorldModel(SETTINGS))
            for needed in ("points", "lines", "compass", "aligned"):
                if name not in ("sweep", "lines", "compass"):
                    getattr(facts, needed)
                elif name != "sweep":
                    getattr(facts, "points" if name == "lines" else "lines")
            job = partial(whole_junction, facts) if name == "junction" else partial(fresh, facts, name)
            jobs.append((f"{name}, beyond what it needs", job))
    # Ten rounds over all scans, each in an order of its own: another process disturbs a round, but hardly all ten, and
    # nothing always comes first to a scan that no cache holds.
    took = np.empty((10, len(jobs)))
    for one in took:
        for index in rng.permutation(len(jobs)).tolist():
            one[index] = processor_time(jobs[index][1])
    labels = np.array([label for label, _ in jobs])
    print(f"\n## Time, {count} scans, ms; target 1.5 for all signals, 0.5 for what one machine names\n")
    print("| what | best of ten rounds, median of the scans | all runs: median | p95 |\n|---|---|---|---|")
    for label in dict.fromkeys(labels.tolist()):
        own = took[:, labels == label]
        best, median, p95 = np.median(own.min(axis=0)), np.median(own), np.quantile(own, 0.95)
        print(f"| {label} | {best:.3f} | {median:.3f} | {p95:.3f} |")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="a tenth of the scenes")
    share = 10 if parser.parse_args().quick else 1
    if cv2:
        cv2.setNumThreads(1)
    compass(600 // share)
    if carmen.LOGS.is_dir():
        logs()
    lines(600 // share)
    junction(6300 // share)
    door(2000 // share)
    times(600 // share)


if __name__ == "__main__":
    main()
