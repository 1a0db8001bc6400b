"""Driving to a target through a potential field: there where there is a way, and told where there is none."""

import math

import numpy as np
import pytest

from perception.repulsion import Force
from skills.activities.drive_to import DriveTo
from skills.steering.field import FieldSeeker
from transport.description import RobotDescription
from transport.messages import STOP, Pose

SEEDS = (0, 1, 2)
HOLONOMIC, TWO_WHEELS = (RobotDescription.model_validate({"base": base}) for base in ("holonomic", "differential"))
ARRIVED = 0.07
"""How far from its target the robot may say that it is there, beside its odometry's drift, m."""
DRIFT = 0.01
"""Of the way."""


def arrived(done, distance, bearing=0.0):
    """Whether the robot stands at its target, as well as its odometry can know it."""
    target = distance * math.cos(bearing), distance * math.sin(bearing)
    return math.dist((done.end.x, done.end.y), target) < ARRIVED + DRIFT * distance


def longest_rest(done):
    """The longest time for which the robot was told to stand still, s."""
    longest = resting = 0
    for command in done.commands:
        resting = resting + 1 if command.twist == STOP else 0
        longest = max(longest, resting)
    return longest * 0.1


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("bearing", [0, 60, -90, 180])
def test_in_the_open_it_arrives(world, hall, drive, bearing, seed):
    done = drive(DriveTo(1.7, math.radians(bearing)), world(hall), seed)
    assert done.outcome == "done"
    assert arrived(done, 1.7, math.radians(bearing))
    assert done.clearance > 0.2


@pytest.fixture
def scene(hall, block):
    """Walls between the robot and a target straight ahead, by name, and how far the target is, m."""
    blocks = hall + block(1.5, 0.2, 0.4, 0.8) + block(2.8, -0.3, 0.4, 0.8)
    posts = hall + block(1, 0.15, 0.1, 0.1) + block(2, -0.15, 0.1, 0.1) + block(3, 0.1, 0.1, 0.1)
    scenes = {
        "block": (hall + block(1.8, 0, 0.6, 0.6), 3.5),
        "block aside": (hall + block(1.8, 0.2, 0.6, 0.6), 3.5),
        "wide block": (hall + block(1.8, 0.1, 0.4, 2.0), 3.5),
        "blocks": (blocks, 4.2),
        "posts": (posts, 4.0),
        "slalom": ([*hall, (1.2, -3, 1.2, 0.3), (2.6, -0.3, 2.6, 3)], 4.0),
        "gap": ([*hall, (1.5, -3, 1.5, 0.3), (1.5, 1.1, 1.5, 3)], 3.0),
        "beside a wall": ([*hall, (2.0, -0.38, 6, -0.38)], 4.0),
        "before a wall": (hall, 5.6),
    }
    return scenes.__getitem__


RUNS = [*((HOLONOMIC, seed) for seed in SEEDS), *((TWO_WHEELS, seed) for seed in SEEDS[:2])]
"""Robots and seeds."""


@pytest.mark.parametrize(("robot", "seed"), RUNS)
@pytest.mark.parametrize(
    "name",
    ["block", "block aside", "wide block", "blocks", "posts", "slalom", "gap", "beside a wall", "before a wall"],
)
def test_obstacles_are_rounded(world, scene, drive, name, robot, seed):  # noqa: PLR0917
    walls, distance = scene(name)
    done = drive(DriveTo(distance), world(walls), seed, limit=40, robot=robot)
    assert done.outcome == "done"
    assert arrived(done, distance)
    assert done.clearance > 0.09
    assert not done.touched


@pytest.mark.parametrize(("robot", "seed"), RUNS)
def test_it_turns_a_corner_of_a_corridor(world, drive, robot, seed):
    walls = [(-2, 0.5, 2, 0.5), (2, 0.5, 2, 4), (-2, -0.5, 3, -0.5), (3, -0.5, 3, 4)]
    done = drive(DriveTo(math.hypot(2.5, 2.5), math.pi / 4), world(walls), seed, limit=40, robot=robot)
    assert done.outcome == "done"
    assert arrived(done, math.hypot(2.5, 2.5), math.pi / 4)
    assert done.clearance > 0.1


@pytest.mark.parametrize("robot", [HOLONOMIC, TWO_WHEELS])
@pytest.mark.parametrize("width", [0.6, 1.0, 1.5, 2.0])
def test_a_corridor_is_driven_along(world, corridor, drive, width, robot):
    done = drive(DriveTo(4.0), world(corridor(width)), robot=robot)
    assert done.outcome == "done"
    assert arrived(done, 4.0)
    assert done.clearance > min(0.07, width / 2 - 0.25)


@pytest.mark.parametrize(("robot", "seed"), RUNS)
@pytest.mark.parametrize("trap", ["dead end", "wall", "pocket", "inside a wall"])
def test_where_there_is_no_way_it_is_blocked_soon(world, hall, corridor, drive, trap, robot, seed):  # noqa: PLR0917
    walls, distance = {
        "dead end": (corridor(1.0, length=2.0), 3.0),
        "wall": ([*hall, (2, -3, 2, 3)], 4.0),
        "pocket": ([*hall, (2, -0.8, 2, 0.8), (0.8, 0.8, 2, 0.8), (0.8, -0.8, 2, -0.8)], 3.5),
        "inside a wall": (hall, 6.2),
    }[trap]
    done = drive(DriveTo(distance), world(walls), seed, limit=40, robot=robot)
    assert done.outcome == "blocked"
    assert len(done.commands) * 0.1 < 30
    assert longest_rest(done) < 3
    assert done.clearance > 0.1
    assert done.last == STOP


def test_without_the_way_round_a_block_ahead_would_hold_it(world, scene, drive, monkeypatch):
    def straight_at_it(self, facts, distance, bearing):
        return min(0.5, distance) + facts.repulsion.forward, facts.repulsion.left

    monkeypatch.setattr(FieldSeeker, "_field", straight_at_it)
    walls, distance = scene("block")
    assert drive(DriveTo(distance), world(walls)).outcome == "blocked"


def test_without_the_push_of_the_walls_it_comes_nearer_to_them(world, hall, drive, monkeypatch):
    walls = [*hall, (1.0, -0.45, 3.0, -0.35)]
    pushed = drive(DriveTo(4.0), world(walls))
    monkeypatch.setattr("perception.facts.repulsion_of", lambda sweep, settings: Force())
    assert drive(DriveTo(4.0), world(walls)).clearance < pushed.clearance - 0.02


@pytest.mark.parametrize("seed", range(12))
def test_among_blocks_at_random_it_always_comes_to_an_end(world, hall, block, drive, seed):
    rng = np.random.default_rng(seed)
    walls = list(hall)
    for x, y, length, width in zip(*rng.uniform((0.7, -2, 0.1, 0.1), (4, 2, 0.8, 0.8), (5, 4)).T, strict=True):
        walls += block(x, y, length, width)
    done = drive(DriveTo(5.0), world(walls), seed, limit=90)
    assert done.outcome in ("done", "blocked")
    assert done.outcome == "blocked" or arrived(done, 5.0)
    assert longest_rest(done) < 3
    assert done.clearance > 0.07


def test_it_does_not_back_into_what_it_cannot_see(world, block, drive):
    facing_a_wall = block(0, 0, 0.7, 3.0)
    done = drive(DriveTo(1.0, math.radians(100)), world(facing_a_wall))
    assert done.outcome in ("done", "blocked")
    assert not done.touched
    assert min(pose.x for pose in done.path) > -0.08


def test_a_target_is_where_the_robot_was_told_not_where_it_is_now(world, hall, drive):
    done = drive(DriveTo(2.0, math.radians(30)), world(hall, Pose(1, -1, math.radians(60))))
    assert done.outcome == "done"
    assert math.dist((done.end.x, done.end.y), (1, 1)) < ARRIVED + DRIFT * 2


@pytest.mark.parametrize("arguments", [(0.0,), (-1.0,), (math.nan,), (1.0, math.inf), (1.0, 0.0, 0.0)])
def test_arguments_without_a_meaning_are_refused(arguments):
    with pytest.raises(ValueError, match="must be"):
        DriveTo(*arguments)
