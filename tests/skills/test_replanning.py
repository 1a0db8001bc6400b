"""A way over the map that has become blocked: a door that has shut again, or something that was not there before."""

import copy
import math
from itertools import pairwise

import numpy as np
import pytest

from perception import Perception
from perception.mapping.frames import between, compose
from skills.activities.go_to import GoTo
from skills.chain import MotionChain
from skills.settings import SkillSettings
from skills.strategies.destinations import Destination
from tests.perception.scenes import PICO, cells, observe, polyline
from transport.messages import Pose

RING = cells(["#######", "#.....#", "#.###.#", "#.....#", "#######"])
"""Two corridors along y, at x = 1 to 2 and 3 to 4, joined at both ends."""
CORNERS = [(3.5, -1.5), (1.5, -1.5), (1.5, -5.5), (3.5, -5.5), (3.5, -1.5)]
GOAL = Pose(1.5, -4.5)
SHORTER = (1.0, -3.5, 2.0, -3.5)
"""Across the corridor through which the way to the goal is 2 m shorter."""
SECOND = 10
"""Ticks."""


def tour():
    """Poses once round the ring, at most 10 cm and 22 degrees apart."""
    poses = []
    for (x, y), (to_x, to_y) in pairwise(CORNERS):
        heading = math.atan2(to_y - y, to_x - x)
        before = poses[-1].heading if poses else heading
        turn = math.remainder(heading - before, math.tau)
        poses += [Pose(x, y, before + turn * part / 4) for part in range(1, 5) if turn]
        count = round(math.hypot(to_x - x, to_y - y) / 0.1)
        ways = (number / count for number in range(1, count + 1))
        poses += [Pose(x + (to_x - x) * way, y + (to_y - y) * way, before + turn) for way in ways]
    return poses


@pytest.fixture(scope="module")
def toured():
    """Perception that has seen all of the ring, the last pose, and what takes a pose of the map to one of the ring."""
    perception, rng, poses = Perception(PICO), np.random.default_rng(5), tour()
    first = None
    for number, pose in enumerate(poses):
        facts = perception.facts(observe(RING, pose, rng=rng, stamp=number * 100_000_000))
        facts.world.begin_map(facts.sweep)
        first = first or (pose, facts.pose)
    facts.world.marked = facts.world.marks.places.fixed(compose(first[1], between(first[0], GOAL)))
    return perception, poses, first


def ways_after(toured, new, near, seed):
    """The way of each tick after something new has come, as soon as the robot is so near to y of it, m."""
    perception, poses, (there, here) = copy.deepcopy(toured)
    rng, chain, activity = np.random.default_rng(seed), MotionChain(PICO, SkillSettings()), GoTo(Destination.MARKED)
    pose, ways, come = poses[-1], [], False
    for number in range(len(poses), len(poses) + 150):
        come = come or (pose.x < 2.0 and pose.y - new[0][1] < near)
        walls = [*RING, *new] if come else RING
        facts = perception.facts(observe(walls, pose, rng=rng, stamp=number * 100_000_000))
        twist = chain.shape(activity.tick(facts), facts).twist
        if come:
            places = (compose(there, between(here, Pose(*place))) for place in activity._way)
            ways.append([(place.x, place.y) for place in places])
            assert facts.world.place_known
        if len(ways) > SECOND:
            return ways
        middle = pose.heading + twist.turn * 0.05
        cosine, sine = math.cos(middle) * 0.1, math.sin(middle) * 0.1
        x, y = twist.forward * cosine - twist.left * sine, twist.forward * sine + twist.left * cosine
        pose = Pose(pose.x + x, pose.y + y, pose.heading + twist.turn * 0.1)
    raise AssertionError("the robot has not come there")


def passes(way):
    """Whether a way leads along the shorter corridor."""
    return any(x < 2.0 and min(y, next_y) < SHORTER[1] < max(y, next_y) for (x, y), (_, next_y) in pairwise(way))


BLOCKS = {
    "a door": [SHORTER],
    "a crate": polyline((1.35, -3.5), (1.65, -3.5), (1.65, -3.8), (1.35, -3.8), (1.35, -3.5)),
}


@pytest.mark.parametrize("new", BLOCKS.values(), ids=BLOCKS)
@pytest.mark.parametrize("near", [1.0, 1.42, 1.45, 1.5, 1.55])
def test_what_blocks_the_way_is_driven_round_within_a_second(toured, new, near):
    ways = ways_after(toured, new, near, seed=round(100 * near))
    assert passes(ways[0])
    blocked_for = [passes(way) for way in ways].index(False)
    assert blocked_for < SECOND
    assert not any(map(passes, ways[blocked_for:]))
    assert all(ways[blocked_for:]), "there is another way"


def test_what_leaves_room_is_passed(toured):
    crate = [(1.8, -3.5, 2.0, -3.5), *polyline((1.8, -3.5), (1.8, -3.9), (2.0, -3.9))]
    ways = ways_after(toured, crate, 1.4, seed=1)
    beside = [[x for x, y in way if x < 2.0 and -3.9 < y < -3.5] for way in (ways[0], ways[SECOND])]
    assert all(beside)
    assert max(beside[0]) > 1.5
    assert max(beside[1]) < 1.5
