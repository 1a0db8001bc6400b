"""Each shipped machine in mazes: what it can solve it solves and touches nothing, what it cannot it does not."""

import math
from dataclasses import replace

import numpy as np
import pytest

from sim.corridors import Corridor, corridor
from sim.formats import read_maze
from sim.generate import Recipe, generate
from sim.shipped import shipped_mazes
from transport.description import RobotDescription

SIMPLE = """
###########
#...#.....E
#.#.#.###.#
#.#.#.#...#
#s#...#.#.#
###########
"""
TWO_WAYS = """
#########
#.......#
#.#####.#
#.......#
#s#####.#
#######E#
"""
ISLAND = """
#########
#.......#
#.##.##.#
#.##.##.E
#.......#
#s####..#
#########
"""
SOLVERS = ("pledge", "pledge_smooth", "right_hand_loop", "tremaux", "random_mouse")


@pytest.mark.parametrize("machine", [*SOLVERS, "explorer", "right_hand"])
def test_every_solver_leaves_a_maze_without_islands(solve, maze, machine):
    run = solve(machine, maze(SIMPLE), limit=1500)
    assert run.verdict.escaped, run.verdict
    assert run.verdict.contacts == ()
    assert run.verdict.clearance >= 0.1


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("machine", ["pledge", "pledge_smooth", "tremaux"])
def test_islands_do_not_hold_who_knows_of_them(solve, maze, machine, seed):
    run = solve(machine, maze(ISLAND), seed, limit=600)
    assert run.verdict.escaped, run.verdict
    assert run.verdict.contacts == ()


@pytest.mark.parametrize("text", [SIMPLE, ISLAND])
def test_the_map_leads_out_without_pledge(solve, maze, text):
    run = solve("explorer", maze(text), limit=150)
    assert run.verdict.escaped, run.verdict
    assert run.verdict.contacts == ()
    assert "by_pledge" not in run.states


def test_what_is_new_in_the_second_attempt_is_driven_round_without_a_stop(solve, maze):
    free = maze(TWO_WAYS)
    shut = replace(free, walls=np.vstack([free.walls, [(5.0, 2.0, 5.0, 3.0)]]))
    first = solve("explorer", free, limit=60)
    again, round_it = (solve("explorer", walls, limit=60, known=first) for walls in (free, shut))
    for run in (first, again, round_it):
        assert run.verdict.escaped, run.verdict
        assert run.verdict.contacts == ()
        assert "by_pledge" not in run.states
    assert again.verdict.path_length < 9.5
    # The wall comes in sight where the robot would turn right to it, 3 m away.
    assert max(pose.x for pose in round_it.path if 2 < pose.y < 3 and pose.x < 5) < 2.0
    assert round_it.verdict.path_length < 13.5
    assert round_it.verdict.time < 13.5 / 0.45


@pytest.mark.parametrize("text", [SIMPLE, ISLAND])
def test_marks_lead_out_where_all_ways_are_seen(solve, maze, text):
    run = solve("tremaux", maze(text), limit=600)
    assert run.verdict.escaped, run.verdict
    assert "by_pledge" not in run.states


@pytest.mark.parametrize("text", ["#######\n#..s..#\n#######", "#####\n#...#\n#.#.#\n#s..#\n#####"])
def test_marks_are_given_up_where_all_ways_are_used_up(solve, maze, text):
    run = solve("tremaux", maze(text), limit=150)
    assert "by_pledge" in run.states
    assert run.verdict.contacts == ()


def test_a_maze_is_left_although_a_way_in_it_is_passed_over(solve):
    # Two openings of one corridor: that on the left begins just beyond the one on the right.
    recipe = Recipe(columns=4, rows=4, corridor=0.78, loops=3, dead_ends=0.94, doors=1, offset=0.113)
    run = solve("tremaux", replace(generate(recipe, 51), time_limit=math.inf), limit=300)
    assert "by_pledge" in run.states
    assert run.verdict.escaped, run.verdict
    assert run.verdict.clearance >= 0.1


def test_the_right_hand_circles_about_an_island_for_ever(solve):
    # The first wall that it meets is the block in the loop of the final.
    run = solve("right_hand", read_maze(shipped_mazes()["final_2015"], radius=RobotDescription().radius), limit=200)
    assert not run.verdict.escaped
    assert run.verdict.contacts == ()


@pytest.mark.parametrize("machine", ["explorer", "pledge", "pledge_smooth", "right_hand_loop", "tremaux"])
def test_the_final_with_its_door_is_won(solve, machine):
    run = solve(machine, read_maze(shipped_mazes()["final_2015"], radius=RobotDescription().radius), seed=3, limit=420)
    assert run.verdict.escaped, run.verdict
    assert run.verdict.doors_opened == ("front",)
    assert run.verdict.clearance >= 0.1
    assert {"open_door.facing", "open_door.ringing", "open_door.waiting"} <= set(run.states)


def test_turning_while_driving_is_faster(solve):
    final = read_maze(shipped_mazes()["final_2015"], radius=RobotDescription().radius)
    on_the_spot = solve("pledge", final).verdict.time
    assert solve("pledge_smooth", final).verdict.time < 0.8 * on_the_spot


def test_a_seed_chooses_the_mouse_s_way_and_the_same_seed_the_same(solve, maze):
    drawn = maze(ISLAND)
    first, again, other = (solve("random_mouse", drawn, limit=60, seed=seed).path for seed in (0, 0, 1))
    assert first == again
    assert first != other


@pytest.mark.parametrize("machine", ["corridor_2015", "corridor_2017"])
@pytest.mark.parametrize(("width", "opening"), [(0.6, 0.6), (0.8, 1.2), (1.0, 1.0), (1.5, 0.8), (1.5, 1.5)])
@pytest.mark.parametrize("side", ["left", "right"])
def test_the_corridor_challenge_is_passed(solve, machine, width, opening, side):
    run = solve(machine, corridor(Corridor(width=width, opening=opening, side=side)), limit=60)
    assert run.verdict.escaped, run.verdict
    assert run.verdict.contacts == ()


def test_a_corridor_without_an_exit_is_told(solve, maze):
    run = solve("corridor_2017", maze("#####\n#s..#\n#####", heading=0.0), limit=60)
    assert run.outcome == "dead_end"
