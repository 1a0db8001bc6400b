"""Right hand with loop detection: it gets away from islands about which the right hand alone circles for ever."""

import math
from itertools import pairwise

import pytest

SEEDS = (0, 1)
RING = """
##########
##.......#
##.#####.#
#s.#####.E
##.#####.#
##.......#
##########
"""
"""A block in a loop of corridors; the robot comes upon the block first."""
ISLAND = """
##########
#........#
#........#
#...##...#
#.s.##...E
#........#
##########
"""
"""A block in an open space."""


def rounds(path, x, y):
    """How often a path goes up through the row above ``y``, left of ``x``."""
    return sum(before.y < y <= after.y and after.x < x for before, after in pairwise(path))


@pytest.mark.parametrize("drawn", [RING, ISLAND], ids=["ring", "island"])
def test_the_right_hand_alone_circles_for_ever(solve, maze, drawn):
    run = solve("right_hand", maze(drawn, heading=0.0), limit=200)
    assert not run.verdict.escaped
    assert run.verdict.contacts == ()
    assert rounds(run.path, 4.0, 4.0) >= 3


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("drawn", [RING, ISLAND], ids=["ring", "island"])
def test_a_loop_is_noticed_and_another_branch_taken(solve, maze, drawn, seed):
    run = solve("right_hand_loop", maze(drawn, heading=0.0), seed, limit=240)
    assert run.verdict.escaped, run.verdict
    assert run.verdict.contacts == ()
    assert rounds(run.path, 4.0, 4.0) <= 2


def test_in_open_space_it_follows_the_wall_at_its_distance(solve, maze):
    run = solve("right_hand_loop", maze(ISLAND, heading=0.0), limit=60)
    above = [pose for pose in run.path if 4.3 < pose.x < 5.7 and 4.0 < pose.y < 5.0 and abs(pose.heading) < 0.1]
    assert len(above) > 10
    assert all(math.isclose(pose.y, 4.5, abs_tol=0.08) for pose in above)
