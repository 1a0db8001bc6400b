"""A maze as a grid of cells says the same as the maze."""

import math

import numpy as np
import pytest

from sim.formats import read_maze
from sim.geometry import distances
from sim.maze import Maze, Start
from sim.occupancy import FREE, OCCUPIED, UNKNOWN, occupancy
from sim.shipped import shipped_mazes
from transport.description import RobotDescription
from transport.messages import Pose


@pytest.mark.parametrize("name", ["final_2015", "corridor"])
def test_each_cell_is_what_is_there(name):
    maze = read_maze(shipped_mazes()[name], radius=RobotDescription().radius)
    cells, edge, (left, bottom) = occupancy(maze)
    rows, columns = cells.shape
    x, y = np.meshgrid(left + edge * (np.arange(columns) + 0.5), bottom + edge * (np.arange(rows) + 0.5))
    solid = np.concatenate([maze.walls, *[np.array([[*door.leaf[0], *door.leaf[1]]]) for door in maze.doors]])
    away = distances(np.stack([x.ravel(), y.ravel()], axis=1), solid).min(axis=1).reshape(cells.shape)
    assert (cells[away <= edge / 2] == OCCUPIED).all()
    assert (cells[away > edge / math.sqrt(2)] != OCCUPIED).all()
    start = maze.start.pose
    assert cells[int((start.y - bottom) / edge), int((start.x - left) / edge)] == FREE


def test_behind_a_door_nothing_is_known():
    walls = np.array([[0, 0, 4, 0], [4, 0, 4, 1], [4, 1, 0, 1], [0, 1, 0, 0], [2, 0, 2, 1]], dtype=float)
    cells, edge, (left, bottom) = occupancy(Maze("two", walls, Start(Pose(1.0, 0.5, 0.0))))
    row = int((0.5 - bottom) / edge)
    assert cells[row, int((1.0 - left) / edge)] == FREE
    assert cells[row, int((3.0 - left) / edge)] == UNKNOWN


def test_a_large_maze_has_larger_cells():
    walls = np.array([[0, 0, 140, 0], [140, 0, 140, 140], [140, 140, 0, 140], [0, 140, 0, 0]], dtype=float)
    cells, edge, _ = occupancy(Maze("hall", walls, Start(Pose(1.0, 1.0, 0.0))))
    assert cells.size < 4.1e6
    assert edge > 0.05
