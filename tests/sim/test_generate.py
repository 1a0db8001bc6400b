"""Generated mazes: solvable, repeatable, and like their recipe."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim.formats import read_maze, write_maze
from sim.free_space import DistanceGrid, flood
from sim.generate import DOOR_AREA, Recipe, generate
from sim.geometry import distances
from sim.maze import MazeError
from sim.picture import save_picture
from sim.shipped import shipped_mazes
from sim.solvability import shortest_way
from transport.description import RobotDescription

RECIPES = [
    Recipe(),
    Recipe(columns=8, rows=7, islands=1, open_spaces=1, doors=1, loops=2, skew=2, offset=0.1),
    Recipe(columns=5, rows=9, corridor=0.8, loops=0, dead_ends=0.2),
    Recipe(columns=10, rows=10, doors=2, loops=3),
    Recipe(columns=5, rows=5, corridor=1.4, doors=1, skew=4, offset=0.2),
]


def blocks(maze, step=0.05):
    """Closed areas within the bounds that cannot be reached from the start or the outside."""
    space = DistanceGrid.around(np.concatenate([maze.walls, maze.exits]), maze.bounds, limit=0.1, step=step, margin=0.3)
    remaining = space.clearance > 0.6 * step
    count = -2  # the inside and the outside
    while remaining.any():
        seed = np.zeros_like(remaining)
        seed.flat[int(np.argmax(remaining))] = True
        piece = flood(remaining, seed) >= 0
        remaining &= ~piece
        count += int(piece.sum() > 20)
    return count


@pytest.mark.parametrize("recipe", RECIPES, ids=range(len(RECIPES)))
@given(seed=st.integers(0, 2**32))
@settings(max_examples=12)
def test_every_seed_gives_a_solvable_maze_and_always_the_same(recipe, seed):
    maze = generate(recipe, seed)
    again = generate(recipe, seed)
    assert np.array_equal(maze.walls, again.walls)
    assert (maze.doors, maze.start, maze.exits.tolist()) == (again.doors, again.start, again.exits.tolist())
    assert shortest_way(maze, radius=RobotDescription().radius) is not None
    assert len(maze.doors) == recipe.doors
    for door in maze.doors:
        assert 0.5 <= door.length <= 1.5
        middle = np.mean(door.leaf, axis=0)
        assert math.dist(middle, maze.start_point) > DOOR_AREA - 2 * recipe.offset - 0.2 * recipe.corridor


def test_other_seeds_give_other_mazes():
    drawn = {generate(Recipe(), seed).walls.tobytes() for seed in range(20)}
    assert len(drawn) == 20


@given(seed=st.integers(0, 2**32))
def test_doors_must_be_passed(seed):
    recipe = RECIPES[1]
    maze = generate(recipe, seed)
    shut = np.concatenate([maze.walls, [[*door.leaf[0], *door.leaf[1]] for door in maze.doors]])
    assert shortest_way(replace(maze, walls=shut), radius=0.1) is None


@given(seed=st.integers(0, 2**32))
def test_a_door_ends_a_way_between_two_walls(seed):
    recipe = RECIPES[3]
    maze = generate(recipe, seed)
    for door in maze.doors:
        (ax, ay), (bx, by) = door.leaf
        across = np.array([ay - by, bx - ax]) / door.length
        sides = np.array([[*door.leaf[0]], [*door.leaf[1]]])
        beside = [distances(sides + depth * across, maze.walls).min(axis=1).max() for depth in (-0.4, 0.4)]
        assert min(beside) < 1e-6


@pytest.mark.parametrize("seed", range(120))
def test_an_open_door_shuts_no_other_way(seed):
    maze = generate(Recipe(columns=6, rows=3, doors=2), seed)
    slid = [[*second, *(2 * np.array(second) - first)] for first, second in (door.leaf for door in maze.doors)]
    assert (
        shortest_way(replace(maze, walls=np.concatenate([maze.walls, slid])), radius=RobotDescription().radius)
        is not None
    )


def test_islands_are_blocks_with_a_way_around():
    for seed in range(10):
        assert blocks(generate(Recipe(columns=9, rows=8, islands=2), seed)) == 2
        assert blocks(generate(Recipe(columns=9, rows=8, islands=0), seed)) == 0


def test_walls_are_skewed_and_offset_only_when_asked_for():
    straight = generate(Recipe(), 3).walls
    assert ((straight[:, 0] == straight[:, 2]) | (straight[:, 1] == straight[:, 3])).all()
    assert np.allclose(straight, np.round(straight))
    skewed = generate(Recipe(skew=3), 3).walls
    angles = np.degrees(np.arctan2(skewed[:, 3] - skewed[:, 1], skewed[:, 2] - skewed[:, 0])) % 90
    off = np.minimum(angles, 90 - angles)
    assert 0.3 < off.max() <= 3.5
    offset = generate(Recipe(offset=0.2), 3).walls
    assert ((offset[:, 0] == offset[:, 2]) | (offset[:, 1] == offset[:, 3])).all()
    assert 0.05 < np.abs(offset - np.round(offset)).max() <= 0.2 + 1e-9


def test_fewer_dead_ends_make_more_ways():
    many = sum(len(generate(Recipe(columns=8, rows=8, loops=0), seed).walls) for seed in range(5))
    few = sum(len(generate(Recipe(columns=8, rows=8, loops=0, dead_ends=0.0), seed).walls) for seed in range(5))
    assert few != many


def test_the_corridors_have_their_width():
    maze = generate(Recipe(corridor=0.75), 1)
    assert np.allclose(maze.walls / 0.75, np.round(maze.walls / 0.75), atol=2e-3)


@pytest.mark.parametrize("recipe", RECIPES, ids=range(len(RECIPES)))
def test_a_generated_maze_survives_being_written(recipe, tmp_path):
    maze = generate(recipe, 5)
    write_maze(maze, tmp_path / "maze.maze")
    again = read_maze(tmp_path / "maze.maze", radius=RobotDescription().radius)
    assert np.array_equal(again.walls, maze.walls)
    assert again.doors == maze.doors
    write_maze(maze, tmp_path / "maze.png")
    assert len(read_maze(tmp_path / "maze.png", radius=RobotDescription().radius).doors) == recipe.doors


def test_plain_mazes_can_be_written_as_cells(tmp_path):
    for seed in range(10):
        maze = generate(Recipe(), seed)
        write_maze(maze, tmp_path / "maze.txt")
        again = read_maze(tmp_path / "maze.txt", radius=RobotDescription().radius)
        assert shortest_way(again, radius=RobotDescription().radius) == pytest.approx(
            shortest_way(maze, radius=RobotDescription().radius)
        )


def test_a_recipe_that_cannot_be_cooked_is_refused_with_a_reason():
    with pytest.raises(MazeError, match="room for an island"):
        generate(Recipe(columns=4, rows=4, islands=5), 1)
    with pytest.raises(ValueError, match=r"1\.5 m wide"):
        Recipe(corridor=2.0, doors=1)
    with pytest.raises(ValueError, match="offset"):
        Recipe(offset=0.5)


@pytest.mark.parametrize("suffix", [".png", ".svg"])
def test_a_picture_is_drawn(suffix, tmp_path):
    path = tmp_path / f"maze{suffix}"
    for maze in (generate(RECIPES[1], 2), read_maze(shipped_mazes()["dynamic"], radius=RobotDescription().radius)):
        save_picture(maze, path)
        assert path.read_bytes().startswith((b"\x89PNG", b"<?xml"))


def test_a_picture_of_another_kind_is_refused(tmp_path):
    with pytest.raises(MazeError, match="picture is"):
        save_picture(generate(Recipe(), 2), tmp_path / "maze.bmp")
