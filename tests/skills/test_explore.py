"""Driving over the map: exploring, going to what may be a door, and what the machine can ask."""

from __future__ import annotations

import math

import numpy as np
import pytest

from perception import Perception
from skills.activities.explore import Explore, GoToDoor
from skills.settings import SkillSettings
from skills.steering import steering_of
from skills.steering.way import ahead_on, along_way
from skills.strategies import places
from tests.perception.scenes import PICO, cells, observe
from transport.description import RobotDescription
from transport.messages import Pose

ROOMS = cells(["######", "#....#", "#.##.#", "#...##", "######"])
START = Pose(1.5, -1.5, 0.0)
TWO_WHEELS = RobotDescription.model_validate({"base": "differential"})


@pytest.mark.parametrize("robot", [PICO, TWO_WHEELS], ids=["holonomic", "differential"])
def test_a_closed_maze_is_explored_to_its_end(drive, world, robot):
    done = drive(Explore(), world(ROOMS, START), limit=90, robot=robot)
    assert done.outcome == "explored"
    assert not done.touched
    seen = {(math.floor(pose.x), math.floor(pose.y)) for pose in done.path}
    assert (3, -2) in seen


def test_a_dead_end_that_may_be_a_door_is_driven_to(drive, world):
    explored = Explore()

    class Both:
        def __init__(self):
            self.inner = explored

        def tick(self, facts):
            effect = self.inner.tick(facts)
            if getattr(effect, "name", "") == "explored":
                self.inner = GoToDoor()
                effect = self.inner.tick(facts)
            return effect

    done = drive(Both(), world(ROOMS, START), limit=120)
    assert done.outcome == "done"
    assert not done.touched


def test_nothing_is_no_door(drive, world):
    hall = [(-1.5, -1.5, 1.5, -1.5), (1.5, -1.5, 1.5, 1.5), (1.5, 1.5, -1.5, 1.5), (-1.5, 1.5, -1.5, -1.5)]
    assert drive(GoToDoor(), world(hall, Pose()), limit=5).outcome == "none"


@pytest.mark.parametrize("activity", [Explore, GoToDoor])
def test_a_speed_that_makes_no_sense_is_refused(activity):
    with pytest.raises(ValueError, match="speed"):
        activity(speed=0.0)


def test_a_way_is_headed_for_some_way_ahead():
    way = tuple((0.1 * number, 0.0) for number in range(30))
    place, left = ahead_on(way, (0.52, 0.1))
    assert 0.75 < place[0] < 1.15
    assert left == pytest.approx(2.4)
    assert ahead_on(way, (2.85, 0.0))[0] == way[-1]


def test_a_robot_turns_first_to_what_it_does_not_see():
    steering = steering_of(PICO, SkillSettings())
    way = tuple((-0.1 * number, 0.0) for number in range(20))
    twist = along_way(steering, way, Pose(), 0.5, to_rest=False)
    assert twist.speed == 0
    assert abs(twist.turn) > 0.5


def test_the_signals_of_the_map():
    perception = Perception(PICO)
    facts = perception.facts(observe(ROOMS, START, rng=np.random.default_rng(0)))
    assert not places.map_known(facts)
    assert not places.place_known(facts)
    assert places.map_doors(facts) == 0
    assert places.place_deviation(facts) == 1000
    places.map_begin(facts)
    assert places.map_known(facts)
    assert places.place_known(facts)
    assert places.place_deviation(facts) < 0.01
    pose = facts.pose
    places.map_begin(facts)
    assert facts.pose == pose
