import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from skills.frames import Frame, Turned, rotated
from transport.messages import Pose, wrap_angle

coordinates = st.floats(-50, 50)
angles = st.floats(-math.pi, math.pi)
poses = st.builds(Pose, coordinates, coordinates, angles)


@given(poses, poses)
def test_into_a_frame_and_out_again(origin, pose):
    back = Frame(origin).outer(Frame(origin).local(pose))
    assert (back.x, back.y) == pytest.approx((pose.x, pose.y), abs=1e-9)
    assert wrap_angle(back.heading - pose.heading) == pytest.approx(0, abs=1e-9)


@given(poses, poses)
def test_the_matrix_does_the_same(origin, pose):
    frame = Frame(origin)
    x, y, one = frame.matrix() @ np.array([pose.x, pose.y, 1.0])
    local = frame.local(pose)
    assert (x, y, one) == pytest.approx((local.x, local.y, 1.0), abs=1e-9)


def test_a_frame_has_its_origin_at_zero_and_its_heading_along_x():
    frame = Frame(Pose(2, 3, math.pi / 2))
    assert frame.local(Pose(2, 3, math.pi / 2)) == Pose(0, 0, 0)
    assert frame.local(Pose(2, 4, math.pi)).x == pytest.approx(1)


@given(st.lists(st.floats(-3, 3), max_size=40), angles)
def test_turns_add_up_across_the_jump_of_odometry(turns, start):
    turned = Turned(start)
    heading = start
    for turn in turns:
        heading = wrap_angle(heading + turn)
        turned.update(heading)
    assert turned.angle == pytest.approx(sum(turns), abs=1e-6)


def test_a_vector_is_turned_counter_clockwise():
    assert rotated(1, 0, math.pi / 2) == pytest.approx((0, 1))
