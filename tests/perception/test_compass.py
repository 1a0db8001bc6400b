"""The compass: accuracy, the whole range of headings, other world angles, what is not a wall; and Hough's."""

from __future__ import annotations

import math

import numpy as np
import pytest

from perception.compass import compass_of
from perception.facts import Perception
from perception.hough import hough_compass, hough_lines, hough_space
from perception.lines import find_lines, split
from perception.settings import CompassSettings, HoughSettings, LineSettings, PerceptionSettings
from perception.sweep import ScanPoints
from tests.perception import mazes
from tests.perception.scenes import PICO, cells, corridor, observe, polyline, scan_of
from transport.messages import Pose

MAZE = cells(["..#...", ".#..#.", "......", "#.##..", "...#..", "..#..."])


def compass_at(walls, pose, rng=None, settings=None):
    sweep = ScanPoints.of(scan_of(walls, pose, rng=rng))
    lines = find_lines(sweep, split(sweep, LineSettings()), LineSettings())
    return compass_of(lines, settings or CompassSettings())


def error(compass, heading, world_angle=math.pi / 2):
    return abs(math.degrees(math.remainder(compass.misalignment + heading, world_angle)))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_accuracy_at_any_heading(seed):
    rng = np.random.default_rng(seed)
    errors = []
    for _ in range(60):
        heading = rng.uniform(-math.pi, math.pi)
        compass = compass_at(MAZE, Pose(3.5 + rng.uniform(-0.2, 0.2), -2.5 + rng.uniform(-0.2, 0.2), heading), rng)
        assert compass.known
        errors.append(error(compass, heading))
    assert np.median(errors) <= 0.02
    assert np.quantile(errors, 0.95) <= 0.1


def test_its_own_standard_deviation_is_honest():
    rng = np.random.default_rng(4)
    found = [compass_at(corridor(1.0), Pose(0, 0.1, 0.3), rng) for _ in range(200)]
    scatter = np.std([compass.misalignment for compass in found])
    assert found[0].deviation / 1.5 < scatter < 1.5 * found[0].deviation


def test_the_sign_is_the_turn_that_aligns_the_robot():
    assert compass_at(corridor(1.0), Pose(0, 0, 0.1)).misalignment == pytest.approx(-0.1, abs=1e-4)


@pytest.mark.parametrize("sides", [3, 6])
def test_another_world_angle(sides):
    angle = math.tau / 6
    corners = [(2 * math.cos(k * math.tau / sides), 2 * math.sin(k * math.tau / sides)) for k in range(sides + 1)]
    walls = polyline(*corners)
    for heading in (-1.0, 0.0, 0.3, 2.0):
        pose = Pose(0.1, 0.2, heading)
        compass = compass_at(walls, pose, np.random.default_rng(2), CompassSettings(world_angle=angle))
        direction = math.atan2(corners[1][1] - corners[0][1], corners[1][0] - corners[0][0])
        assert error(compass, heading - direction, angle) < 0.2


def test_a_diagonal_wall_does_not_turn_it():
    walls = [*corridor(1.2), (1.0, 0.6, 1.6, 0.0)]
    assert error(compass_at(walls, Pose(0, 0, 0.2), np.random.default_rng(1)), 0.2) < 0.05


def test_round_walls_are_unknown():
    angles = np.linspace(0, math.tau, 200)
    walls = polyline(*np.c_[np.cos(angles), np.sin(angles)])
    assert not compass_at(walls, Pose(0.1, 0.0, 0.0), np.random.default_rng(3)).known


def test_scattered_hits_are_unknown():
    rng = np.random.default_rng(3)
    scan = scan_of([], Pose())
    scan.ranges[:] = rng.uniform(0.5, 5.0, 1000)
    sweep = ScanPoints.of(scan)
    compass = compass_of(find_lines(sweep, split(sweep, LineSettings()), LineSettings()), CompassSettings())
    assert not compass.known
    assert compass.misalignment == 0.0


def test_dead_reckoning_takes_over_where_the_compass_is_unknown():
    perception = Perception(PICO)
    perception.facts(observe(corridor(1.0), Pose(0, 0, 0.1)))
    facts = perception.facts(observe([], Pose(0, 0, 0.2)))
    assert not facts.compass.known
    assert facts.misalignment == pytest.approx(-0.2, abs=1e-3)


def test_the_heading_does_not_drift_with_the_odometry():
    perception = Perception(PICO)
    rng = np.random.default_rng(6)
    walls = corridor(1.0, 40.0)
    for tick in range(200):
        drift = 0.002 * tick
        observation = observe(walls, Pose(0.05 * tick - 5.0, 0.0, 0.05), rng=rng)
        odometry = observation.odometry.at(0, Pose(0.05 * tick, 0.0, 0.05 + drift))
        facts = perception.facts(type(observation)(0, observation.scan, odometry))
    assert facts.pose.heading == pytest.approx(0.05, abs=math.radians(0.6))


# --- the Hough transform of 2015 ---


def test_the_hough_grid_holds_every_hit_of_the_trust_area():
    settings = HoughSettings(area=1.5)
    corner = np.array([[1.5, 1.5], [-1.5, 1.5], [-1.5, -1.5], [1.5, -1.5]])
    space = hough_space(corner, settings)
    assert (space.votes.sum(axis=1) == 4).all()
    assert space.ps[-1] >= 1.5 * math.sqrt(2)
    assert space.ps[0] == -space.ps[-1]


def test_a_hit_votes_for_the_lines_through_it():
    space = hough_space(np.array([[0.6, 0.8]]), HoughSettings())
    for row, alpha in enumerate(space.alphas):
        p = space.ps[int(space.votes[row].argmax())]
        assert p == pytest.approx(0.6 * math.cos(alpha) + 0.8 * math.sin(alpha), abs=0.011)


@pytest.mark.parametrize("seed", [1, 2])
def test_the_hough_compass_is_as_fine_as_its_grid(seed):
    rng = np.random.default_rng(seed)
    settings = PerceptionSettings()
    errors = []
    for _ in range(40):
        heading = rng.uniform(-math.pi, math.pi)
        sweep = ScanPoints.of(scan_of(MAZE, Pose(3.5, -2.5, heading), rng=rng))
        compass = hough_compass(sweep.points, settings.hough, math.pi / 2)
        errors.append(error(compass, heading))
    assert np.median(errors) <= 0.6
    assert np.quantile(errors, 0.95) <= 2.0


@pytest.mark.parametrize("degrees", [0.5, 1.0, 1.1, 2.0, 45.0, 90.0])
@pytest.mark.parametrize("seed", [1, 2])
def test_the_hough_compass_leaves_out_no_line_that_could_have_the_most_hits(seed, degrees):
    rng = np.random.default_rng(seed)
    settings = HoughSettings(step=math.radians(degrees), min_share=0)
    for _ in range(20):
        walls, pose = mazes.place(rng)
        points = ScanPoints.of(scan_of(walls, pose, rng=rng)).points
        points = points if rng.random() < 0.7 else rng.uniform(-2, 2, (int(rng.integers(1, 30)), 2))
        space, compass = hough_space(points, settings), hough_compass(points, settings, math.pi)
        row = int(space.votes.argmax()) // len(space.ps)
        assert compass.misalignment == pytest.approx(math.remainder(space.alphas[row] - math.pi / 2, math.pi))
        assert compass.confidence == space.votes.max() / space.hits


def test_hough_lines_are_the_walls_of_a_corridor():
    settings = HoughSettings()
    walls = [*corridor(1.0), (1.5, -0.5, 1.5, 0.5)]
    sweep = ScanPoints.of(scan_of(walls, Pose(0.0, 0.1, 0.0), rng=np.random.default_rng(1)))
    found = hough_lines(hough_space(sweep.points, settings), settings, math.pi / 2)
    placed = {(round(math.degrees(line.alpha)) % 180, round(line.p, 1)) for line in found}
    assert placed == {(90, 0.4), (90, -0.6), (0, 1.5)}


def test_no_hits_no_hough():
    nothing = np.empty((0, 2))
    space = hough_space(nothing, HoughSettings())
    assert not hough_compass(nothing, HoughSettings(), math.pi / 2).known
    assert hough_lines(space, HoughSettings(), math.pi / 2) == []
