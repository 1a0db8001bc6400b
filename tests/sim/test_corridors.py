"""Corridor challenges by seed: as they were asked for, and passable."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim.corridors import START, WIDTHS, Corridor, corridor, random_corridor
from sim.formats import read_maze, write_maze
from sim.solvability import UnsolvableError, shortest_way
from transport.description import RobotDescription


@given(seed=st.integers(0, 2**32))
def test_every_seed_gives_a_corridor_that_can_be_passed_and_always_the_same(seed):
    wanted = random_corridor(seed)
    assert wanted == random_corridor(seed)
    assert WIDTHS[0] <= min(wanted.width, wanted.opening) <= max(wanted.width, wanted.opening) <= WIDTHS[1]
    maze = corridor(wanted)
    along = wanted.length + wanted.opening / 2 - START
    across = wanted.width / 2 + wanted.depth
    way = shortest_way(maze, radius=RobotDescription().radius)
    assert abs(way - along - across) < wanted.opening / 2 + abs(wanted.misplaced) + 0.6


def test_exits_are_at_either_side():
    sides = [random_corridor(seed).side for seed in range(50)]
    assert 10 < sides.count("left") < 40


@pytest.mark.parametrize(("side", "sign"), [("left", 1), ("right", -1)])
def test_the_exit_is_where_it_should_be(side, sign):
    maze = corridor(Corridor(width=0.8, opening=1.2, side=side, length=2.0, depth=0.5, misaligned=-4))
    (exit_,) = maze.exits
    assert np.allclose(exit_[[0, 2]], sign * 0.9)
    assert sorted(exit_[[1, 3]]) == pytest.approx([2.0, 3.2])
    assert maze.start.pose.heading == pytest.approx(math.radians(86))


def test_a_corridor_survives_being_written(tmp_path):
    maze = corridor(random_corridor(4))
    write_maze(maze, tmp_path / "corridor.maze")
    again = read_maze(tmp_path / "corridor.maze", radius=RobotDescription().radius)
    assert np.allclose(again.walls, maze.walls, atol=1e-3)
    assert again.time_limit == maze.time_limit


def test_a_start_inside_a_wall_is_refused():
    with pytest.raises(UnsolvableError, match="start"):
        corridor(Corridor(width=0.6, misplaced=0.2))
