"""What a robot sees in simple places: space, walls, the corridor's middle, a door area, the exit."""

from __future__ import annotations

import math

import numpy as np
import pytest

from perception import signals
from perception.facts import Perception
from perception.junction import JunctionKind
from perception.signals import LIBRARY
from tests.perception.scenes import PICO, corridor, observation_of, observe
from transport.messages import Pose, Scan

assert signals.LIBRARY is LIBRARY

MISALIGNMENTS = [math.radians(angle) for angle in (-10, -3, 0, 7, 10)]
WIDTHS = [0.7, 1.0, 1.5]


def value(name, facts):
    return LIBRARY.signals[name].function(facts)


def facts_at(walls, pose, seed=1):
    return Perception(PICO).facts(observe(walls, pose, rng=np.random.default_rng(seed)))


@pytest.mark.parametrize("degrees", [-18, -9.5, 0, 9.5, 18])
@pytest.mark.parametrize("side", ["left", "right"])
def test_space_is_looked_for_along_the_walls_however_the_robot_stands(side, degrees):
    """Just past a way to a side, whose near corner is still beside: a slanted robot would look back into it."""
    sign = 1 if side == "left" else -1
    level = sign * 0.5
    walls = [(-1.0, -level, 6.0, -level), (-3.0, level, -1.2, level), (-0.06, level, 6.0, level)]
    facts = facts_at(
        [*walls, (-1.2, level, -1.2, 4 * level), (-0.06, level, -0.25, 4 * level)], Pose(heading=math.radians(degrees))
    )
    assert [value(f"space.{one}", facts) for one in ("left", "front", "right")] == [False, True, False]
    for one in ("left", "right"):
        assert value(f"distance.{one}", facts) == pytest.approx(0.5, abs=0.02)


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("angle", MISALIGNMENTS)
def test_a_corridor(width, angle):
    facts = facts_at(corridor(width), Pose(0.0, 0.05, angle))
    assert [value(f"space.{side}", facts) for side in ("left", "front", "right")] == [False, True, False]
    assert value("misalignment", facts) == pytest.approx(-angle, abs=math.radians(0.2))
    assert value("centre.error", facts) == pytest.approx(-0.05, abs=0.003)
    assert value("wall.right", facts) == pytest.approx(width / 2 + 0.05, abs=0.003)
    assert value("wall.left", facts) == pytest.approx(width / 2 - 0.05, abs=0.003)
    assert value("wall.right.angle", facts) == pytest.approx(-angle, abs=math.radians(0.3))
    assert not value("door.near", facts)
    assert not value("exit.crossed", facts)


@pytest.mark.parametrize("width", [0.6, 1.0, 1.4])
@pytest.mark.parametrize("angle", MISALIGNMENTS)
def test_a_dead_end_may_be_a_door_where_the_robot_is_near_enough(width, angle):
    walls = [(-3, width / 2, 2, width / 2), (-3, -width / 2, 2, -width / 2), (2, -width / 2, 2, width / 2)]
    assert value("door.near", facts_at(walls, Pose(1.1, 0, angle)))
    assert value("door.distance", facts_at(walls, Pose(1.1, 0, angle))) == pytest.approx(0.9, abs=0.01)
    assert not value("door.near", facts_at(walls, Pose(0.75, 0, angle)))


def test_a_remembered_door_is_known_again_and_opens():
    shut = [(-3, 0.5, 5, 0.5), (-3, -0.5, 5, -0.5), (2, -0.5, 2, 0.5)]
    half_open = [*shut[:2], (2, 0.2, 2, 0.5)]
    perception = Perception(PICO)
    rng = np.random.default_rng(5)
    facts = perception.facts(observe(shut, Pose(1.0, 0.1, 0.05), rng=rng))
    assert not value("door.tried", facts)
    LIBRARY.actions["door.remember"].function(facts)
    facts = perception.facts(observe(shut, Pose(1.2, 0.05, -0.05), rng=rng))
    assert value("door.tried", facts)
    assert not value("door.open", facts)
    assert not value("door.passable", facts)
    facts = perception.facts(observe(half_open, Pose(1.2, -0.1, -0.05), rng=rng))
    assert not value("door.open", facts)
    facts = perception.facts(observe(shut[:2], Pose(1.2, 0.05, -0.05), rng=rng))
    assert value("door.open", facts)
    assert value("door.passable", facts)


@pytest.mark.parametrize("reading", [math.nan, math.inf, -math.inf, 0.0, -1.0, 1e30, 0.5])
def test_every_signal_has_a_value_for_a_scan_of_one_reading(reading):
    ranges = np.full(1000, reading, np.float32)
    facts = Perception(PICO).facts(observation_of(Scan(0, PICO.laser.geometry(), ranges)))
    for name in LIBRARY.signals:
        assert isinstance(value(name, facts), bool | int | float | JunctionKind)
    assert not value("exit.crossed", facts)
