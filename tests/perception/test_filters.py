"""Filters, the meaning of readings, odometry and the world model's memory."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from perception.compass import Compass
from perception.facts import Perception
from perception.filters import moving_average
from perception.odometry import Displacement, moved, step_between
from perception.settings import PerceptionSettings
from perception.sweep import ScanPoints
from perception.world import WorldModel, to_robot, to_world
from tests.perception.scenes import PICO, observe
from transport.messages import Odometry, Pose, Scan, ScanGeometry

angles = st.floats(-10, 10)
places = st.builds(Pose, st.floats(-20, 20), st.floats(-20, 20), angles)


def test_moving_average():
    assert moving_average([1.0, 2.0, 6.0, 2.0], 3) == pytest.approx([1.5, 3.0, 10 / 3, 4.0])
    assert moving_average([1.0, 2.0], 1) == pytest.approx([1.0, 2.0])
    values = moving_average([1.0, math.nan, 3.0, math.inf], 3)
    assert values[:3:2] == pytest.approx([1.0, 3.0])
    assert math.isnan(values[1])
    assert math.isinf(values[3])


@pytest.mark.parametrize("window", [0, 2, -1])
def test_a_window_without_a_middle_is_refused(window):
    with pytest.raises(ValueError, match="odd window"):
        moving_average([1.0], window)


@given(st.lists(st.floats(-100, 100), min_size=1, max_size=50), st.sampled_from([1, 3, 5, 9]))
@settings(deadline=None, derandomize=True, max_examples=60)
def test_a_moving_average_is_a_mean_of_neighbours(values, window):
    half = window // 2
    averaged = moving_average(values, window)
    for index, value in enumerate(averaged):
        around = values[max(index - half, 0) : index + half + 1]
        assert value == pytest.approx(np.mean(around), abs=1e-9)


def test_the_meaning_of_readings():
    geometry = ScanGeometry(8, -1.0, 0.25, 0.01, 10.0)
    readings = [1.0, 0.005, -1.0, 10.0, 11.0, math.inf, math.nan, -math.inf]
    sweep = ScanPoints.of(Scan(0, geometry, np.array(readings, np.float32)))
    assert sweep.hit.tolist() == [True] + [False] * 6 + [True]
    assert np.isinf(sweep.ranges).tolist() == [False] + [True] * 5 + [False] * 2
    assert sweep.known.tolist() == [True] * 6 + [False, True]
    assert sweep.ranges[-1] == pytest.approx(0.01)


@given(places, places)
@settings(deadline=None, derandomize=True, max_examples=80)
def test_a_step_leads_from_one_pose_to_the_other(first, second):
    there = moved(first, step_between(first, second))
    assert (there.x, there.y) == pytest.approx((second.x, second.y), abs=1e-6)
    assert math.remainder(there.heading - second.heading, math.tau) == pytest.approx(0.0, abs=1e-6)


def test_a_full_turn_is_counted_though_the_heading_wraps():
    world = WorldModel(PerceptionSettings())
    for index in range(73):
        heading = math.remainder(math.radians(10 * index), math.tau)
        world.move(Odometry.at(index, Pose(0.0, 0.0, heading)))
    assert world.turned == pytest.approx(2 * math.tau, abs=1e-6)
    assert world.restarts == 0


@given(places, st.lists(st.tuples(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3), st.floats(-0.5, 0.5)), max_size=20))
@settings(deadline=None, derandomize=True, max_examples=40)
def test_where_the_odometry_began_means_nothing(origin, steps):
    def travel(start):
        world, pose = WorldModel(PerceptionSettings()), start
        world.move(Odometry.at(0, pose))
        for step in steps:
            pose = moved(pose, Displacement(*step))
            world.move(Odometry.at(0, pose))
        return world.pose

    one, other = travel(Pose()), travel(origin)
    assert (one.x, one.y) == pytest.approx((other.x, other.y), abs=1e-6)


def test_an_odometry_that_restarts_does_not_move_the_robot():
    world = WorldModel(PerceptionSettings())
    for x in (0.0, 0.1, 0.2, 57.0, 57.1):
        world.move(Odometry.at(0, Pose(x, 0.0, 0.0)))
    assert world.pose.x == pytest.approx(0.3)
    assert world.restarts == 1


def test_an_odometry_of_nan_does_not_spoil_the_pose():
    world = WorldModel(PerceptionSettings())
    for x in (0.0, 0.1, math.nan, 0.2):
        world.move(Odometry(0, x, 0.0, 0.0, 1.0))
    assert world.pose.x == pytest.approx(0.2)


def test_the_first_compass_lays_the_axes_along_the_walls():
    world = WorldModel(PerceptionSettings())
    world.move(Odometry.at(0, Pose(0.0, 0.0, 1.0)))
    world.move(Odometry.at(0, Pose(0.1, 0.0, 1.0)))
    world.align(Compass(-0.2, 1.0, 0.001))
    assert world.pose.heading == pytest.approx(0.2)
    assert world.misalignment == pytest.approx(-0.2)
    assert math.hypot(world.pose.x, world.pose.y) == pytest.approx(0.1)


@given(places, st.tuples(st.floats(-5, 5), st.floats(-5, 5)))
@settings(deadline=None, derandomize=True, max_examples=50)
def test_frames_are_inverse(pose, point):
    assert to_robot(pose, to_world(pose, point)) == pytest.approx(point, abs=1e-9)


def test_doors_are_told_apart_by_place_and_by_side():
    dead_end = [(-3, 0.5, 2, 0.5), (-3, -0.5, 2, -0.5), (2, -0.5, 2, 0.5)]
    perception = Perception(PICO)
    facts = perception.facts(observe(dead_end, Pose(1.1, 0.1, 0.05)))
    perception.world.remember_door(facts.door)
    perception.world.remember_door(facts.door)
    assert len(perception.world.doors) == 1
    assert perception.world.has_tried(facts.door)
    # The same view from elsewhere in the maze is another door.
    moved_on = observe(dead_end, Pose(1.1, 0.1, 0.05))
    odometry = Odometry.at(0, Pose(1.1, 0.5, 0.05))
    for _ in range(3):
        odometry = Odometry.at(0, Pose(odometry.x, odometry.y + 0.4, 0.05))
        facts = perception.facts(type(moved_on)(0, moved_on.scan, odometry))
    assert facts.door is not None
    assert not perception.world.has_tried(facts.door)
