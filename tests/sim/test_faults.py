"""Faults to order, by time and by place."""

import math
import re
from itertools import pairwise

import numpy as np
import pytest

from sim.faults import (
    BeamsMissing,
    Carried,
    CommandLate,
    CommandLost,
    LaserBlinded,
    LaserFrozen,
    ObjectStops,
    OdometryJump,
    parse_fault,
)
from sim.maze import Maze, MovingObject, Start
from sim.robot import SimulatedRobot
from sim.settings import IDEAL
from transport.messages import Command, Pose, Twist

WALLS = np.array([[0, 0, 8, 0], [8, 0, 8, 4], [8, 4, 0, 4], [0, 4, 0, 0]], dtype=float)
CART = MovingObject("cart", ((0.2, -0.2), (0.2, 0.2), (-0.2, 0.2), (-0.2, -0.2)), ((6.0, 1.0), (6.0, 3.0)), 0.5)
AHEAD = Command(Twist(0.5, 0.0, 0.0))


def robot_with(*faults, objects=()):
    exits = np.array([[20.0, 0.0, 20.0, 1.0]])
    maze = Maze("room", WALLS, Start(Pose(1.0, 2.0, 0.0)), exits, (), objects, time_limit=math.inf)
    return SimulatedRobot(maze, settings=IDEAL.model_copy(update={"faults": faults}))


def observations(robot, ticks, command=AHEAD):
    seen = [robot.observe()]
    for _ in range(ticks):
        robot.command(command)
        seen.append(robot.observe())
    return seen


def test_a_blinded_laser_measures_nothing_while_it_lasts():
    seen = observations(robot_with(LaserBlinded(at=1.0, lasts=0.5)), 20)
    blind = [tick for tick, observation in enumerate(seen) if np.isnan(observation.scan.ranges).all()]
    assert blind == [10, 11, 12, 13, 14]
    assert not any(np.isnan(seen[tick].scan.ranges).any() for tick in (9, 15))


def test_a_frozen_laser_repeats_itself_with_new_stamps():
    seen = observations(robot_with(LaserFrozen(at=1.0, lasts=0.5)), 20)
    for tick in (10, 12, 14):
        assert seen[tick].scan.ranges.tobytes() == seen[9].scan.ranges.tobytes()
        assert seen[tick].scan.stamp == tick * 100_000_000
    assert seen[15].scan.ranges.tobytes() != seen[9].scan.ranges.tobytes()


def test_missing_beams_are_those_between_the_angles():
    scan = observations(robot_with(BeamsMissing(angles=(-0.5, 0.25))), 1)[1].scan
    angles = scan.geometry.angles()
    assert np.array_equal(np.isnan(scan.ranges), (angles >= -0.5) & (angles <= 0.25))


def test_a_fault_can_wait_for_a_place():
    robot = robot_with(LaserBlinded(place=(3.0, 2.0, 0.5), lasts=1.0))
    seen = observations(robot, 100)
    blind = [tick for tick, observation in enumerate(seen) if np.isnan(observation.scan.ranges).all()]
    assert len(blind) == 10
    assert robot.path[blind[0]].x == pytest.approx(2.5, abs=0.05)


def test_the_odometry_jumps_once():
    seen = observations(robot_with(OdometryJump(at=2.0, by=(1.0, 0.0, 0.5))), 40)
    steps = [math.hypot(b.odometry.x - a.odometry.x, b.odometry.y - a.odometry.y) for a, b in pairwise(seen)]
    assert [tick for tick, step in enumerate(steps, 1) if step > 0.5] == [20]
    turn = math.remainder(seen[20].odometry.pose.heading - seen[19].odometry.pose.heading, math.tau)
    assert turn == pytest.approx(0.5)


def test_a_carried_robot_is_elsewhere_and_its_wheels_do_not_know():
    robot = robot_with(Carried(at=2.0, to=(1.5, 1.0, 0.5)))
    seen = observations(robot, 40)
    assert robot.path[20] == Pose(1.5, 1.0, 0.5)
    steps = [math.hypot(b.odometry.x - a.odometry.x, b.odometry.y - a.odometry.y) for a, b in pairwise(seen)]
    assert max(steps) < 0.1
    assert robot.verdict.path_length == pytest.approx(sum(steps), rel=0.02)


def test_what_happens_once_happens_at_the_very_beginning_too():
    robot = robot_with(Carried(to=(1.5, 1.0, 0.5)), OdometryJump(by=(1.0, 0.0, 0.5)))
    seen = observations(robot, 2)
    assert robot.path[1] == Pose(1.5, 1.0, 0.5)
    assert math.hypot(seen[1].odometry.x - seen[0].odometry.x, seen[1].odometry.y - seen[0].odometry.y) > 0.9


def test_a_lost_command_leaves_the_last_one_in_force():
    robot = robot_with(CommandLost(at=1.0, lasts=1.0))
    for tick in range(40):
        robot.command(AHEAD if tick < 10 else Command())
    # It stops one second later than it was told to.
    assert robot.truth.x == pytest.approx(1.0 + 0.5 * 2.0, abs=0.15)


def test_late_commands_are_carried_out_later():
    prompt, late = robot_with(), robot_with(CommandLate(ticks=3))
    for robot in (prompt, late):
        for _ in range(20):
            robot.command(AHEAD)
    assert late.truth.x == prompt.path[-4].x
    assert late.truth.x < prompt.truth.x


def test_an_object_stops_in_the_way():
    robot = robot_with(ObjectStops(thing="cart", at=2.0), objects=(CART,))
    observations(robot, 60, Command())
    assert robot.simulation.world.objects[0].place == pytest.approx((6.0, 2.0), abs=1e-9)


def test_a_fault_concerns_the_robot_that_it_names():
    seen = observations(robot_with(LaserBlinded(robot="somebody")), 1)
    assert not np.isnan(seen[0].scan.ranges).any()


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("laser_blinded at=10 lasts=2", LaserBlinded(at=10, lasts=2)),
        ("odometry_jump by=0.5,0,0.3 place=2,3,0.5", OdometryJump(by=(0.5, 0, 0.3), place=(2, 3, 0.5))),
        ("command_late ticks=2", CommandLate(ticks=2)),
        ("carried at=3 to=1.5,2,0.7", Carried(at=3, to=(1.5, 2, 0.7))),
    ],
)
def test_a_fault_is_read_from_a_line(text, fault):
    assert parse_fault(text) == fault


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "the faults are laser_blinded, laser_frozen"),
        ("laser", "there is no fault `laser`"),
        ("laser_blinded when=3", "`when` is not known"),
        ("laser_blinded at=-1", "`at` must be at least 0, not '-1'"),
        ("laser_blinded at=soon", "`at` must be a number, not 'soon'"),
        ("odometry_jump by=1", "`by` must be several values, not '1'"),
        ("odometry_jump", "`by` is missing"),
    ],
)
def test_a_fault_that_there_is_not_is_refused(text, told):
    with pytest.raises(ValueError, match=re.escape(told)):
        parse_fault(text)
