"""Door areas: found from within, and nothing else taken for one."""

from __future__ import annotations

import math

import numpy as np
import pytest

from perception.facts import Perception
from tests.perception.doors import NEGATIVES, dead_end, door, scenes
from tests.perception.scenes import PICO, observe
from transport.messages import Pose


def facts_at(walls, pose, rng):
    return Perception(PICO).facts(observe(walls, pose, rng=rng))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_doors_are_found_and_only_doors(seed):
    rng = np.random.default_rng(seed)
    missed, false = [], []
    for scene in scenes(np.random.default_rng([seed, 1]), 180):
        found = facts_at(scene.walls, scene.pose, rng).door is not None
        if found and not scene.is_door:
            false.append(scene)
        if scene.is_door and not found:
            missed.append(scene)
    assert not false
    assert len(missed) <= 1, missed


def test_every_kind_of_scene_occurs():
    kinds = {scene.kind for scene in scenes(np.random.default_rng(1), 60)}
    assert len(kinds) == len(NEGATIVES) + 2


@pytest.mark.parametrize("seed", [4, 5])
def test_where_the_door_is(seed):
    rng = np.random.default_rng(seed)
    for _ in range(40):
        scene = door(rng)
        found = facts_at(scene.walls, scene.pose, rng).door
        width = scene.walls[1][3] - scene.walls[1][1]
        assert found.width == pytest.approx(width, abs=0.03)
        assert found.distance == pytest.approx(-scene.pose.x, abs=0.01)
        assert found.facing == pytest.approx(-scene.pose.heading, abs=math.radians(1.5))


def test_the_rules_area_ends_where_a_part_of_the_robot_is_too_far():
    walls = dead_end(1.0, 4.0, "open")
    for x in np.arange(-1.6, -0.5, 0.02):
        found = facts_at(walls, Pose(x, 0.0), np.random.default_rng(1)).door
        reach = -x + 0.1
        if reach < 1.28:
            assert found
            assert found.reach == pytest.approx(reach, abs=0.01)
        if reach > 1.3:
            assert not found


def test_something_before_a_door_hides_it():
    walls = [*dead_end(1.2, 4.0, "open"), (-0.5, -0.15, -0.5, 0.15)]
    assert facts_at(walls, Pose(-1.1, 0.0), np.random.default_rng(1)).door is None


def test_all_dead_ends_in_sight_are_listed_the_nearest_first():
    walls = [*dead_end(1.0, 0.5, "walls"), (-0.5, 3.0, -3, 3.0), (-0.5, -3.0, -3, -3.0)]
    doors = facts_at(walls, Pose(-1.5, 0.0), np.random.default_rng(1)).doors
    assert len(doors) >= 1
    assert doors[0].width == pytest.approx(1.0, abs=0.03)
    assert [one.distance for one in doors] == sorted(one.distance for one in doors)


@pytest.mark.parametrize("beams", [180, 360])
def test_beams_that_are_far_apart_find_doors_too(beams):
    """The lines of two walls leave out some beams at their corner."""
    laser = PICO.laser.model_copy(update={"beams": beams, "angle_min": 0.0, "angle_max": math.tau * (1 - 1 / beams)})
    robot = PICO.model_copy(update={"laser": laser})
    rng = np.random.default_rng(beams)
    found = {True: [], False: []}
    for scene in scenes(np.random.default_rng([beams, 1]), 180):
        seen = Perception(robot).facts(observe(scene.walls, scene.pose, robot, rng=rng)).door is not None
        found[scene.is_door].append(seen)
    assert sum(found[True]) >= 0.85 * len(found[True])
    assert not any(found[False])
