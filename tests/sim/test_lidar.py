"""The laser against independent methods, at corners, seams and in odd poses."""

import math
import os

import numpy as np
import pymunk
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from sim.lidar import Lidar
from transport.compiled import TWINS
from transport.messages import Pose, ScanGeometry

PICO = ScanGeometry(1000, -2.0, 4 / 999, 0.01, 10.0)
FULL_CIRCLE = ScanGeometry(720, -math.pi, math.tau / 719, 0.01, 30.0)
SCENES = int(os.environ.get("MAZE_MACHINE_LIDAR_SCENES", "1000"))
TWINS_OF_PROJECT = TWINS["sim.project"]
KERNELS = [kernel for kernel in (TWINS_OF_PROJECT.plain, TWINS_OF_PROJECT.fast) if kernel]


def random_scene(generator, count):
    """Segments of all lengths and directions, some of them touching the last one, and a pose among them."""
    first = generator.uniform(-6, 6, (count, 2))
    second = first + generator.uniform(-1, 1, (count, 2)) * generator.choice([0.05, 1.0, 8.0], (count, 1))
    joined = generator.random(count) < 0.5
    for index in range(1, count):
        if joined[index]:
            first[index] = second[index - 1]
    return np.hstack([first, second]), Pose(*generator.uniform(-3, 3, 2), generator.uniform(-4, 4))


def by_shapely(segments, pose, angles, reach):
    """The nearest intersection of each beam with each wall, worked out by GEOS."""
    walls = shapely.linestrings(segments.reshape(-1, 2, 2))
    here = np.array([pose.x, pose.y])
    directions = np.stack([np.cos(angles + pose.heading), np.sin(angles + pose.heading)], axis=1)
    beams = shapely.linestrings(np.stack([np.tile(here, (len(angles), 1)), here + reach * directions], axis=1))
    hits = shapely.intersection(beams[:, None], walls[None, :])
    away = shapely.distance(shapely.Point(here), hits)
    return np.nanmin(np.where(np.isnan(away), np.inf, away), axis=1)


def by_pymunk(segments, pose, angles, reach):
    space = pymunk.Space()
    for ax, ay, bx, by in segments.tolist():
        space.add(pymunk.Segment(space.static_body, (ax, ay), (bx, by), 0.0))
    ranges = []
    for angle in (angles + pose.heading).tolist():
        end = pose.x + reach * math.cos(angle), pose.y + reach * math.sin(angle)
        hit = space.segment_query_first((pose.x, pose.y), end, 0.0, pymunk.ShapeFilter())
        ranges.append(math.inf if hit is None else hit.alpha * reach)
    return np.array(ranges)


def grazing(segments, pose, angles):
    """Beams that pass an end of a wall, or lie along a wall, so closely that rounding decides what they hit."""
    ends = segments.reshape(-1, 2) - [pose.x, pose.y]
    directions = np.stack([np.cos(angles + pose.heading), np.sin(angles + pose.heading)], axis=1)
    sides = directions[:, :1] * ends[:, 1] - directions[:, 1:] * ends[:, 0]
    walls = segments[:, 2:] - segments[:, :2]
    slopes = directions[:, :1] * walls[:, 1] - directions[:, 1:] * walls[:, 0]
    slopes /= np.maximum(np.hypot(walls[:, 0], walls[:, 1]), 1e-12)
    return (np.abs(sides).min(axis=1) < 1e-9) | (np.abs(slopes).min(axis=1) < 1e-5)


@pytest.mark.parametrize("kernel", KERNELS)
def test_ranges_equal_pymunks_on_random_scenes_to_a_nanometre(kernel):
    generator = np.random.default_rng(20)
    compared = 0
    geometry = ScanGeometry(40, -2.0, 4 / 39, 0.01, 10.0)
    lidar = Lidar(geometry, kernel=kernel)
    for _ in range(SCENES):
        segments, pose = random_scene(generator, int(generator.integers(1, 30)))
        angles = geometry.angles()
        ours, theirs = lidar.ranges(segments, pose), by_pymunk(segments, pose, angles, geometry.range_max)
        clear = ~grazing(segments, pose, angles)
        np.testing.assert_allclose(ours[clear], theirs[clear], rtol=0, atol=1e-9)
        compared += int(np.isfinite(ours[clear]).sum())
    assert compared > 10 * SCENES


@pytest.mark.parametrize("kernel", KERNELS)
def test_ranges_equal_shapelys_on_random_scenes_to_a_nanometre(kernel):
    generator = np.random.default_rng(21)
    geometry = ScanGeometry(40, -2.0, 4 / 39, 0.01, 10.0)
    lidar = Lidar(geometry, kernel=kernel)
    for _ in range(SCENES):
        segments, pose = random_scene(generator, int(generator.integers(1, 12)))
        angles = geometry.angles()
        ours, theirs = lidar.ranges(segments, pose), by_shapely(segments, pose, angles, geometry.range_max)
        clear = ~grazing(segments, pose, angles)
        np.testing.assert_allclose(ours[clear], theirs[clear], rtol=0, atol=1e-9)


@pytest.mark.parametrize("kernel", KERNELS)
@given(data=st.data())
def test_no_beam_leaves_a_closed_room(kernel, data):
    """Walls that share their ends are tight, wherever the robot stands and whatever the corners' coordinates are."""
    corners = data.draw(st.integers(3, 12))
    radii = data.draw(st.lists(st.floats(0.5, 4.0), min_size=corners, max_size=corners))
    x, y = data.draw(st.floats(-0.1, 0.1)), data.draw(st.floats(-0.1, 0.1))
    heading = data.draw(st.floats(-10, 10))
    angles = [math.tau * k / corners for k in range(corners)]
    points = np.array([(r * math.cos(a), r * math.sin(a)) for r, a in zip(radii, angles, strict=True)])
    walls = np.hstack([points, np.roll(points, -1, axis=0)])
    if corners < 5:  # the origin must stay inside
        x = y = 0.0
    ranges = Lidar(FULL_CIRCLE, kernel=kernel).ranges(walls, Pose(x, y, heading))
    assert np.isfinite(ranges).all()


@pytest.mark.parametrize("kernel", KERNELS)
def test_a_beam_that_meets_the_end_of_a_wall_hits_it(kernel):
    beam = ScanGeometry(3, -1.0, 1.0, 0.01, 10.0)
    lidar = Lidar(beam, kernel=kernel)
    assert lidar.ranges(np.array([[2.0, 0.0, 2.0, 1.0]]), Pose())[1] == 2.0
    # Two walls that meet straight ahead.
    assert lidar.ranges(np.array([[2.0, 0.0, 2.0, 1.0], [2.0, 0.0, 2.0, -1.0]]), Pose())[1] == 2.0
    # A wall seen end on.
    assert lidar.ranges(np.array([[3.0, 0.0, 2.0, 0.0]]), Pose())[1] == 2.0
    # A wall end on, behind.
    assert lidar.ranges(np.array([[-3.0, 0.0, -2.0, 0.0]]), Pose())[1] == math.inf


@pytest.mark.parametrize("kernel", KERNELS)
def test_beyond_its_reach_and_behind_it_the_laser_sees_nothing(kernel):
    lidar = Lidar(PICO, kernel=kernel)
    assert np.isinf(lidar.ranges(np.array([[10.5, -20.0, 10.5, 20.0]]), Pose())[450:550]).all()
    assert np.isinf(lidar.ranges(np.array([[-1.0, -0.5, -1.0, 0.5]]), Pose())).all()
    assert np.isinf(lidar.ranges(np.empty((0, 4)), Pose())).all()


def test_the_mount_shifts_and_turns_the_sensor():
    wall = np.array([[3.0, -9.0, 3.0, 9.0]])
    ahead = ScanGeometry(3, -1.0, 1.0, 0.01, 20.0)
    assert Lidar(ahead, Pose(0.2, 0.0, 0.0)).ranges(wall, Pose())[1] == pytest.approx(2.8, abs=1e-12)
    # The robot looks left, the sensor on its left side looks right.
    assert Lidar(ahead, Pose(0.0, -0.5, -math.pi / 2)).ranges(wall, Pose(0.0, 0.0, math.pi / 2))[1] == pytest.approx(
        2.5, abs=1e-12
    )
