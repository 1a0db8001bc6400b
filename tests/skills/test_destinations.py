"""What machines ask of the map: where they are, where they have been, what is unexplored, and the ways to places."""

import math
from itertools import count

import numpy as np
import pytest

from perception import Perception
from perception.mapping import MappingSettings
from perception.mapping.settings import PlanSettings
from perception.marks import Direction
from perception.settings import PerceptionSettings
from perception.world import DoorPlace
from skills.activities.explore import Explore
from skills.activities.go_to import GoTo
from skills.strategies import places
from skills.strategies.destinations import NEVER, Destination
from tests.perception.scenes import PICO, cells, observe
from transport.messages import Pose

WALLS = cells(["#######", "#.....#", "###.#.#", "#...#.#", "#######"])
START = Pose(3.5, -1.5, -math.pi / 2)
SHARE = 1.1
"""A way over the grid is at most this many times as long as the straight one."""


STAMPS = count(0, 100_000_000)
"""Of the ticks, ns."""


def driven(perception, y, end):
    """The facts at the end of a way along the long corridor, in steps of 4 cm; the robot looks as at its start."""
    rng, facts = np.random.default_rng(1), None
    for number in range(round(abs(end - y) / 0.04) + 1):
        pose = Pose(START.x, y + math.copysign(0.04 * number, end - y), START.heading)
        facts = perception.facts(observe(WALLS, pose, rng=rng, stamp=next(STAMPS)))
        places.map_begin(facts)
    return facts


@pytest.fixture(scope="module")
def trip():
    """The facts at the start, two metres on, where a place was marked, at the corridor's end, and back at the start."""
    perception = Perception(PICO)
    told = []

    def tell(facts):
        told.append(
            {
                "x": places.place_x(facts),
                "y": places.place_y(facts),
                "heading": places.place_heading(facts),
                "visited": places.place_visited(facts),
                "edges": places.map_edges(facts),
                "unexplored": {way for way in Direction if places.map_unexplored(facts, way)},
                "known": {to for to in Destination if places.way_known(facts, to)},
                "distance": {to: places.way_distance(facts, to) for to in Destination},
                "time": {to: places.way_time(facts, to) for to in Destination},
                "turn": {to: places.way_turn(facts, to) for to in Destination},
            }
        )

    tell(driven(perception, -1.5, -1.5))
    facts = driven(perception, -1.5, -3.5)
    places.place_mark(facts)
    tell(facts)
    facts = driven(perception, -3.54, -5.3)
    tell(facts)
    facts.world.dead_ends = [DoorPlace((2.0, 0.4), (2.0, -0.4))]
    facts.world.way_out = (1.0, 0.0)
    tell(facts)
    tell(driven(perception, -5.3, -1.5))
    return told


def test_where_am_i(trip):
    start, middle, end, _, back = trip
    # The frame begins where the run begins, its x axis along the corridor.
    assert (start["x"], start["y"]) == pytest.approx((0.0, 0.0), abs=0.01)
    assert math.hypot(middle["x"], middle["y"]) == pytest.approx(2.0, abs=0.02)
    assert math.hypot(end["x"], end["y"]) == pytest.approx(3.8, abs=0.02)
    assert (back["x"], back["y"]) == pytest.approx((0.0, 0.0), abs=0.02)
    assert back["heading"] == pytest.approx(start["heading"], abs=0.01)


def test_have_i_been_here(trip):
    assert [one["visited"] for one in trip] == [False, False, False, False, True]


def test_which_ways_are_unexplored(trip):
    start, middle, end, *_ = trip
    assert start["unexplored"] == {Direction.AHEAD, Direction.BACK}, "behind it the robot has not looked"
    assert Direction.RIGHT in middle["unexplored"], "round the bend of the branch"
    assert Direction.LEFT not in middle["unexplored"] | end["unexplored"], "only walls are there"
    assert Direction.BACK in end["unexplored"], "the branch is behind"
    assert all(one["edges"] >= 1 for one in trip)


def test_the_way_to_the_start_and_to_a_marked_place(trip):
    start, middle, end, *_ = trip
    assert Destination.MARKED not in start["known"]
    assert start["distance"][Destination.MARKED] == 1000
    assert start["time"][Destination.MARKED] == NEVER
    assert start["turn"][Destination.MARKED] == 0
    assert start["distance"][Destination.START] < 0.15
    assert 2.0 - 0.1 < middle["distance"][Destination.START] < 2.0 * SHARE
    assert 1.8 - 0.1 < end["distance"][Destination.MARKED] < 1.8 * SHARE
    assert abs(end["turn"][Destination.MARKED]) == pytest.approx(math.pi, abs=0.3)
    assert middle["distance"][Destination.MARKED] < 0.15


def test_the_time_is_that_of_the_way_and_of_the_turn_to_it(trip):
    end, limits = trip[2], PICO.limits
    for to in (Destination.START, Destination.MARKED, Destination.EDGE):
        expected = end["distance"][to] / limits.speed + abs(end["turn"][to]) / limits.turn_rate
        assert end["time"][to] == pytest.approx(expected)


def test_the_way_to_a_door_and_out(trip):
    before, end = trip[0], trip[3]
    assert before["known"].isdisjoint({Destination.DOOR, Destination.WAY_OUT})
    assert end["known"] == set(Destination)
    assert 2.8 - 0.1 < end["distance"][Destination.WAY_OUT] < 2.8 * SHARE
    assert 1.2 - 0.1 < end["distance"][Destination.DOOR] < 1.2 * SHARE, "in front of it, where the robot can ring"


def test_the_way_to_a_door_ends_where_the_settings_say():
    plan = PlanSettings(before_door=1.0)
    perception = Perception(PICO, PerceptionSettings(mapping=MappingSettings(plan=plan)))
    facts = driven(perception, -1.5, -3.5)
    facts.world.dead_ends = [DoorPlace((3.6, -0.4), (3.6, 0.4))]
    assert 0.6 - 0.1 < places.way_distance(facts, Destination.DOOR) < 0.6 * SHARE


def test_without_a_map_nothing_is_known():
    facts = Perception(PICO).facts(observe(WALLS, START, rng=np.random.default_rng(0)))
    places.place_mark(facts)
    assert not any(places.way_known(facts, to) for to in Destination)
    assert not any(places.map_unexplored(facts, way) for way in Direction)
    assert not places.place_visited(facts)
    assert (places.place_x(facts), places.place_y(facts), places.place_heading(facts)) == (0, 0, 0)
    assert places.map_edges(facts) == 0


def test_a_marked_place_moves_with_the_map():
    perception = Perception(PICO)
    facts = driven(perception, -1.5, -2.5)
    places.place_mark(facts)
    kept = facts.world.marks.places
    before = kept.pose_of(facts.world.marked)
    graph = facts.world.surveyor.mapper.graph
    graph.poses = [Pose(one.x + 0.3, one.y - 0.1, one.heading) for one in graph.poses]
    after = kept.pose_of(facts.world.marked)
    assert (after.x - before.x, after.y - before.y) == pytest.approx((0.3, -0.1), abs=1e-3)


class Explored:
    """Explores until the robot is so far from its start, then goes to a place."""

    def __init__(self, far, to):
        self.inner, self.far, self.to = Explore(), far, to

    def tick(self, facts):
        if isinstance(self.inner, Explore) and math.hypot(facts.pose.x, facts.pose.y) > self.far:
            self.inner = GoTo(self.to)
        return self.inner.tick(facts)


def test_a_robot_comes_back_to_its_start(drive, world):
    done = drive(Explored(1.5, Destination.START), world(WALLS, START), limit=40)
    assert done.outcome == "done"
    assert not done.touched
    assert math.hypot(done.end.x - START.x, done.end.y - START.y) < 0.15
    assert max(math.hypot(one.x - START.x, one.y - START.y) for one in done.path) > 1.4


@pytest.mark.parametrize("to", [Destination.MARKED, Destination.WAY_OUT, Destination.DOOR])
def test_to_a_place_that_is_not_known_it_does_not_go(drive, world, to):
    done = drive(GoTo(to), world(WALLS, START), limit=5)
    assert done.outcome == "none"


def test_a_speed_that_makes_no_sense_is_refused():
    with pytest.raises(ValueError, match="speed"):
        GoTo(Destination.START, speed=0.0)
