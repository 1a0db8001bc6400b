"""Machines among things that move: they give way, wait for a way that comes free, find a wall again, and get out."""

import math
from dataclasses import replace
from itertools import pairwise

import pytest

from sim.maze import MovingObject

LONGEST_REST = 15.0
"""By the rules an attempt is over after 30 s, s."""
NICHE = """
############
#####.######
#s.........E
############
"""
LANE = """
############
#s.........E
############
"""
WIDE_LANE = """
############
#..........#
#s.........E
############
"""
LOOP = """
########
#s.....#
#.####.#
#.####.E
#......#
########
"""
HALL = """
##########
#........#
#........#
#s.......#
#........#
#........#
#........E
##########
"""


def box(length, width):
    x, y = length / 2, width / 2
    return ((-x, -y), (x, -y), (x, y), (-x, y))


SCENES = {
    "a cart comes on": (WIDE_LANE, [MovingObject("cart", box(0.4, 0.4), ((9, 1.5), (2, 1.5)), 0.2, returns=True)]),
    "a cart goes by": (LANE, [MovingObject("cart", box(0.4, 0.3), ((9, 1.25), (2, 1.25)), 0.1, returns=True)]),
    "a cart crosses": (NICHE, [MovingObject("cart", box(0.5, 0.5), ((5.5, 1.5), (5.5, 2.5)), 0.15, returns=True)]),
    "a cart goes ahead": (LANE, [MovingObject("cart", box(0.5, 0.7), ((4, 1.5), (13, 1.5)), 0.25)]),
    "a crate leaves the way": (NICHE, [MovingObject("crate", box(0.8, 0.7), ((5.5, 1.5), (5.5, 2.55)), near=1.4)]),
    "a crate stays in the way": (LOOP, [MovingObject("crate", box(0.7, 0.8), ((3.5, 4.5),))]),
}


def longest_rest(path, period=0.1):
    """The longest time for which the robot neither moved nor turned, s."""
    longest = rest = 0
    for before, after in pairwise(path):
        moved = math.dist((before.x, before.y), (after.x, after.y)) > 0.002
        rest = 0 if moved or abs(math.remainder(after.heading - before.heading, math.tau)) > 0.003 else rest + 1
        longest = max(longest, rest)
    return longest * period


@pytest.mark.parametrize(
    ("machine", "seed"), [("pledge", 0), ("pledge", 1), ("pledge_smooth", 2), ("right_hand_loop", 3)]
)
@pytest.mark.parametrize("scene", SCENES)
def test_what_moves_does_not_hold_a_machine(solve, maze, scene, machine, seed):
    drawn, objects = SCENES[scene]
    run = solve(machine, replace(maze(drawn, heading=0.0), objects=tuple(objects)), seed, limit=240)
    assert run.verdict.escaped, run.verdict
    assert run.verdict.contacts == ()
    assert run.verdict.clearance > 0.05
    assert longest_rest(run.path) < LONGEST_REST


def test_a_robot_whose_way_stays_shut_for_good_does_not_stand_still(solve, maze):
    shut = replace(maze(LANE, heading=0.0), objects=(MovingObject("crate", box(0.7, 0.8), ((5.5, 1.5),)),))
    run = solve("pledge", shut, limit=120)
    assert not run.verdict.escaped
    assert run.verdict.contacts == ()
    assert longest_rest(run.path) < LONGEST_REST


@pytest.mark.parametrize("machine", ["pledge", "pledge_smooth", "right_hand", "right_hand_loop", "tremaux"])
def test_a_wall_that_goes_away_is_lost_and_another_one_found(solve, maze, machine):
    # The first wall that the robot meets is a crate, which goes off when the robot has come to it.
    crate = MovingObject("crate", box(0.8, 1.6), ((4.5, 3.5), (4.5, 1.9)), speed=0.2, near=1.0)
    run = solve(machine, replace(maze(HALL, heading=0.0), objects=(crate,)), limit=240)
    assert run.verdict.escaped, run.verdict
    assert run.verdict.contacts == ()
    assert longest_rest(run.path) < LONGEST_REST
