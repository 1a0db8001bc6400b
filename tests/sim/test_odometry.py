"""The odometry's drift against figures that were measured on the course's simulator, and its geometry."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim.odometry import WheelOdometry, displacement, moved, wheel_matrix
from sim.settings import OdometryNoise
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
        odometry = WheelOdometry(OdometryNoise(), stream)
        start = odometry.reading(0).pose
        x, y = in_start_frame(start, drive(odometry, Twist(0.5, 0.0, 0.0), seconds))
        squares.append((x - 0.5 * seconds) ** 2 + y**2)
    # 200 runs tell the root mean square to about five per cent; allow three times that.
    assert math.sqrt(np.mean(squares)) == pytest.approx(drift, rel=0.15)


def test_without_noise_the_odometry_is_exact():
    odometry = WheelOdometry(EXACT, streams(1)[0])
    start = odometry.reading(0).pose
    end = drive(odometry, Twist(0.3, 0.1, 0.5), 60)
    expected = moved(start, Twist(0.3 * 60, 0.1 * 60, 0.5 * 60))
    assert (end.x, end.y) == pytest.approx((expected.x, expected.y), abs=1e-9)


def test_each_run_begins_in_a_frame_of_its_own():
    poses = [WheelOdometry(OdometryNoise(), stream).reading(0).pose for stream in streams(50)]
    assert np.std([pose.x for pose in poses]) > 0.8
    assert np.std([pose.heading for pose in poses]) > 1.5


def test_standing_still_does_not_drift():
    odometry = WheelOdometry(OdometryNoise(), streams(1)[0])
    start = odometry.reading(0).pose
    assert drive(odometry, Twist(), 60) == start


def test_slip_makes_the_wheels_miss_motion():
    ends = []
    for stream in streams(40):
        odometry = WheelOdometry(OdometryNoise(scale=0.0, slip=0.3), stream)
        start = odometry.reading(0).pose
        ends.append(in_start_frame(start, drive(odometry, Twist(0.5, 0.0, 0.0), 10))[0])
    # 100 steps of 5 cm, each off by 30 per cent.
    assert np.std(ends) == pytest.approx(0.3 * 0.05 * 10, rel=0.35)


def test_the_twist_is_what_the_wheels_counted():
    odometry = WheelOdometry(EXACT, streams(1)[0])
    odometry.count(Twist(0.05, 0.0, -0.1), 0.1, 0.1)
    twist = odometry.reading(0).twist
    assert (twist.forward, twist.left, twist.turn) == pytest.approx((0.5, 0.0, -1.0))


def test_three_wheels_at_the_lever_make_the_turn():
    assert wheel_matrix(0.1) @ [0.0, 0.0, 1.0] == pytest.approx([0.1, 0.1, 0.1])
    assert (wheel_matrix(0.1) @ [1.0, 0.0, 0.0]).sum() == pytest.approx(0.0)


angles = st.floats(-3, 3)


@given(pose=st.builds(Pose, small, small, angles), motion=st.builds(Twist, small, small, angles))
def test_displacement_is_the_inverse_of_motion(pose, motion):
    found = displacement(pose, moved(pose, motion))
    assert (found.forward, found.left, found.turn) == pytest.approx(
        (motion.forward, motion.left, motion.turn), abs=1e-9
    )
