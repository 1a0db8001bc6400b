"""Junctions: every kind, and what must never be taken for one."""

from __future__ import annotations

import math

import numpy as np
import pytest

from perception.facts import Perception
from perception.junction import JunctionKind
from tests.perception.junctions import KINDS, scenes
from tests.perception.scenes import PICO, corridor, observe
from transport.description import RobotDescription
from transport.messages import Pose


def junction_at(walls, pose, seed=1):
    return Perception(PICO).facts(observe(walls, pose, rng=np.random.default_rng(seed))).junction


@pytest.mark.parametrize("seed", [11, 12, 13])
def test_every_kind_is_recognised(seed):
    rng = np.random.default_rng(seed)
    wrong = []
    for scene in scenes(np.random.default_rng([seed, 1]), 189):
        kind = Perception(PICO).facts(observe(scene.walls, scene.pose, rng=rng)).junction.kind
        if kind != scene.kind:
            wrong.append((scene.kind, scene.group, str(kind)))
    assert len(wrong) <= 1, wrong


def test_all_kinds_but_unknown_are_generated():
    assert {JunctionKind(kind) for kind in KINDS} == set(JunctionKind) - {JunctionKind.UNKNOWN}


@pytest.mark.parametrize("angle", [-0.15, 0.0, 0.1])
def test_distances_of_a_crossing(angle):
    walls = [
        (-5, 0.5, 0.1, 0.5), (0.1, 0.5, 0.1, 4), (1.2, 4, 1.2, 0.6), (1.2, 0.6, 6, 0.6),
        (-5, -0.4, 0.1, -0.4), (0.1, -0.4, 0.1, -4), (1.2, -4, 1.2, -0.4), (1.2, -0.4, 6, -0.4),
    ]  # fmt: skip
    junction = junction_at(walls, Pose(0, 0, angle))
    assert junction.kind is JunctionKind.CROSSING
    assert junction.left_wall == pytest.approx(0.5, abs=0.01)
    assert junction.right_wall == pytest.approx(0.4, abs=0.01)
    assert junction.d2 == pytest.approx(0.1, abs=0.03)
    assert junction.d3 == pytest.approx(1.1, abs=0.04)
    assert junction.dx == pytest.approx(0.65, abs=0.03)
    assert junction.dy == pytest.approx(0.05, abs=0.01)
    assert junction.end == math.inf


def gap_in_the_left_wall(width, near, half, *, thick):
    far = near + width
    walls = [(-5, half, near, half), (far, half, 5, half), (-5, -half, 5, -half)]
    return walls + [(near, half, near, 3), (far, half, far, 3)] * thick


@pytest.mark.parametrize("thick", [True, False])
@pytest.mark.parametrize("width", [0.05, 0.2, 0.3, 0.38, 0.4])
def test_a_gap_narrower_than_the_robot_is_never_an_opening(width, thick):
    rng = np.random.default_rng(5)
    for near in np.arange(-0.6, 1.2, 0.05):
        half = rng.uniform(0.3, 0.75)
        walls = gap_in_the_left_wall(width, near, half, thick=thick)
        pose = Pose(0, rng.uniform(-1, 1) * (half - 0.3), rng.uniform(-0.17, 0.17))
        junction = junction_at(walls, pose, seed=6)
        assert not junction.left.open
        assert not junction.right.open


@pytest.mark.parametrize("width", [0.1, 0.3, 0.4])
def test_a_gap_ahead_narrower_than_the_robot_is_a_dead_end(width):
    rng = np.random.default_rng(8)
    for distance in np.arange(0.3, 1.0, 0.05):
        y = rng.uniform(-0.3, 0.3)
        walls = [(-5, 0.6, 5, 0.6), (-5, -0.6, 5, -0.6), (distance, -0.6, distance, y - width / 2)]
        walls.append((distance, y + width / 2, distance, 0.6))
        junction = junction_at(walls, Pose(0, rng.uniform(-0.2, 0.2), rng.uniform(-0.17, 0.17)), seed=3)
        assert junction.kind is JunctionKind.DEAD_END


def test_a_side_path_seen_from_afar_is_unknown_then_open():
    walls = [(-5, 0.5, 1, 0.5), (1, 0.5, 1, 4), (2, 4, 2, 0.5), (2, 0.5, 6, 0.5), (-5, -0.5, 6, -0.5)]
    seen = [junction_at(walls, Pose(x, 0, 0.03)).kind for x in np.arange(-1.0, 1.3, 0.1)]
    assert seen[0] is JunctionKind.CORRIDOR
    assert seen[-1] is JunctionKind.T_LEFT
    order = [kind for index, kind in enumerate(seen) if index == 0 or kind is not seen[index - 1]]
    assert order in (
        [JunctionKind.CORRIDOR, JunctionKind.T_LEFT],
        [JunctionKind.CORRIDOR, JunctionKind.UNKNOWN, JunctionKind.T_LEFT],
    )


def test_the_junction_of_the_2015_challenge_with_its_parallel_wall_offset_has_no_way_to_the_right():
    """A way to the left; the right wall steps back by 15 cm in the middle of it, which is not a way."""
    walls = [
        (-4, 0.5, 0.1, 0.5), (0.1, 0.5, 0.1, 4), (1.1, 4, 1.1, 0.5), (1.1, 0.5, 5, 0.5),
        (-4, -0.5, 0.6, -0.5), (0.6, -0.5, 0.6, -0.65), (0.6, -0.65, 5, -0.65),
    ]  # fmt: skip
    for x in np.arange(-0.2, 0.8, 0.1):
        for angle in (-0.17, 0.0, 0.17):
            junction = junction_at(walls, Pose(x, 0.02, angle))
            assert not junction.right.open
            if junction.kind is not JunctionKind.UNKNOWN:
                assert junction.kind in (JunctionKind.T_LEFT, JunctionKind.CORRIDOR)


def test_a_niche_may_be_a_door():
    walls = [(-4, 0.5, 0.1, 0.5), (0.1, 0.5, 0.1, 1), (0.1, 1, 1.1, 1), (1.1, 1, 1.1, 0.5), (1.1, 0.5, 5, 0.5)]
    junction = junction_at([*walls, (-4, -0.5, 5, -0.5)], Pose(0, 0, 0.05))
    assert junction.kind is JunctionKind.T_LEFT
    assert junction.door_left
    assert junction.left.depth == pytest.approx(0.5, abs=0.03)
    assert not junction.door_right


def test_a_single_bad_beam_changes_nothing():
    rng = np.random.default_rng(4)
    for scene in scenes(np.random.default_rng(21), 63):
        observation = observe(scene.walls, scene.pose, rng=rng)
        clean = Perception(PICO).facts(observation).junction.kind
        bad = rng.integers(0, 1000, 3)
        observation.scan.ranges[bad] = rng.choice([0.05, np.nan, np.inf, 0.3], 3).astype(np.float32)
        assert Perception(PICO).facts(observation).junction.kind is clean


def test_a_corridor_that_narrows_or_widens_is_a_corridor():
    assert junction_at(corridor(1.0), Pose(0, 0, 0.1)).kind is JunctionKind.CORRIDOR
    for step in (-0.2, -0.1, 0.1, 0.2):
        for x in (-0.5, 0.0, 0.3, 0.6):
            walls = [(-5, 0.5, x, 0.5), (x, 0.5, x, 0.5 + step), (x, 0.5 + step, 5, 0.5 + step), (-5, -0.5, 5, -0.5)]
            assert junction_at(walls, Pose(0, 0, 0.05)).kind is JunctionKind.CORRIDOR


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("stub", [-0.15, -0.1, 0.1, 0.15])
def test_a_way_behind_the_end_of_a_wall_that_points_at_the_robot(stub, side):
    """No wall runs along the corridor there: what bounds it is that end, not the far wall of the way."""
    rng = np.random.default_rng(21)
    for width in np.arange(0.62, 0.9, 0.04):
        aside, deep, far = rng.uniform(0.32, 0.5), rng.uniform(1.0, 1.3), stub + width
        niche = [(stub, -aside, stub, -deep), (stub, -deep, far, -deep), (far, -deep, far, 1.0)]
        walls = [(x0, side * y0, x1, side * y1) for x0, y0, x1, y1 in niche]
        junction = junction_at(walls, Pose(0, 0, rng.uniform(-0.05, 0.05)), seed=4)
        way = junction.right if side > 0 else junction.left
        assert way.open
        assert way.near == pytest.approx(stub, abs=0.1)


@pytest.mark.parametrize("x", [1.08, 1.12, 1.14, 1.16, 1.18, 1.2])
@pytest.mark.parametrize("seed", range(3))
def test_where_a_wall_comes_into_sight_through_a_gap_is_not_its_end(x, seed):
    """The far wall of the way to the left, of which only a part is seen, is not the wall in which that way begins."""
    walls = [
        (0, 0.06, 0, 2.9), (0, 2.137, 0.71, 2.123), (0, 2.9, 2.12, 2.86), (1.42, 1.41, 1.42, 2.13),
        (0.72, 1.42, 1.42, 1.41), (2.13, 1.4, 2.12, 2.86),
    ]  # fmt: skip
    junction = junction_at(walls, Pose(x, 2.5, math.pi), seed)
    assert junction.kind is JunctionKind.T_LEFT
    assert junction.left.far == pytest.approx(x - 0.71, abs=0.08)


@pytest.mark.parametrize("passed", [0.2, 0.28, 0.34])
@pytest.mark.parametrize("side", [1, -1])
def test_a_way_behind_is_past_also_for_a_laser_that_sees_it(side, passed):
    """A laser that looks all round sees a way behind the robot. The next one begins just ahead, at the other side."""
    all_round = {"beams": 360, "angle_min": 0.0, "angle_max": math.tau * 359 / 360}
    robot = RobotDescription.model_validate({"laser": all_round})
    y = side * 0.5
    # The wall that bounds the way stands back a little, so that the gap in the corridor's wall goes on to beside the
    # robot, too narrow there.
    walls = [
        (-5, y, -1.5, y), (-1.5, y, -1.5, 6 * y), (-passed, 6 * y, -passed, 1.24 * y), (0.1, 6 * y, 0.1, y),
        (0.1, y, 1.1, y), (1.1, y, 1.1, -6 * y), (-5, -y, 0.1, -y), (0.1, -y, 0.1, -6 * y),
    ]  # fmt: skip
    junction = Perception(robot).facts(observe(walls, Pose(), robot, np.random.default_rng(2))).junction
    assert junction.kind is (JunctionKind.CORNER_RIGHT if side > 0 else JunctionKind.CORNER_LEFT)
