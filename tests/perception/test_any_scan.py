"""Any scan geometry and any readings: every fact and every signal has a value, and says when it is not known."""

from __future__ import annotations

import math
import os
from enum import StrEnum

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from perception.facts import Facts, Perception
from perception.signals import LIBRARY
from tests.perception.scenes import PICO, corridor, observation_of, scan_of
from transport.description import Laser, RobotDescription
from transport.messages import Pose, Scan, ScanGeometry

EXAMPLES = int(os.environ.get("PERCEPTION_EXAMPLES", "60"))
FACTS = [name for name in dir(Facts) if not name.startswith("_") and name not in ("observation", "robot", "settings")]

readings = st.one_of(
    st.floats(width=32, allow_nan=True, allow_infinity=True),
    st.sampled_from([0.0, -0.0, 0.005, 0.01, 10.0, 1e-30, 3e38, math.inf, -math.inf, math.nan]),
    st.floats(0.0, 12.0, width=32),
)
geometries = st.builds(
    ScanGeometry,
    beams=st.integers(0, 40),
    angle_min=st.one_of(st.floats(-7, 7), st.sampled_from([math.nan, math.inf])),
    angle_increment=st.one_of(st.floats(-0.5, 0.5), st.sampled_from([0.0, math.nan, math.inf, 1e-30])),
    range_min=st.sampled_from([0.0, 0.01, 0.5, math.nan, -1.0, math.inf]),
    range_max=st.sampled_from([10.0, 0.0, -1.0, math.nan, math.inf, 1e30]),
)
mounts = st.sampled_from([Laser(), Laser(mount_x=0.1, mount_y=-0.2, mount_heading=2.0), Laser(mount_heading=math.pi)])


def everything(facts):
    """All facts and signals of a tick."""
    for name in FACTS:
        getattr(facts, name)
    for name, signal in LIBRARY.signals.items():
        value = signal.function(facts)
        assert isinstance(value, bool | int | float | StrEnum), name
        if isinstance(value, float):
            assert math.isfinite(value), name
    for action in LIBRARY.actions.values():
        action.function(facts)
    return {name: signal.function(facts) for name, signal in LIBRARY.signals.items()}


def unknown(values):
    """That no signal claims to know anything."""
    assert not any(value for name, value in values.items() if name.endswith(".known"))
    for name in ("space.left", "space.front", "space.right", "exit.crossed", "exit.ahead", "door.near", "open_space"):
        assert not values[name]
    assert values["junction"] == "unknown"


@given(geometries, st.data(), mounts)
@settings(deadline=None, derandomize=True, max_examples=EXAMPLES)
def test_absurd_scans(geometry, data, laser):
    size = data.draw(st.sampled_from([geometry.beams, geometry.beams + 1, 0]))
    ranges = np.array(data.draw(st.lists(readings, min_size=size, max_size=size)), np.float32)
    robot = RobotDescription(laser=laser)
    observation = observation_of(Scan(0, geometry, ranges))
    perception_ = Perception(robot)
    for _ in range(4):
        values = everything(perception_.facts(observation))
    if not geometry.beams or size != geometry.beams:
        unknown(values)


@pytest.mark.parametrize("ranges", [np.empty(0), np.full(1000, np.nan), np.full((10, 100), 1.0), np.full(3, 1.0)])
def test_a_scan_without_readings_is_unknown(ranges):
    scan = Scan(0, PICO.laser.geometry(), ranges.astype(np.float32))
    unknown(everything(Perception(PICO).facts(observation_of(scan))))


def test_hits_at_the_sensor_itself_are_no_walls():
    scan = Scan(0, ScanGeometry(1000, -2.0, 0.004, 0.0, 10.0), np.zeros(1000, np.float32))
    facts = Perception(PICO).facts(observation_of(scan))
    everything(facts)
    assert facts.lines == ()


def test_nothing_is_known_of_a_side_to_which_no_beam_leads():
    laser = Laser(beams=20, angle_min=-0.02, angle_max=0.02)
    facts = Perception(RobotDescription(laser=laser)).facts(observation_of(scan_of(corridor(1.0), Pose(), laser)))
    everything(facts)
    assert not facts.junction.left.known
    assert not facts.junction.right.known


def lasers(beams, half_angle, reach):
    return Laser(beams=beams, angle_min=-half_angle, angle_max=half_angle, range_max=reach)


@pytest.mark.parametrize("mount", [(0.0, 0.0, 0.0), (0.1, 0.05, 0.2), (-0.05, 0.0, -0.1)])
@pytest.mark.parametrize(
    "laser",
    [
        lasers(180, math.pi / 2, 8.0),
        lasers(181, math.pi / 2, 80.0),
        lasers(360, math.pi / 2, 30.0),
        lasers(360, math.pi, 6.0),
        lasers(720, 2.356, 20.0),
        lasers(1000, 2.0, 10.0),
        lasers(1500, 3.1, 25.0),
    ],
)
def test_a_corridor_is_the_same_for_every_laser(laser, mount):
    laser = laser.model_copy(update=dict(zip(("mount_x", "mount_y", "mount_heading"), mount, strict=True)))
    robot = RobotDescription(laser=laser)
    rng = np.random.default_rng(1)
    walls = [*corridor(1.0, 5.0), (2.5, -0.5, 2.5, 0.5)]
    facts = Perception(robot).facts(observation_of(scan_of(walls, Pose(0, 0.05, 0.1), laser, rng)))
    everything(facts)
    assert facts.compass.misalignment == pytest.approx(-0.1, abs=math.radians(0.4))
    assert facts.centre.error == pytest.approx(-0.05, abs=0.006)
    # A sensor turned away does not see the wall's nearest point.
    assert 0.545 < facts.wall_right.distance < 0.64
    assert facts.wall_right.angle == pytest.approx(-0.1, abs=math.radians(1.5))
    assert facts.junction.kind == "corridor"
    assert not facts.space.left.free
    assert facts.space.front.free
    assert not facts.world.lane.outside


@given(st.integers(0, 10**6), st.integers(180, 1500), st.floats(1.6, 3.14), mounts)
@settings(deadline=None, derandomize=True, max_examples=EXAMPLES)
def test_a_clockwise_scan_says_the_same(seed, beams, half_angle, mount):
    laser = mount.model_copy(update={"beams": beams, "angle_min": -half_angle, "angle_max": half_angle})
    robot = RobotDescription(laser=laser)
    scan = scan_of(corridor(1.1, 6.0), Pose(0, 0, 0.1), laser, np.random.default_rng(seed))
    turned = ScanGeometry(
        beams, scan.geometry.angle_max, -scan.geometry.angle_increment, scan.geometry.range_min, scan.geometry.range_max
    )
    one = Perception(robot).facts(observation_of(scan))
    other = Perception(robot).facts(observation_of(Scan(0, turned, scan.ranges[::-1])))
    assert one.compass.misalignment == pytest.approx(other.compass.misalignment, abs=1e-4)
    assert one.clearance == pytest.approx(other.clearance, abs=1e-4)
    assert len(one.lines) == len(other.lines)


def test_facts_are_worked_out_once():
    facts = Perception(PICO).facts(observation_of(scan_of(corridor(1.0), Pose())))
    for name in ("sweep", "lines", "compass", "junction", "minimap", "hough", "nodes", "doors"):
        assert getattr(facts, name) is getattr(facts, name)
