"""The exit: fires when the whole robot is out, and at no other time."""

from __future__ import annotations

import math

import numpy as np
import pytest

from perception.facts import Perception
from perception.signals import exit_ahead, exit_crossed
from tests.perception.scenes import PICO, observation_of, observe
from transport.description import Laser, RobotDescription
from transport.messages import Pose, Scan

ANGLES = [math.radians(angle) for angle in (-10, 0, 10)]
STEP = 0.05


def gate(width, *, left=4.0, right=4.0):
    """A corridor along x that ends at x = 3 in an outer wall."""
    half = width / 2
    walls = [(-3, half, 3, half), (-3, -half, 3, -half)]
    return [*walls, (3, half, 3, half + left), (3, -half, 3, -half - right)]


def drive(walls, places, angle=0.0, *, robot=PICO, seed=7):
    """At which of the places along x the exit has been crossed, one place a tick."""
    perception = Perception(robot)
    rng = np.random.default_rng(seed)
    poses = [Pose(x, 0.05, angle) for x in places]
    return [exit_crossed(perception.facts(observe(walls, pose, robot, rng))) for pose in poses]


def rear(angle):
    return min(x * math.cos(angle) - y * math.sin(angle) for x, y in PICO.footprint)


@pytest.mark.parametrize("width", [0.7, 1.0, 1.5])
@pytest.mark.parametrize("angle", ANGLES)
@pytest.mark.parametrize("sides", [(4.0, 4.0), (0.0, 4.0), (0.1, 0.1), (0.0, 0.0)])
def test_it_fires_once_the_whole_robot_is_out(width, angle, sides):
    places = np.arange(2.0, 4.0, STEP)
    crossed = drive(gate(width, left=sides[0], right=sides[1]), places, angle)
    first = places[crossed.index(True)]
    assert 3.0 - rear(angle) < first < 3.0 - rear(angle) + 4.5 * STEP
    assert all(crossed[crossed.index(True) :])


@pytest.mark.parametrize("angle", ANGLES)
def test_other_parts_of_the_maze_may_stand_beside_the_way_out(angle):
    walls = [*gate(0.8, left=0.1, right=0.1), (3.0, 0.9, 5.5, 0.9), (5.5, 0.9, 5.5, 2.0), (0.0, 0.9, 3.0, 0.9)]
    places = np.arange(2.0, 4.0, STEP)
    crossed = drive(walls, places, angle)
    assert 3.0 - rear(angle) < places[crossed.index(True)] < 3.0 - rear(angle) + 4.5 * STEP


@pytest.mark.parametrize("angle", ANGLES)
def test_not_while_a_part_of_the_robot_is_inside(angle):
    """It stands for long where only its rear is still between the posts."""
    place = 3.0 - rear(angle) - 0.03
    assert not any(drive(gate(1.0), [2.0, 2.5, *[place] * 10], angle))


@pytest.mark.parametrize("size", [4.0, 8.0, 9.5])
def test_not_in_an_open_space(size):
    half = size / 2
    hall = [(0, 0.5, 0, half), (0, -0.5, 0, -half), (0, half, size, half), (0, -half, size, -half)]
    walls = [(-3, 0.5, 0, 0.5), (-3, -0.5, 0, -0.5), *hall, (size, -half, size, half)]
    for angle in ANGLES:
        assert not any(drive(walls, np.arange(-1.0, size - 0.4, STEP), angle))


def test_not_in_a_hall_that_the_robot_was_put_down_in():
    """Nothing in sight anywhere: nothing says that there ever was a wall."""
    assert not any(drive([], np.arange(0.0, 5.0, 0.1)))


def test_not_in_a_long_crossing():
    walls = []
    for side in (1, -1):
        walls += [(-6, side * 0.5, 0, side * 0.5), (1, side * 0.5, 20, side * 0.5)]
        walls += [(0, side * 0.5, 0, side * 15), (1, side * 0.5, 1, side * 15)]
    for angle in ANGLES:
        assert not any(drive(walls, np.arange(-2.0, 4.0, STEP), angle))


@pytest.mark.parametrize("reading", [math.inf, math.nan, 0.0])
def test_not_when_the_scan_fails(reading):
    perception = Perception(PICO)
    rng = np.random.default_rng(1)
    for x in np.arange(0.0, 1.0, STEP):
        assert not exit_crossed(perception.facts(observe(gate(1.0), Pose(x, 0.0), rng=rng)))
    failed = Scan(0, PICO.laser.geometry(), np.full(1000, reading, np.float32))
    for x in np.arange(1.0, 2.0, STEP):
        assert not exit_crossed(perception.facts(observation_of(failed, Pose(x, 0.0))))


def test_turning_on_the_spot_is_no_way_out():
    perception = Perception(PICO)
    rng = np.random.default_rng(2)
    walls = gate(1.0)
    for turn in np.arange(0.0, 4 * math.tau, 0.12):
        assert not exit_crossed(perception.facts(observe(walls, Pose(2.6, 0.0, turn), rng=rng)))


def test_a_sensor_that_cannot_look_back_is_enough():
    laser = Laser(beams=361, angle_min=-math.pi / 2, angle_max=math.pi / 2, range_max=10.0)
    places = np.arange(2.0, 4.0, STEP)
    crossed = drive(gate(1.0), places, 0.1, robot=RobotDescription(laser=laser))
    assert 3.0 - rear(0.1) < places[crossed.index(True)] < 3.0 - rear(0.1) + 4.5 * STEP


@pytest.mark.parametrize("reach", [3.5, 5.0, 8.0])
def test_a_sensor_shorter_than_a_hall_is_carried_on_by_the_rest_before_it_is_believed(reach):
    robot = RobotDescription(laser=Laser(range_max=reach))
    hall = [(3, 0.5, 3, 20), (3, -0.5, 3, -20), (12.5, -20, 12.5, 20)]
    assert not any(drive([*gate(1.0), *hall], np.arange(2.0, 12.2, STEP), robot=robot))
    places = np.arange(2.0, 10.5, STEP)
    crossed = drive(gate(1.0), places, robot=robot)
    assert 3.0 + 10.0 - reach < places[crossed.index(True)] < 3.0 + 10.0 - reach + 5 * STEP


def test_an_exit_is_seen_ahead():
    rng = np.random.default_rng(2)
    assert exit_ahead(Perception(PICO).facts(observe(gate(1.0), Pose(0, 0, 0.1), rng=rng)))
    closed = [*gate(1.0), (8.0, -0.5, 8.0, 0.5)]
    assert not exit_ahead(Perception(PICO).facts(observe(closed, Pose(0, 0, 0.1), rng=rng)))
