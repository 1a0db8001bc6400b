from math import atan2, hypot

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from skills.limits import within_acceleration, within_speed
from transport.description import Limits
from transport.messages import STOP, Twist

components = st.floats(-5, 5)
twists = st.builds(Twist, components, components, components)


@given(twists)
def test_the_norm_is_kept_and_the_direction_stays(wanted):
    limits = Limits()
    got = within_speed(wanted, limits)
    assert got.speed <= limits.speed + 1e-12
    assert abs(got.turn) <= limits.turn_rate
    assert got.turn * wanted.turn >= 0
    if wanted.speed > 1e-6:
        assert atan2(got.left, got.forward) == pytest.approx(atan2(wanted.left, wanted.forward), abs=1e-9)


@given(twists)
def test_a_base_with_limits_for_each_axis_may_be_faster_along_the_diagonal(wanted):
    limits = Limits(translation="axis")
    got = within_speed(wanted, limits)
    assert max(abs(got.forward), abs(got.left)) <= limits.speed + 1e-12


def test_what_is_within_the_limits_is_left_alone():
    wanted = Twist(0.3, -0.2, 1.0)
    assert within_speed(wanted, Limits()) == wanted


@given(twists, twists, st.floats(0.01, 0.5))
def test_no_step_exceeds_the_acceleration_nor_the_speed(before, wanted, period):
    limits = Limits()
    before, wanted = within_speed(before, limits), within_speed(wanted, limits)
    got = within_acceleration(before, wanted, limits, period)
    change = hypot(got.forward - before.forward, got.left - before.left)
    assert change <= limits.acceleration * period + 1e-9
    assert abs(got.turn - before.turn) <= limits.turn_acceleration * period + 1e-9
    assert got.speed <= limits.speed + 1e-9


@given(twists)
@settings(max_examples=50)
def test_braking_ends_in_an_exact_stop(start):
    limits = Limits()
    twist = within_speed(start, limits)
    for _ in range(10):
        twist = within_acceleration(twist, STOP, limits, 0.1)
    assert twist == STOP
