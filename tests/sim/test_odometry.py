"""The odometry's drift against figures that were measured on the course's simulator, and its geometry."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim.odometry import WheelOdometry, displacement, moved, wheels_of
from sim.settings import OdometryNoise
from transport.base import Differential, Holonomic
from transport.messages import Pose, Twist

EXACT = OdometryNoise(scale=0.0, start_spread=0.0)
small = st.floats(-1.5, 1.5)


def streams(count):
    return [np.random.Generator(np.random.PCG64(seed)) for seed in range(count)]


def drive(odometry, twist, seconds):
    step = 0.1
    for tick in range(1, round(seconds / step) + 1):
        odometry.count(Twist(twist.forward * step, twist.left * step, twist.turn * step), step, tick * step)
    return odometry.reading(0).pose


def in_start_frame(start, pose):
    dx, dy = pose.x - start.x, pose.y - start.y
    cos, sin = math.cos(start.heading), math.sin(start.heading)
    return cos * dx + sin * dy, cos * dy - sin * dx


@pytest.mark.parametrize(("seconds", "drift"), [(60, 0.77), (300, 8.6)])
def test_driving_straight_drifts_as_the_courses_simulator_does(seconds, drift):
    squares = []
    for stream in streams(200):
        odometry = WheelOdometry(Holonomic(), OdometryNoise(), stream)
        start = odometry.reading(0).pose
        x, y = in_start_frame(start, drive(odometry, Twist(0.5, 0.0, 0.0), seconds))
        squares.append((x - 0.5 * seconds) ** 2 + y**2)
    # 200 runs tell the root mean square to about five per cent; allow three times that.
    assert math.sqrt(np.mean(squares)) == pytest.approx(drift, rel=0.15)


def test_without_noise_the_odometry_is_exact():
    odometry = WheelOdometry(Holonomic(), EXACT, streams(1)[0])
    start = odometry.reading(0).pose
    end = drive(odometry, Twist(0.3, 0.1, 0.5), 60)
    expected = moved(start, Twist(0.3 * 60, 0.1 * 60, 0.5 * 60))
    assert (end.x, end.y) == pytest.approx((expected.x, expected.y), abs=1e-9)


def test_each_run_begins_in_a_frame_of_its_own():
    poses = [WheelOdometry(Holonomic(), OdometryNoise(), stream).reading(0).pose for stream in streams(50)]
    assert np.std([pose.x for pose in poses]) > 0.8
    assert np.std([pose.heading for pose in poses]) > 1.5


def test_standing_still_does_not_drift():
    odometry = WheelOdometry(Holonomic(), OdometryNoise(), streams(1)[0])
    start = odometry.reading(0).pose
    assert drive(odometry, Twist(), 60) == start


def test_slip_makes_the_wheels_miss_motion():
    ends = []
    for stream in streams(300):
        odometry = WheelOdometry(Holonomic(), OdometryNoise(scale=0.0, slip=0.05), stream)
        start = odometry.reading(0).pose
        ends.append(in_start_frame(start, drive(odometry, Twist(0.5, 0.0, 0.0), 10))[0])
    # 100 steps of 5 cm, for which two of the three wheels roll, each off by 5 per cent.
    assert np.std(ends) == pytest.approx(0.05 * math.sqrt(0.5) * 0.05 * 10, rel=0.35)


def test_the_twist_is_what_the_wheels_counted():
    odometry = WheelOdometry(Holonomic(), EXACT, streams(1)[0])
    odometry.count(Twist(0.05, 0.0, -0.1), 0.1, 0.1)
    twist = odometry.reading(0).twist
    assert (twist.forward, twist.left, twist.turn) == pytest.approx((0.5, 0.0, -1.0))


def test_three_wheels_at_the_lever_make_the_turn():
    assert wheels_of(Holonomic(), 0.1).rims @ [0.0, 0.0, 1.0] == pytest.approx([0.1, 0.1, 0.1])
    assert (wheels_of(Holonomic(), 0.1).rims @ [1.0, 0.0, 0.0]).sum() == pytest.approx(0.0)


angles = st.floats(-3, 3)


@given(pose=st.builds(Pose, small, small, angles), motion=st.builds(Twist, small, small, angles))
def test_displacement_is_the_inverse_of_motion(pose, motion):
    found = displacement(pose, moved(pose, motion))
    assert (found.forward, found.left, found.turn) == pytest.approx(
        (motion.forward, motion.left, motion.turn), abs=1e-9
    )


PAIR = Differential(kind="differential", track=0.3, wheel_speed=1.0)


def test_two_wheels_count_as_their_rims_roll():
    assert wheels_of(PAIR, 0.1).rims @ [0.5, 0.0, 1.0] == pytest.approx([0.35, 0.65])


def test_two_wheels_without_noise_are_exact_and_do_not_notice_a_push_to_the_side():
    odometry = WheelOdometry(PAIR, EXACT, streams(1)[0])
    start = odometry.reading(0).pose
    end = drive(odometry, Twist(0.3, 0.1, 0.5), 60)
    expected = moved(start, Twist(0.3 * 60, 0.0, 0.5 * 60))
    assert (end.x, end.y) == pytest.approx((expected.x, expected.y), abs=1e-9)


def test_of_two_wheels_the_one_that_counts_less_turns_the_odometry():
    turns = []
    for stream in streams(40):
        odometry = WheelOdometry(PAIR, OdometryNoise(scale=0.01, redraw=100.0), stream)
        start = odometry.reading(0).pose
        end = drive(odometry, Twist(0.2, 0.0, 0.0), 10)
        turns.append(math.remainder(end.heading - start.heading, math.tau))
    # The difference of two factors, each uniform within one per cent, over a way of 2 m and a track of 0.3 m.
    assert np.std(turns) == pytest.approx(math.sqrt(2 / 3) * 0.01 * 2.0 / 0.3, rel=0.3)


def test_each_of_two_wheels_slips_by_itself():
    ends = []
    for stream in streams(40):
        odometry = WheelOdometry(PAIR, OdometryNoise(scale=0.0, slip=0.3), stream)
        start = odometry.reading(0).pose
        pose = drive(odometry, Twist(0.0, 0.0, 0.5), 10)
        ends.append(math.dist((pose.x, pose.y), (start.x, start.y)))
    assert np.mean(ends) > 0.01
