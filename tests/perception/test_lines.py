"""Lines and landmarks: accuracy, gaps, corners, association."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from perception.landmarks import Landmark, find_landmarks
from perception.lines import find_lines, split, split_at_end_points
from perception.settings import LandmarkSettings, LineSettings
from perception.sweep import ScanPoints
from perception.world import to_world
from tests.perception.scenes import PICO, cells, corridor, scan_of
from transport.description import Laser
from transport.messages import Pose

ROOM = [(-1, -1, 2, -1), (2, -1, 2, 1.5), (2, 1.5, -1, 1.5)]


def lines_at(walls, pose, rng=None, laser=PICO.laser):
    sweep = ScanPoints.of(scan_of(walls, pose, laser, rng), laser.mount)
    return find_lines(sweep, split(sweep, LineSettings()), LineSettings())


def test_the_walls_of_a_room():
    lines = lines_at(ROOM, Pose(), np.random.default_rng(1))
    assert len(lines) == 3
    for line, (alpha, p) in zip(lines, [(-math.pi / 2, 1.0), (0.0, 2.0), (math.pi / 2, 1.5)], strict=True):
        assert abs(math.remainder(line.alpha - alpha, math.tau)) < math.radians(0.2)
        assert line.p == pytest.approx(p, abs=0.003)
    assert lines[1].start == pytest.approx((2, -1), abs=0.08)
    assert lines[1].end == pytest.approx((2, 1.5), abs=0.08)
    assert lines[1].length == pytest.approx(2.5, abs=0.12)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_accuracy(seed):
    rng = np.random.default_rng(seed)
    maze = cells(["..#...", ".#..#.", "......", "#.##..", "...#..", "..#..."])
    angles, offsets = [], []
    for _ in range(40):
        pose = Pose(3.5 + rng.uniform(-0.2, 0.2), -2.5 + rng.uniform(-0.2, 0.2), rng.uniform(-math.pi, math.pi))
        for line in lines_at(maze, pose, rng):
            alpha = line.alpha + pose.heading
            angles.append(abs(math.degrees(math.remainder(alpha, math.pi / 2))))
            middle = to_world(pose, ((line.start[0] + line.end[0]) / 2, (line.start[1] + line.end[1]) / 2))
            offsets.append(abs(math.remainder(middle[round(alpha / (math.pi / 2)) % 2], 1.0)))
    assert np.median(angles) <= 0.07
    assert np.median(offsets) <= 0.0004


def test_a_corner_is_not_split_twice():
    """A split that noise puts beside a corner must not leave a sliver of wall."""
    for seed in range(60):
        rng = np.random.default_rng(seed)
        assert len(lines_at(ROOM, Pose(0, 0, rng.uniform(-0.4, 0.4)), rng)) == 3


@pytest.mark.parametrize("seed", range(20))
def test_no_point_is_far_from_the_chord_of_its_piece(seed):
    """Whatever way the chord runs, a closed run of points among them."""
    rng = np.random.default_rng(seed)
    corners = rng.uniform(-2, 2, (4, 2))
    points = np.concatenate([np.linspace(*pair, 60) for pair in pairwise([*corners, corners[0]])])
    points += rng.normal(0, 0.01, points.shape)
    points[-1] = points[0]
    pieces = split_at_end_points(points, [(0, len(points) - 1)], 0.04, 1)
    for first, last in pieces:
        (x, y), (dx, dy) = points[first], points[last] - points[first]
        offsets = points[first : last + 1] - (x, y)
        assert np.abs(offsets @ (dy, -dx)).max() <= 0.04 * math.hypot(dx, dy) + 1e-12
    assert [first for first, _ in pieces] == [0, *(last for _, last in pieces[:-1])]
    assert pieces[-1][1] == len(points) - 1
    assert 4 <= len(pieces) <= 30


def test_the_frame_is_the_robots_whatever_the_mounting():
    laser = Laser(mount_x=0.15, mount_y=-0.05, mount_heading=0.4)
    lines = lines_at(ROOM, Pose(0.2, 0.1, 0.1), np.random.default_rng(2), laser)
    turned = [math.remainder(line.alpha + 0.1, math.tau) for line in lines]
    for line, alpha in zip(lines, turned, strict=True):
        normal = round(alpha / (math.pi / 2))
        expected = {-1: 1.1, 0: 1.8, 1: 1.4}[normal]
        assert line.p == pytest.approx(expected, abs=0.004)


def test_nothing_is_found_in_nothing():
    assert len(lines_at([], Pose())) == 0
    assert find_landmarks(lines_at([], Pose()), LandmarkSettings()) == ()


def test_a_post_before_a_wall_does_not_make_two_landmarks_of_it():
    walls = [(2, -2, 2, 2), (1.0, 0.0, 1.0, 0.05)]
    landmarks = find_landmarks(lines_at(walls, Pose(), np.random.default_rng(1)), LandmarkSettings())
    behind = [wall for wall in landmarks if wall.p > 1.5]
    assert len(behind) == 1
    assert behind[0].length == pytest.approx(4.0, abs=0.1)
    assert behind[0].p == pytest.approx(2.0, abs=0.002)


def test_an_opening_ends_a_landmark():
    walls = [(2, -2, 2, -0.4), (2, 0.4, 2, 2)]
    landmarks = find_landmarks(lines_at(walls, Pose(), np.random.default_rng(1)), LandmarkSettings())
    assert [round(wall.length, 1) for wall in landmarks] == [1.6, 1.6]


def test_a_short_sighting_is_no_landmark():
    walls = [(2, -0.1, 2, 0.1), (-1, 1, 3, 1)]
    lines = lines_at(walls, Pose(), np.random.default_rng(1))
    assert len(find_landmarks(lines, LandmarkSettings())) == 2
    assert len(find_landmarks(lines, LandmarkSettings(min_hits=100))) == 1


def test_a_wall_keeps_alpha_and_p_from_wherever_it_is_seen():
    rng = np.random.default_rng(3)
    for _ in range(30):
        pose = Pose(rng.uniform(-0.5, 1.0), rng.uniform(-0.5, 1.0), rng.uniform(-0.3, 0.3))
        for landmark in find_landmarks(lines_at(ROOM, pose, rng), LandmarkSettings()):
            placed = landmark.seen_from(pose)
            distances = {0: 2.0, 1: 1.5, -1: 1.0}
            normal = round(placed.alpha / (math.pi / 2))
            assert placed.p == pytest.approx(distances[normal], abs=0.01)
            assert placed.length == pytest.approx(landmark.length)


def test_a_landmark_that_the_origin_is_behind_of_turns_its_normal():
    landmark = Landmark((1, -1), (1, 1), 0.0, 1.0, 50).seen_from(Pose(-3.0, 0.0, 0.0))
    assert landmark.p == pytest.approx(2.0)
    assert abs(landmark.alpha) == pytest.approx(math.pi)


def test_a_corridor_far_ahead_still_has_two_walls():
    lines = lines_at(corridor(1.0, 18.0), Pose(0, 0, 0.05), np.random.default_rng(5))
    assert sum(line.length > 3 for line in lines) == 2
