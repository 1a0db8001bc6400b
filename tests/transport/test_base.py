"""What every base keeps, and what only one that cannot move sideways does."""

from math import atan2, hypot, inf, tau

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from transport.base import Differential, Holonomic, Limits, integrate
from transport.description import RobotDescription
from transport.messages import STOP, Pose, Twist

components = st.floats(-5, 5)
twists = st.builds(Twist, components, components, components)
sizes = st.floats(0.05, 3)
all_limits = st.builds(
    Limits,
    speed=sizes,
    turn_rate=sizes,
    acceleration=sizes,
    turn_acceleration=sizes,
    translation=st.sampled_from(["norm", "axis"]),
)
differential = st.builds(Differential, kind=st.just("differential"), track=sizes, wheel_speed=sizes)
bases = st.one_of(st.just(Holonomic()), differential)
SLACK = 1 + 1e-9


def rims(base, twist):
    return twist.forward - twist.turn * base.track / 2, twist.forward + twist.turn * base.track / 2


def keeps(base, limits, twist):
    largest = (
        hypot(twist.forward, twist.left) if limits.translation == "norm" else max(abs(twist.forward), abs(twist.left))
    )
    within = largest <= limits.speed * SLACK and abs(twist.turn) <= limits.turn_rate * SLACK
    if isinstance(base, Differential):
        within = within and twist.left == 0.0 and max(map(abs, rims(base, twist))) <= base.wheel_speed * SLACK
    return within


@given(bases, all_limits, twists)
def test_what_is_limited_keeps_the_limits_and_is_limited_no_further(base, limits, wanted):
    got = base.limited(wanted, limits)
    assert keeps(base, limits, got)
    again = base.limited(got, limits)
    assert (again.forward, again.left, again.turn) == pytest.approx((got.forward, got.left, got.turn), rel=1e-12)


@given(bases, all_limits, twists)
def test_what_is_well_within_the_limits_is_left_alone(base, limits, wanted):
    got = base.limited(wanted, limits)
    calm = Twist(0.9 * got.forward, 0.9 * got.left, 0.9 * got.turn)
    assert base.limited(calm, limits) == calm


@given(twists)
def test_the_norm_is_kept_and_the_direction_stays(wanted):
    got = Holonomic().limited(wanted, Limits())
    if wanted.speed > 1e-6:
        assert atan2(got.left, got.forward) == pytest.approx(atan2(wanted.left, wanted.forward), abs=1e-9)
    assert got.turn * wanted.turn >= 0


@given(differential, all_limits, twists)
def test_a_base_on_two_wheels_stays_on_its_circle(base, limits, wanted):
    got = base.limited(wanted, limits)
    assert got.forward * wanted.turn == pytest.approx(got.turn * wanted.forward, abs=1e-12)
    braked = base.towards(got, STOP, limits, 0.01)
    assert braked.forward * got.turn == pytest.approx(braked.turn * got.forward, abs=1e-12)


@given(bases, all_limits, twists, twists, st.floats(0.01, 0.5))
def test_no_step_exceeds_the_acceleration_nor_leaves_the_limits(base, limits, before, wanted, period):
    before, wanted = base.limited(before, limits), base.limited(wanted, limits)
    got = base.towards(before, wanted, limits, period)
    change = hypot(got.forward - before.forward, got.left - before.left)
    assert change <= limits.acceleration * period * SLACK
    assert abs(got.turn - before.turn) <= limits.turn_acceleration * period * SLACK
    assert keeps(base, limits, got)


@given(bases, all_limits, twists)
@settings(max_examples=50)
def test_braking_ends_in_an_exact_stop(base, limits, start):
    twist = base.limited(start, limits)
    for _ in range(601):  # from 3 m/s at 0.05 m/s^2
        twist = base.towards(twist, STOP, limits, 0.1)
    assert twist is STOP


@given(bases, st.floats(-3, 3), st.floats(-2, 2), st.floats(0.1, 3))
def test_a_constant_twist_leads_round_its_circle(base, heading, turn, time):
    twist = base.limited(Twist(0.4, 0.2, turn), Limits())
    pose = begin = Pose(1.0, -2.0, heading)
    for _ in range(50):
        pose = integrate(pose, twist, time / 50)
    at_once = integrate(begin, twist, time)
    assert (pose.x, pose.y) == pytest.approx((at_once.x, at_once.y), abs=1e-9)
    if abs(twist.turn) > 0.1:
        # A whole circle ends where it began.
        whole = integrate(begin, twist, tau / abs(twist.turn))
        assert (whole.x, whole.y) == pytest.approx((begin.x, begin.y), abs=1e-9)


def test_a_base_that_is_only_named_has_its_wheels_at_its_sides():
    robot = RobotDescription.model_validate({"base": "differential", "limits": {"speed": 0.3, "turn_rate": 2.0}})
    assert isinstance(robot.base, Differential)
    assert robot.base.track == pytest.approx(2 * robot.half_width)
    assert robot.base.wheel_speed == pytest.approx(0.3 + 2.0 * robot.half_width)
    assert isinstance(RobotDescription.model_validate({"base": "holonomic"}).base, Holonomic)


@pytest.mark.parametrize(
    "base", ["tracks", {"kind": "differential", "track": -1.0}, {"kind": "differential", "wheel_speed": inf}, 3]
)
def test_a_base_that_is_none_is_refused(base):
    with pytest.raises(ValidationError, match="base"):
        RobotDescription.model_validate({"base": base})
