"""Nodes: ends by jump, corners by the right-angle test, their connections."""

from __future__ import annotations

import math

import numpy as np
import pytest

from perception.facts import Perception
from perception.nodes import NodeKind, wall_segments
from tests.perception.scenes import PICO, observation_of, observe
from transport.messages import Pose, Scan


def nodes_at(walls, pose=None, seed=1):
    return Perception(PICO).facts(observe(walls, pose or Pose(), rng=np.random.default_rng(seed))).nodes


def nearest(nodes, x, y):
    return min(nodes, key=lambda node: math.dist(node.point, (x, y)))


ALCOVE = [(-2, -0.5, 1, -0.5), (1, -0.5, 1, 0.5), (1, 0.5, -2, 0.5)]


@pytest.mark.parametrize("seed", range(8))
def test_the_corners_of_a_dead_end(seed):
    nodes = nodes_at(ALCOVE, Pose(0, 0, 0.1), seed)
    corners = [node for node in nodes if node.kind is NodeKind.CORNER]
    assert len(corners) == 2
    for corner, y in zip(corners, (-0.5, 0.5), strict=True):
        cosine, sine = math.cos(0.1), math.sin(0.1)
        assert corner.point == pytest.approx((cosine + y * sine, y * cosine - sine), abs=0.06)


def test_ids_and_beams_run_from_right_to_left():
    nodes = nodes_at(ALCOVE)
    assert [node.id for node in nodes] == list(range(len(nodes)))
    assert [node.beam for node in nodes] == sorted(node.beam for node in nodes)
    assert nodes[0].beam == 0
    assert nodes[-1].beam == 999


def test_positions_in_both_coordinates_agree():
    for node in nodes_at(ALCOVE):
        assert node.x == pytest.approx(node.distance * math.cos(node.bearing))
        assert node.y == pytest.approx(node.distance * math.sin(node.bearing))


def test_walls_connect_their_nodes_and_nothing_else():
    walls = [(1, -2, 1, -0.4), (2, -2, 2, 2), (1, 0.4, 1, 2)]
    nodes = nodes_at(walls)
    right, left = nearest(nodes, 1, -0.4), nearest(nodes, 1, 0.4)
    assert right.kind is NodeKind.END
    assert left.kind is NodeKind.END
    assert left.id not in right.connections
    for segment in wall_segments(nodes):
        first, second = nodes[segment.first], nodes[segment.second]
        assert abs(first.x - second.x) < 0.1


def test_an_obtuse_bend_is_no_corner():
    walls = [(-2, 1, 1, 1), (1, 1, 3, 0.0)]
    assert not any(node.kind is NodeKind.CORNER for node in nodes_at(walls))


def test_readings_near_zero_set_no_node_on_the_robot_itself():
    """In 2017 such a node hid the corner beside the robot."""
    observation = observe(ALCOVE, Pose(), rng=np.random.default_rng(1))
    ranges = observation.scan.ranges.copy()
    ranges[400:420] = 0.005
    ranges[600] = 0.0
    scan = Scan(0, observation.scan.geometry, ranges)
    assert all(node.distance > 0.2 for node in Perception(PICO).facts(observation_of(scan)).nodes)


def test_nothing_seen_no_nodes():
    assert nodes_at([]) == ()
