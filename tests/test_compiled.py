"""Functions that exist as Python and as machine code give the same bits, whatever they are given."""

import math
import os
import subprocess
import sys

import numpy as np
import pytest

import perception.compass
import perception.exit
import perception.hough
import perception.lines
import perception.mapping.matching
import perception.space
import perception.sweep
import sim.body
import sim.geometry
import sim.lidar
import sim.noise
import skills.outline
import skills.passage
import skills.safety
import skills.surroundings
import transport.arithmetic
import transport.sanity
from perception.sweep import FieldOfView
from skills.outline import RoundedBox
from skills.safety import Beside
from transport.compiled import PACKAGES, PLAIN, TWINS, arithmetic_in_use, kernels_of

MODULES = (
    *(perception.compass, perception.exit, perception.hough, perception.lines, perception.mapping.matching),
    *(perception.space, perception.sweep),
    *(sim.body, sim.geometry, sim.lidar, sim.noise),
    *(transport.arithmetic, transport.sanity),
    *(skills.outline, skills.passage, skills.safety, skills.surroundings),
)
CASES = int(os.environ.get("MAZE_MACHINE_COMPILED_CASES", "1000"))
BUILT = all(kernels_of(package) is not None for package in PACKAGES)
needs_kernels = pytest.mark.skipif(not BUILT, reason="this copy was built without a C compiler")


def bits(value):
    """A result with the bits of all of its numbers."""
    if isinstance(value, np.ndarray):
        return value.shape, value.dtype.str, np.ascontiguousarray(value).tobytes()
    if isinstance(value, tuple | list):
        return [bits(one) for one in value]
    return value.hex() if isinstance(value, float) else value


def copied(argument):
    return argument.copy(order="K") if isinstance(argument, np.ndarray) else argument


def assert_twins(name, *arguments):
    """Both forms return the same and leave the same behind in what they were given."""
    twins = TWINS[name]
    ours, theirs = [copied(one) for one in arguments], [copied(one) for one in arguments]
    assert bits(twins.plain(*ours)) == bits(twins.fast(*theirs)), (name, arguments)
    if (changed := CHANGED.get(name)) is not None:
        assert bits(ours[changed]) == bits(theirs[changed]), (name, arguments)


CHANGED = {"sim.disturb": 0, "perception.sort_readings": 0, "perception.count_votes": 2}
"""Which argument is where the result is left."""


def segments_of(generator, count):
    """Segments of all lengths and directions, some joined to the one before, some along an axis."""
    first = generator.uniform(-6, 6, (count, 2))
    second = first + generator.uniform(-1, 1, (count, 2)) * generator.choice([0.05, 1.0, 8.0], (count, 1))
    axis = generator.random(count) < 0.5
    second[axis, 0] = first[axis, 0]
    for index in range(1, count):
        if generator.random() < 0.5:
            first[index] = second[index - 1]
    return np.hstack([first, second])


def simulated(generator):
    """Inputs of the simulator's kernels."""
    segments, beams = segments_of(generator, int(generator.integers(1, 60))), int(generator.integers(1, 400))
    heading, width = generator.uniform(-4, 4), generator.uniform(0.1, math.tau)
    angles = np.linspace(-width / 2, width / 2, beams) if beams > 1 else np.zeros(1)
    sensor = (*generator.uniform(-3, 3, 2).tolist(), math.cos(heading), math.sin(heading))
    fan = (float(angles[0]), width / max(beams - 1, 1), float(generator.choice([2.0, 10.0, 30.0])))
    yield "sim.project", segments, sensor, np.stack([np.cos(angles), np.sin(angles)]), fan
    exact = np.where(generator.random(beams) < 0.2, np.inf, generator.uniform(0, 11, beams))
    yield "sim.disturb", exact, generator.random(beams), float(generator.choice([0.0, 0.01, 3.0])), 10.0
    yield "sim.nearest_segment", *generator.uniform(-5, 5, 2).tolist(), segments
    yield "sim.nearest_segment", *segments[0, :2].tolist(), segments
    corners = generator.uniform(-1, 1, (int(generator.integers(3, 9)), 2))
    yield "sim.outline_distance", corners, segments
    where = *generator.uniform(-3, 3, 2).tolist(), math.cos(heading), math.sin(heading)
    yield "sim.outline_near", corners, where, segments, float(generator.choice([0.0, 0.5, 2.0, math.inf]))
    twist = generator.choice([0.0, 1.0], 3) * generator.uniform(-1, 1, 3)
    place = generator.uniform(-9, 9, 3) * generator.choice([1.0, 1e5])
    wanted = generator.choice([0.0, 1.0], 3) * generator.uniform(-1, 1, 3)
    wanted = twist if generator.random() < 0.2 else wanted
    changes = tuple(generator.choice([0.01, 0.3, 2.0], 2).tolist())
    gliding = tuple(place.tolist()), (tuple(twist.tolist()), tuple(wanted.tolist())), changes
    yield "sim.glided", *gliding, 0.01, int(generator.integers(0, 11))
    yield "sim.follow_arc", tuple(place.tolist()), tuple(twist.tolist()), 0.01, int(generator.integers(0, 11))


def scanned(generator):
    """A scan of walls, with noise and gaps: beams with a hit, ranges, points of shape (n, 2), angle between beams."""
    angles = np.linspace(-2.0, 2.0, int(generator.integers(2, 600)))
    segments, sensor = segments_of(generator, int(generator.integers(1, 40))), (0.0, 0.0, 1.0, 0.0)
    step = 4.0 / (len(angles) - 1)
    directions = np.stack([np.cos(angles), np.sin(angles)])
    ranges = TWINS["sim.project"].plain(segments, sensor, directions, (-2.0, step, 10.0))
    ranges += generator.normal(0, float(generator.choice([0.0, 0.01, 0.2])), len(ranges))
    ranges[generator.random(len(ranges)) < float(generator.choice([0.0, 0.2]))] = np.nan
    beams = np.flatnonzero(np.isfinite(ranges))
    if not len(beams):
        beams, ranges = np.arange(len(angles)), np.full(len(angles), 2.0)
    return beams, ranges, (directions[:, beams] * ranges[beams]).T, step


def axes_of(generator):
    """Straight walls, most of them along two axes, some with one direction in common to the last bit."""
    count, about = int(generator.integers(1, 24)), generator.uniform(-4, 4)
    alphas = about + generator.integers(-2, 3, count) * math.pi / 2 + generator.normal(0, 0.03, count)
    alphas += generator.choice([0.0, 0.7], count) * generator.choice([0.0, 1.0])
    alphas[generator.random(count) < 0.3] = alphas[0]
    lengths, sizes = generator.uniform(0, 3, count), 10.0 ** generator.uniform(-3, 14, count)
    return tuple(
        perception.lines.Line(alpha, 1.0, (0.0, 0.0), (1.0, 0.0), length, 9, size, 0.0)
        for alpha, length, size in zip(alphas.tolist(), lengths.tolist(), sizes.tolist(), strict=True)
    )


def perceived(generator):
    """Inputs of perception's kernels."""
    beams, ranges, points, step = scanned(generator)
    odd = ranges.copy()
    odd[generator.integers(0, len(odd), 5)] = [-np.inf, np.inf, 0.0, 10.0, -1.0]
    yield "perception.sort_readings", odd, 0.05, 10.0
    place = (0.0, 0.0) if generator.random() < 0.5 else tuple(generator.uniform(-1, 1, 2).tolist())
    yield "perception.points_of", ranges, *generator.uniform(-1, 1, (2, len(ranges))), place
    hit = ranges[beams]
    yield "perception.any_nearer", ranges[beams], float(generator.uniform(0, 1))
    yield "perception.all_hit", ranges if generator.random() < 0.5 else ranges[beams]
    outline = tuple(map(tuple, generator.uniform(-1, 1, (int(generator.integers(1, 9)), 2)).tolist()))
    first, last = generator.uniform(-4, 4, 2).tolist()
    yield "perception.extent_along", outline, (math.cos(first), math.sin(first))
    ends = math.cos(first), math.sin(first), math.cos(last), math.sin(last)
    yield "perception.out_of_view", points, FieldOfView(*place, *ends, float(generator.uniform(0, 6)))
    yield "perception.runs_of", points, hit, beams, (step / 0.2, 0.1, int(generator.integers(0, 4)))
    runs = TWINS["perception.runs_of"].plain(points, hit, beams, (step / 0.2, 0.1, 2))
    tolerance = float(generator.choice([0.0, 0.01, 0.05, 0.3]))
    yield "perception.split_at_end_points", points, runs, tolerance, int(generator.integers(1, 6))
    pieces = TWINS["perception.split_at_end_points"].plain(points, runs, tolerance, int(generator.integers(1, 6)))
    if pieces:
        limits = (*generator.choice([-1.0, 0.002, 0.05], 1).tolist(), 0.1, float(generator.choice([0.05, math.inf])))
        yield "perception.fitted_lines", points, hit, pieces, limits
    turn = generator.uniform(-4, 4)
    yield "perception.agreed_direction", axes_of(generator), (math.pi / 2, math.radians(6), 0.4, 0.4)
    yield "perception.along_lane", points, (math.cos(turn), math.sin(turn)), (-0.5, 3.0)
    along = TWINS["perception.along_lane"].plain(points, (math.cos(turn), math.sin(turn)), (-0.5, 3.0))
    yield "perception.lane_beside", along, float(generator.uniform(0.01, 0.5)), 0.7, 2.0, 0.1
    sizes = float(generator.uniform(0.01, 0.5)), 0.7, 2.0, 0.1
    before = (math.nan, math.nan) if generator.random() < 0.3 else tuple(generator.uniform(0, 1, 2).tolist())
    yield "perception.lane_in_sight", points, (math.cos(turn), math.sin(turn)), (-0.5, 3.0), sizes, before
    yield "perception.in_lane", along, *sorted(generator.uniform(-2, 2, 2).tolist()), math.inf
    chosen = np.unique(generator.integers(0, len(ranges), int(generator.integers(0, 40))))
    yield "perception.seen_in_sector", ranges, chosen, float(generator.choice([0.0, 0.1, 0.5]))
    grid = perception.hough._grid(2.0, math.radians(float(generator.choice([1.0, 7.0]))), 0.05)
    near = points[np.abs(points).max(axis=1) <= 2.0].astype(np.float32)
    rows = generator.integers(0, len(grid.alphas), int(generator.integers(0, 60)))
    votes = np.empty((len(rows), len(grid.ps)), np.int32)
    yield "perception.count_votes", grid.transform[rows], np.ascontiguousarray(near.T), votes


def walls_of(generator, count):
    """Points with normals and variances."""
    turns = generator.choice([0.0, 1.0], count) * math.pi / 2 + generator.normal(0, 0.1, count)
    return (
        generator.uniform(-2, 2, (2, count)),
        np.stack([np.cos(turns), np.sin(turns)]),
        generator.uniform(1e-6, 1e-3, count),
    )


def matched(generator):
    """Inputs of the kernels that match scans."""
    scan, reference = (walls_of(generator, int(generator.integers(1, 400))) for _ in range(2))
    hits = generator.random(len(scan[2])) < 0.9
    apart = np.where(hits, generator.uniform(0, 1, len(hits)), np.inf)
    nearest = np.where(hits, generator.integers(0, len(reference[2]), len(hits)), len(reference[2]))
    place = tuple(generator.uniform(-3, 3, 3).tolist())
    limits = float(generator.choice([0.05, 1.0, 4.0])), float(generator.choice([-1.0, 0.7]))
    yield "perception.on_walls", scan, reference, apart, nearest, (*place, *limits)
    pairs = TWINS["perception.on_walls"].plain(scan, reference, apart, nearest, (*place, 9.0, -1.0))
    if pairs.shape[1]:
        yield "perception.normal_equations", pairs, place, (float(generator.choice([1.0, 3.7])), 4.0)
        pairs[2:4] = np.round(pairs[2:4])
        yield "perception.normal_equations", pairs, (0.0, 0.0, 0.0), (1.0, 4.0)


def guarded(generator):
    """Inputs of the skills' kernels."""
    beams = int(generator.integers(1, 400))
    ranges = np.where(generator.random(beams) < 0.1, np.nan, generator.uniform(0, 3, beams))
    place, reach = tuple(generator.uniform(-1, 1, 2).tolist()), float(generator.uniform(0.1, 3))
    yield "skills.nearest_of_beams", ranges, *generator.uniform(-1, 1, (2, beams)), place, reach
    points = generator.uniform(-1.5, 1.5, (int(generator.integers(1, 200)), 2))
    points = points if generator.random() < 0.5 else np.asfortranarray(points)[:: int(generator.integers(1, 3))]
    heading = generator.uniform(-4, 4)
    turn = math.cos(heading), math.sin(heading)
    yield "skills.carried_near", points, (*place, *turn), reach
    first, last = generator.uniform(-4, 4, 2).tolist()
    ends = math.cos(first), math.sin(first), math.cos(last), math.sin(last)
    view = FieldOfView(*place, *ends, float(generator.uniform(0, 6)))
    many = points if generator.random() < 0.9 else np.tile(points, (20, 1))
    directions = generator.uniform(-1, 1, (2, beams))
    yield "skills.seen_and_behind", (ranges, *directions), view, reach, many, (*place, *turn)
    yield "skills.turned_near", points, turn, reach
    box = RoundedBox(*generator.uniform(-0.1, 0.1, 2).tolist(), *generator.uniform(0, 0.3, 2).tolist(), 0.05)
    yield "skills.from_core", points, box
    poses = generator.uniform(-1, 1, (int(generator.integers(1, 8)), 3))
    yield "skills.least_clearance", points, poses, box
    velocity = generator.choice([0.0, 1.0], 3) * generator.uniform(-1, 1, 3)
    stop = tuple(velocity.tolist()), 0.1, tuple(generator.choice([0.005, 0.15, 2.0], 2).tolist())
    yield "skills.stopping", *stop
    yield "skills.clearance_in_stopping", points, box, *stop
    beside = Beside(*sorted(generator.uniform(-0.4, 0.4, 2).tolist()), 0.25, reach)
    yield "skills.room_ahead", points, beside
    yield "skills.looked_round", points, box, beside
    apart, distance = TWINS["skills.from_core"].plain(points, box)
    yield "skills.room_across", apart, distance, int(distance.argmin())
    yield "skills.passage_between", points, (0.25, reach, 0.1, float(generator.uniform(0, 1)), 0.5)


def calculated(generator):
    """Inputs of arithmetic's kernels."""
    yield "transport.cos_sin", float(generator.uniform(-9, 9) * generator.choice([1e-9, 1.0, 1e6]))
    yield "transport.cos_sin", float(generator.integers(-9, 9) * math.pi / 4)
    scale = generator.choice([0.0, -0.0, 1e-300, 1.0, 1e19, math.inf], 2)
    yield "transport.atan2", *(generator.uniform(-1, 1, 2) * np.where(np.isinf(scale), 1.0, scale)).tolist()
    readings = generator.uniform(0, 11, int(generator.integers(0, 50))).astype(np.float32)
    odd = generator.random(len(readings)) < 0.3
    readings[odd] = generator.choice([-np.inf, np.inf, np.nan, -1.0, 0.1], int(odd.sum()))
    yield "transport.counted", readings, float(np.float32(0.1))
    yield "transport.atan2", *generator.choice([0.0, -0.0, 1.0, -1.0, math.inf, -math.inf, math.nan], 2).tolist()


SOURCES = (calculated, simulated, perceived, matched, guarded)


@needs_kernels
@pytest.mark.parametrize("inputs", SOURCES, ids=lambda inputs: inputs.__name__)
def test_both_forms_give_the_same_bits(inputs):
    seen = set()
    for seed in range(CASES):
        for name, *arguments in inputs(np.random.default_rng(seed)):
            assert_twins(name, *arguments)
            seen.add(name)
    assert seen


@needs_kernels
def test_every_kernel_is_compared_and_has_its_python():
    compared = {name for inputs in SOURCES for seed in range(5) for name, *_ in inputs(np.random.default_rng(seed))}
    offered = {
        f"{package}.{name}" for package in PACKAGES for name in vars(kernels_of(package)) if not name.startswith("_")
    }
    assert compared == offered == set(TWINS)


@needs_kernels
@pytest.mark.parametrize("name", sorted(TWINS))
def test_a_kernel_refuses_what_is_not_its_kind(name):
    """A wrong call is an exception, never a crash."""
    wrong = (None, "text", np.zeros(3, np.float32), np.zeros((2, 2, 2)))
    for count in range(9):
        for what in wrong:
            with pytest.raises((TypeError, ValueError)):
                TWINS[name].fast(*[what] * count)


def version_of(**environment):
    done = subprocess.run(
        [sys.executable, "-m", "maze_machine", "--version"],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout


def test_the_version_says_which_of_the_two_runs():
    assert arithmetic_in_use() in version_of()
    assert (f"{PLAIN} is set" if BUILT else "without a C compiler") in version_of(**{PLAIN: "1"})


WHOLE_RUN = [sys.executable, "-m", "maze_machine", "run", "pledge", "--maze", "corridor", "--no-picture", "--trace"]


@needs_kernels
def test_a_whole_run_has_one_trace(tmp_path):
    traces = []
    for environment in ({}, {PLAIN: "1"}):
        trace = tmp_path / f"trace{len(traces)}.jsonl"
        subprocess.run([*WHOLE_RUN, trace], cwd=tmp_path, env={**os.environ, **environment}, check=True, timeout=120)
        traces.append(trace.read_bytes())
    assert traces[0] == traces[1]
    assert len(traces[0].splitlines()) > 100
