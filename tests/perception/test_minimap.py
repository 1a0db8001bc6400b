"""The minimap: free, occupied and unknown cells, turned along the walls."""

from __future__ import annotations

import math

import numpy as np
import pytest

from perception.facts import Perception
from perception.minimap import Cell
from perception.settings import MinimapSettings, PerceptionSettings
from tests.perception.scenes import PICO, corridor, observation_of, observe
from transport.messages import Pose, Scan


def minimap_at(walls, pose, rng=None, settings=None):
    return Perception(PICO, settings).facts(observe(walls, pose, rng=rng)).minimap


DEAD_END = [(-3, 0.5, 1, 0.5), (-3, -0.5, 1, -0.5), (1, -0.5, 1, 0.5)]


@pytest.mark.parametrize("angle", [-0.17, 0.0, 0.1])
def test_a_dead_end(angle):
    minimap = minimap_at(DEAD_END, Pose(0, 0.1, angle), np.random.default_rng(1))
    assert minimap.at(1.0, 0.0) is Cell.OCCUPIED
    assert minimap.at(0.5, -0.6) is Cell.OCCUPIED
    assert minimap.at(0.5, 0.4) is Cell.OCCUPIED
    for x in np.arange(0.05, 0.9, 0.05):
        for y in np.arange(-0.5, 0.35, 0.05):
            assert minimap.at(x, y) is Cell.FREE
    assert minimap.at(1.2, 0.0) is Cell.UNKNOWN
    assert minimap.at(0.0, 0.8) is Cell.UNKNOWN
    assert minimap.at(-0.5, 0.0) is Cell.UNKNOWN
    assert minimap.at(50.0, 0.0) is Cell.UNKNOWN


def test_it_is_turned_along_the_walls():
    straight = minimap_at(DEAD_END, Pose(0, 0.1, 0.0))
    turned = minimap_at(DEAD_END, Pose(0, 0.1, 0.12))
    ahead = slice(straight.centre, None)
    assert np.mean(straight.cells[ahead] != turned.cells[ahead]) < 0.03


def test_no_cell_beyond_a_wall_is_free():
    rng = np.random.default_rng(2)
    for _ in range(20):
        pose = Pose(rng.uniform(-0.5, 0.3), rng.uniform(-0.2, 0.2), rng.uniform(-0.2, 0.2))
        minimap = minimap_at(DEAD_END, pose, rng)
        cells = (np.arange(len(minimap.cells)) - minimap.centre) * minimap.cell
        x, y = np.meshgrid(cells + pose.x, cells + pose.y, indexing="ij")
        beyond = (x > 1.03) | (np.abs(y) > 0.53)
        assert not minimap.free[beyond].any()


def test_size_and_cell_come_from_the_profile():
    settings = PerceptionSettings(minimap=MinimapSettings(half_size=1.0, cell=0.1))
    minimap = minimap_at(DEAD_END, Pose(), settings=settings)
    assert minimap.cells.shape == (21, 21)
    assert minimap.cell == 0.1


def test_depth_of_a_lane():
    minimap = minimap_at(DEAD_END, Pose(0, 0.1, 0.1), np.random.default_rng(3))
    assert minimap.depth(0.0, 0.1) == pytest.approx(1.0, abs=0.06)
    assert minimap.depth(math.pi / 2, 0.0) == pytest.approx(0.4, abs=0.06)


def test_binary_is_what_stands_there():
    minimap = minimap_at(corridor(1.0), Pose(), np.random.default_rng(3))
    assert (minimap.binary == (minimap.cells == Cell.OCCUPIED)).all()
    assert minimap.binary.sum() > 50
    assert 0.15 < minimap.known_share < 0.5


@pytest.mark.parametrize("reading", [math.nan, -math.inf])
def test_what_was_not_measured_is_unknown(reading):
    scan = Scan(0, PICO.laser.geometry(), np.full(1000, reading, np.float32))
    assert not Perception(PICO).facts(observation_of(scan)).minimap.cells.any()


def test_where_nothing_is_hit_it_is_free():
    scan = Scan(0, PICO.laser.geometry(), np.full(1000, math.inf, np.float32))
    minimap = Perception(PICO).facts(observation_of(scan)).minimap
    assert minimap.at(1.0, 0.0) is Cell.FREE
    assert minimap.at(-1.0, 0.0) is Cell.UNKNOWN
    assert not minimap.binary.any()
