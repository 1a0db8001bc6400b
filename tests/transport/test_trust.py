"""When a robot must stand for lack of knowledge, and what time it is where its clock misbehaves."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from transport.description import Laser
from transport.driver import Sensed
from transport.messages import NANOSECONDS, LinkStatus, Odometry, Pose, Scan, ScanGeometry
from transport.sanity import ScanError, conformed, observed
from transport.senses import Freshness, Senses
from transport.settings import LinkSettings
from transport.timeline import Timeline
from transport.trust import Trust

SETTINGS = LinkSettings()
LASER = Laser()
STALE, RESUME = SETTINGS.stale, SETTINGS.resume


def scan(ranges: float | np.ndarray = 1.0, stamp: int = 0, shape: ScanGeometry | None = None) -> Scan:
    shape = shape or LASER.geometry()
    return Scan(stamp, shape, np.broadcast_to(np.float32(ranges), (shape.beams,)).astype(np.float32))


# The rule


def test_a_robot_stands_as_soon_as_a_sensor_is_too_old_and_until_both_were_good_for_a_while() -> None:
    trust = Trust(SETTINGS)
    assert trust.look(LinkStatus(STALE, STALE), 0.0) == ""
    assert trust.look(LinkStatus(STALE + 0.01, 0.0), 0.1) == "no scan for 0.36 s"
    assert trust.look(LinkStatus(0.5, 0.6), 0.2) == "no scan for 0.50 s and no odometry for 0.60 s"
    assert trust.look(LinkStatus(), 0.3)
    assert trust.look(LinkStatus(), 0.3 + RESUME - 0.01)
    assert trust.look(LinkStatus(), 0.3 + RESUME) == ""


def test_a_sensor_that_comes_and_goes_keeps_the_robot_standing() -> None:
    trust = Trust(SETTINGS)
    statuses = [LinkStatus(refused="odd") if k % 3 == 0 else LinkStatus() for k in range(60)]
    assert all(trust.look(status, 0.1 * k) == "odd" for k, status in enumerate(statuses))


@given(st.lists(st.tuples(st.floats(0, 1), st.floats(0, 1), st.sampled_from(["", "odd"])), max_size=30))
def test_who_may_drive_has_fresh_and_credible_data_and_had_it_since_he_stopped(statuses) -> None:
    trust, bad = Trust(SETTINGS), -math.inf
    for k, (scan_age, odometry_age, refused) in enumerate(statuses):
        good = not refused and max(scan_age, odometry_age) <= STALE
        bad = bad if good else 0.1 * k
        may = not trust.look(LinkStatus(scan_age, odometry_age, refused=refused), 0.1 * k)
        assert may <= good
        assert may == (good and 0.1 * k - bad >= 0.1 + RESUME - 1e-6)


def test_in_lockstep_ages_and_faults_follow_from_the_data_alone() -> None:
    odometry = Odometry.at(4 * NANOSECONDS, Pose())
    link = observed(5 * NANOSECONDS, scan(stamp=2 * NANOSECONDS), odometry).link
    assert (link.scan_age, link.odometry_age, link.refused) == (3.0, 1.0, "")
    assert "0 of 1000 beams" in observed(0, scan(math.nan), odometry).link.refused
    assert "not finite" in observed(0, scan(), replace(odometry, x=math.inf)).link.refused


def test_an_observation_says_what_is_judged_of_it_now_whatever_a_recording_says() -> None:
    trust, seen = Trust(SETTINGS), observed(0, scan(), Odometry.at(0, Pose()))
    assert trust.judged(seen) is seen
    old = replace(seen, link=replace(seen.link, blind="once"))
    assert trust.judged(old) == seen
    stale = replace(seen, link=replace(seen.link, scan_age=1.0))
    assert trust.judged(stale).link.blind == "no scan for 1.00 s"


# How old data are


def test_the_age_of_data_is_known_without_the_clocks_agreeing() -> None:
    freshness = Freshness()
    assert freshness.age(0.0) == math.inf
    for k in range(10):
        freshness.arrived((1000 + k) * NANOSECONDS // 10, 50.0 + 0.1 * k)
    assert freshness.age(50.9 + 0.2) == pytest.approx(0.2, abs=1e-3)
    freshness.arrived(1010 * NANOSECONDS // 10, 51.0 + 2.0)  # a network that held it up
    assert freshness.age(53.0) == pytest.approx(2.0, abs=2e-3)


@pytest.mark.parametrize("drift", [-4e-4, 4e-4])
def test_clocks_that_drift_apart_make_no_data_old(drift: float) -> None:
    freshness = Freshness()
    for k in range(0, 36_000, 3):  # an hour
        freshness.arrived(round(0.1 * k * (1 + drift) * NANOSECONDS) + 1, 0.1 * k)
        assert freshness.age(0.1 * k) < 0.01


def test_the_same_message_again_is_no_younger_unless_there_are_no_stamps() -> None:
    for stamp, age in ((7, 0.5), (0, 0.0)):
        freshness = Freshness()
        freshness.arrived(stamp, 1.0)
        freshness.arrived(stamp, 1.5)
        assert freshness.age(1.5) == pytest.approx(age, abs=1e-9)


def test_what_was_refused_is_counted_and_forgotten_with_the_next_good_one() -> None:
    senses = Senses(LASER)
    senses.take(Sensed(scan(), Odometry.at(0, Pose())), 0.0)
    senses.take(Sensed(scan(math.nan)), 0.1)
    assert "almost nothing" in senses.refused
    assert senses.dropped.total() == 1
    assert senses.ages(0.2)[0] == pytest.approx(0.2)
    senses.take(Sensed(scan(stamp=1)), 0.3)
    assert senses.refused == ""


# What time it is


STEPS = st.one_of(
    st.floats(0.05, 0.15),
    st.just(0.0),
    st.floats(-1e5, 1e5),
)


@given(st.integers(0, 10**15), st.lists(STEPS, max_size=40))
def test_time_neither_goes_back_nor_jumps_whatever_the_stamps_do(stamp: int, steps: list[float]) -> None:
    timeline, last = Timeline(STALE), None
    for k, step in enumerate(steps):
        stamp = max(0, stamp + round(step * NANOSECONDS))
        time = timeline.tick(stamp, 0.1 * k, fresh=True)
        assert last is None or 0 <= time - last <= 1.2 * NANOSECONDS
        last = time


@given(st.integers(0, 10**15), st.lists(st.floats(0.05, 0.3), min_size=1, max_size=40))
def test_the_stamps_of_a_clock_that_runs_are_taken_as_they_are(stamp: int, steps: list[float]) -> None:
    timeline, now = Timeline(STALE), 0.0
    for step in steps:
        stamp, now = stamp + round(step * NANOSECONDS), now + 0.15
        assert timeline.tick(stamp, now, fresh=True) == stamp
        now += step - 0.15
    assert not timeline.faults


@pytest.mark.parametrize(
    ("stamps", "fault"),
    [
        (lambda k: 0, "stood still"),
        (lambda k: k - 1000 * (k > 20), "was set back"),
        (lambda k: k + 36_000 * (k > 20), "jumped"),
    ],
)
def test_time_goes_on_at_this_sides_pace_where_the_robots_clock_fails(stamps, fault: str) -> None:
    timeline = Timeline(STALE)
    times = [timeline.tick((1000 + stamps(k)) * NANOSECONDS // 10, 0.1 * k, fresh=True) for k in range(100)]
    assert times[-1] - times[0] == pytest.approx(9.9 * NANOSECONDS, abs=0.5 * NANOSECONDS)
    assert dict(timeline.faults) == {fault: 1}


def test_time_goes_on_while_nothing_comes() -> None:
    timeline = Timeline(STALE)
    times = [timeline.tick(5, 0.1 * k, fresh=False) for k in range(50)]
    assert times[3] == 5
    assert times[-1] - 5 == pytest.approx(4.6 * NANOSECONDS, abs=0.11 * NANOSECONDS)
    assert not timeline.faults


# Scans of other habits


def test_a_scan_of_the_profiles_laser_is_left_as_it_is() -> None:
    given_ = scan()
    assert conformed(given_, LASER) is given_


@st.composite
def seen(draw) -> tuple[Laser, Scan, Scan]:
    """A laser, what it would read in a round room off its middle, and the same as a laser with habits reads it."""
    beams = draw(st.integers(90, 1200))
    all_round = draw(st.booleans())
    span = math.tau * (1 - 1 / beams) if all_round else draw(st.floats(1.0, 5.5))
    first = draw(st.floats(-math.pi, math.pi - 0.1))
    laser = Laser(beams=beams, angle_min=first, angle_max=first + span)
    step = span / (beams - 1)
    few = draw(st.integers(-2, 2))
    start = first + (step * draw(st.integers(0, beams - 1)) if all_round else 0.0)
    start += math.tau * draw(st.integers(-1, 1))
    count, given_step = beams + few, math.tau / (beams + few) if all_round else step
    shape = ScanGeometry(count, start, given_step, 0.01, 10.0)

    def read(geometry: ScanGeometry) -> np.ndarray:
        return (3.0 + np.cos(geometry.angles() - 0.3)).astype(np.float32)

    given_ = Scan(0, shape, read(shape))
    if draw(st.booleans()):
        turned = ScanGeometry(count, shape.angle_max, -given_step, 0.01, 10.0)
        given_ = Scan(0, turned, given_.ranges[::-1])
    return laser, Scan(0, laser.geometry(), read(laser.geometry())), given_


@given(seen())
@settings(deadline=None)
def test_each_direction_reads_what_its_nearest_beam_does_whatever_the_order(case: tuple[Laser, Scan, Scan]) -> None:
    laser, expected, given_ = case
    result = conformed(given_, laser)
    assert result.geometry == expected.geometry
    known = ~np.isnan(result.ranges)
    assert np.count_nonzero(~known) <= 4
    step = laser.geometry().angle_increment
    assert np.abs(result.ranges - expected.ranges)[known].max() <= 1.6 * step + 1e-4


@pytest.mark.parametrize(
    ("shape", "reason"),
    [
        (ScanGeometry(500, -2.0, 4 / 499, 0.01, 10.0), r"500 beams, the profile says 1000 \(robot.laser.beams\)"),
        (ScanGeometry(1000, -1.0, 4 / 999, 0.01, 10.0), r"from -1.000 to 3.000 rad, the profile says -2.000 to 2.000"),
        (ScanGeometry(1000, -2.0, 0.0, 0.01, 10.0), "the scan reaches from -2.000 to -2.000 rad"),
        (ScanGeometry(1000, math.nan, 4 / 999, 0.01, 10.0), "the scan reaches from nan"),
        (ScanGeometry(1000, -2.0, 4 / 999, 0.01, 5.0), "longest range is 5 m, the profile says 10 m"),
        (ScanGeometry(1000, -2.0, 4 / 999, 0.01, math.nan), "longest range is nan m"),
        (ScanGeometry(1000, -2.0, 4 / 999, -1.0, 10.0), "shortest range is -1 m"),
    ],
)
def test_scans_of_another_laser_are_refused_with_the_setting_to_change(shape: ScanGeometry, reason: str) -> None:
    with pytest.raises(ScanError, match=reason):
        conformed(scan(shape=shape), LASER)


def test_a_scan_with_fewer_readings_than_beams_is_refused() -> None:
    with pytest.raises(ScanError, match="10 ranges for 1000 beams"):
        conformed(Scan(0, LASER.geometry(), np.ones(10, np.float32)), LASER)


@pytest.mark.parametrize("value", [math.inf, -math.inf, 20.0, 0.5])
def test_whatever_a_beam_measures_is_sight(value: float) -> None:
    conformed(scan(value), LASER)


@pytest.mark.parametrize("value", [math.nan, 0.0, -1.0, 0.005])
def test_a_laser_that_measures_nothing_is_refused(value: float) -> None:
    with pytest.raises(ScanError, match="the laser sees almost nothing: 0 of 1000"):
        conformed(scan(value), LASER)
    ranges = np.full(1000, np.float32(value))
    ranges[:100] = 1.0
    if value < 0:
        with pytest.raises(ScanError, match="negative ranges"):
            conformed(scan(ranges), LASER)
    else:
        conformed(scan(ranges), LASER)
