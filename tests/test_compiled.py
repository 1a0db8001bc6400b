"""Functions that exist as Python and as machine code give the same bits, whatever they are given."""

import math
import os
import subprocess
import sys

import numpy as np
import pytest

import sim.body
import sim.geometry
import sim.lidar
import sim.noise
from transport.compiled import PACKAGES, PLAIN, TWINS, arithmetic_in_use, kernels_of

MODULES = (sim.body, sim.geometry, sim.lidar, sim.noise)
CASES = int(os.environ.get("MAZE_MACHINE_COMPILED_CASES", "300"))
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
    if name in CHANGE_THEIR_FIRST:
        assert bits(ours[0]) == bits(theirs[0]), (name, arguments)


CHANGE_THEIR_FIRST = {"sim.disturb"}


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
    twist = generator.choice([0.0, 1.0], 3) * generator.uniform(-1, 1, 3)
    place = generator.uniform(-9, 9, 3) * generator.choice([1.0, 1e5])
    yield "sim.follow_arc", tuple(place.tolist()), tuple(twist.tolist()), 0.01, int(generator.integers(0, 11))


SOURCES = (simulated,)


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
    compared = {name for inputs in SOURCES for name, *_ in inputs(np.random.default_rng(0))}
    offered = {
        f"{package}.{name}" for package in PACKAGES for name in vars(kernels_of(package)) if not name.startswith("_")
    }
    assert compared == offered == set(TWINS)


@needs_kernels
@pytest.mark.parametrize("name", ["sim.project", "sim.nearest_segment", "sim.outline_distance", "sim.follow_arc"])
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
