"""What odometry's errors explain, and what only a robot that was carried does."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from perception.mapping.frames import compose
from perception.mapping.reckoning import Reckoning, Slip
from perception.mapping.settings import ReckoningSettings
from transport.messages import Pose

SETTINGS = ReckoningSettings()
STEP = st.builds(Pose, st.floats(-0.1, 0.1), st.floats(-0.1, 0.1), st.floats(-0.2, 0.2))


def driven(steps):
    reckoning = Reckoning(SETTINGS)
    for step in steps:
        reckoning.move(step)
    return reckoning


@given(st.lists(STEP, max_size=30), st.floats(-math.pi, math.pi))
def test_what_odometry_has_measured_is_allowed_and_what_is_much_farther_is_not(steps, direction):
    reckoning = driven(steps)
    assert reckoning.allows(reckoning.moved)
    much = SETTINGS.place + SETTINGS.place_way * reckoning.way + 0.01
    off = Pose(much * math.cos(direction), much * math.sin(direction))
    assert not reckoning.allows(compose(reckoning.moved, off))


def test_a_turn_that_odometry_has_not_noticed_is_not_allowed():
    reckoning = driven([Pose(0.05)] * 4)
    assert reckoning.allows(Pose(0.2, heading=SETTINGS.turn))
    assert not reckoning.allows(Pose(0.2, heading=0.3))


@pytest.mark.parametrize("ticks", [1, 3])
def test_each_tick_without_odometry_allows_what_a_robot_can_drive_in_it(ticks):
    reckoning = driven([None] * ticks)
    assert reckoning.allows(Pose(SETTINGS.most_step * ticks))
    assert not reckoning.allows(Pose(SETTINGS.most_step * ticks + SETTINGS.place + 0.01))


def test_wheels_that_have_slipped_may_have_slipped_again():
    slip = Slip().corrected(Pose(0.01, 0.0, 0.06), SETTINGS)
    for _ in range(3):
        slip = slip.corrected(Pose(), SETTINGS)
    turned = Pose(0.05, heading=SETTINGS.turn + 0.1)
    for known, allowed in ((Slip(), False), (slip, True)):
        reckoning = Reckoning(SETTINGS, known)
        reckoning.move(Pose(0.05))
        assert reckoning.allows(turned) is allowed
    for _ in range(40):
        slip = slip.corrected(Pose(), SETTINGS)
    assert slip.turn < 0.002, "once they no longer slip it is forgotten"
