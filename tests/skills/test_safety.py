import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from skills.outline import Outline
from skills.safety import CollisionGuard
from skills.settings import SafetySettings
from transport.base import integrate
from transport.description import RobotDescription
from transport.messages import STOP, Pose, Twist

ROBOT = RobotDescription()
SETTINGS = SafetySettings()
components = st.floats(-1, 1)
twists = st.builds(Twist, components, components, st.floats(-2, 2))


def corridor(width, length=2.0, middle=0.0):
    x = np.arange(-length, length, 0.02)
    return np.concatenate([np.column_stack([x, np.full_like(x, middle + side * width / 2)]) for side in (-1, 1)])


def wall_ahead(distance):
    y = np.arange(-1, 1, 0.02)
    return np.column_stack([np.full_like(y, distance), y])


def seen_from(points, pose):
    cos, sin = math.cos(pose.heading), math.sin(pose.heading)
    return (points - (pose.x, pose.y)) @ np.array([[cos, -sin], [sin, cos]])


def driven(points, wanted, ticks=80, noise=0.0, seed=0, robot=ROBOT):  # noqa: PLR0917
    """The smallest clearance on a drive with a constant wish, and where it ends."""
    guard, pose, twist, least = CollisionGuard(robot, SETTINGS), Pose(), STOP, math.inf
    rng = np.random.default_rng(seed)
    for _ in range(ticks):
        seen = seen_from(points, pose)
        twist = guard.admit(twist, wanted, seen + rng.normal(0, noise, seen.shape))
        pose = integrate(pose, twist, ROBOT.period)
        least = min(least, guard.clearance(seen_from(points, pose), np.zeros((1, 3))))
    return least, pose


def test_with_room_a_wish_is_granted():
    guard = CollisionGuard(ROBOT, SETTINGS)
    wanted = Twist(0.1, 0.02, 0.3)
    assert guard.admit(Twist(0.1, 0.02, 0.3), wanted, corridor(1.5)) == wanted


def test_a_robot_that_wants_into_a_wall_stops_before_it():
    least, pose = driven(wall_ahead(2.0), Twist(0.5))
    assert least == pytest.approx(SETTINGS.margin, abs=0.04)
    assert least >= SETTINGS.margin - 1e-9
    assert abs(pose.y) < 0.2


def test_without_the_guard_it_would_have_hit_it():
    pose = Pose()
    for _ in range(80):
        pose = integrate(pose, Twist(0.5), 0.1)
    assert pose.x > 2.0


def test_a_robot_that_wants_along_a_wall_and_into_it_slides_along_it():
    _, pose = driven(corridor(1.0, length=6.0), Twist(0.3, 0.2))
    assert pose.x > 1.5


@pytest.mark.parametrize("wanted", [Twist(0.5), Twist(0.0, 0.0, 1.0), STOP])
@pytest.mark.parametrize(("at", "away"), [((0.07, 0.0), (-1, 0)), ((0.08, 0.05), (-1, 0)), ((0.0, 0.19), (0, -1))])
def test_what_is_within_the_box_is_backed_away_from(at, away, wanted):
    end_of_a_wall = np.array(at) - np.outer(np.arange(0, 1, 0.02), away)
    least, pose = driven(end_of_a_wall, wanted, ticks=30)
    assert least >= CollisionGuard(ROBOT, SETTINGS).clearance(end_of_a_wall, np.zeros((1, 3))) - 1e-9
    assert pose.x * away[0] + pose.y * away[1] > 0.05


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("towards", [20, 45, 70])
def test_in_a_corner_the_margin_is_kept_however_long_the_robot_presses(towards, seed):
    corner = np.concatenate([wall_ahead(1.0), wall_ahead(1.0)[:, ::-1]])
    corner = corner[(corner <= 1.0).all(axis=1)]
    wanted = Twist(0.3 * math.cos(math.radians(towards)), 0.3 * math.sin(math.radians(towards)))
    least, _ = driven(corner, wanted, 150, noise=0.005, seed=seed)
    assert least >= SETTINGS.margin - 0.03


def overtaken_by(speed, direction, ticks=40):
    """The smallest clearance of a robot that wants to stand still while a wall comes on from ahead or from a side."""
    guard, pose, twist, least = CollisionGuard(ROBOT, SETTINGS), Pose(), STOP, math.inf
    for tick in range(ticks):
        wall = wall_ahead(0.6 - speed * tick * ROBOT.period)
        seen = seen_from(seen_from(wall, Pose(heading=direction)), pose)
        least = min(least, guard.clearance(seen, np.zeros((1, 3))))
        twist = guard.admit(twist, STOP, seen)
        pose = integrate(pose, twist, ROBOT.period)
    return least


@pytest.mark.parametrize("direction", [0, math.pi / 2, 2.0])
@pytest.mark.parametrize("speed", [0.1, 0.2, 0.3])
def test_the_robot_gives_way_to_what_comes_on(speed, direction, monkeypatch):
    assert overtaken_by(speed, direction) > 0.03
    monkeypatch.setattr("skills.safety.HARDEST", 1.0)
    assert speed <= SETTINGS.push or overtaken_by(speed, direction) <= 0


def test_a_corridor_of_60_cm_can_be_driven():
    least, pose = driven(corridor(0.6, length=6.0), Twist(0.4))
    assert pose.x > 2.5
    assert least > 0.09


@given(twists, st.integers(0, 1000))
@settings(max_examples=60, deadline=None, derandomize=True)
def test_no_wish_brings_the_outline_into_the_margin(wanted, seed):
    rng = np.random.default_rng(seed)
    scattered = rng.uniform(-1.5, 1.5, (60, 2))
    points = np.concatenate([scattered[np.abs(scattered).max(axis=1) > 0.45], corridor(1.2)])
    least, _ = driven(points, wanted, ticks=40)
    assert least >= SETTINGS.least_margin - 1e-6


@given(twists, twists, st.floats(0.2, 1.5))
@settings(max_examples=100, deadline=None, derandomize=True)
def test_what_the_guard_answers_keeps_the_limits(before, wanted, distance):
    limits = ROBOT.limits
    before = ROBOT.towards(STOP, ROBOT.limited(before), 0.1)
    got = CollisionGuard(ROBOT, SETTINGS).admit(before, wanted, wall_ahead(distance))
    assert got.speed <= limits.speed + 1e-9
    assert abs(got.turn) <= limits.turn_rate + 1e-9
    assert math.hypot(got.forward - before.forward, got.left - before.left) <= limits.acceleration * 0.1 + 1e-9
    assert abs(got.turn - before.turn) <= limits.turn_acceleration * 0.1 + 1e-9


def test_the_margin_is_less_where_there_is_less_room():
    guard = CollisionGuard(ROBOT, SETTINGS)
    assert guard.margin(corridor(1.0)) == SETTINGS.margin
    assert guard.margin(corridor(0.6)) == pytest.approx(0.07, abs=1e-6)
    assert guard.margin(wall_ahead(0.4)) == SETTINGS.margin


@pytest.mark.parametrize("degrees", [-60, -45, -35, -20, 20, 35, 45, 60])
def test_who_turns_in_a_corridor_of_80_cm_is_in_no_narrow_passage(degrees):
    """The wall that the robot turns away from comes near on its side a little farther ahead."""
    seen = seen_from(corridor(0.8), Pose(0, 0, math.radians(degrees)))
    assert CollisionGuard(ROBOT, SETTINGS).margin(seen) >= 0.1


def on_two_wheels(footprint=ROBOT.footprint):
    return RobotDescription.model_validate({"base": "differential", "footprint": footprint})


def circle(radius, corners=32):
    angles = [math.tau * corner / corners for corner in range(corners)]
    return tuple((radius * math.cos(angle), radius * math.sin(angle)) for angle in angles)


ROUND = RobotDescription(footprint=circle(0.2))
OUTLINES = {
    "pico": ROBOT.footprint,
    "round": circle(0.2),
    "octagon": circle(0.2, 8),
    "long": ((0.1, 0.1), (-0.3, 0.1), (-0.3, -0.1), (0.1, -0.1)),
    "rounded": ((0.2, 0.1), (0.15, 0.15), (-0.15, 0.15), (-0.2, 0.1), (-0.2, -0.1), (-0.15, -0.15), (0.15, -0.15)),
}


@pytest.mark.parametrize("name", OUTLINES)
def test_the_outline_holds_the_footprint_and_is_no_larger_than_its_box(name):
    footprint = np.array(OUTLINES[name])
    outline = Outline(OUTLINES[name])
    at_rest = np.zeros((1, 3))
    assert all(outline.clearance(corner[None, :], at_rest) <= 1e-6 for corner in footprint)
    assert (outline.middle + outline.half >= footprint.max(axis=0) - 1e-12).all()
    assert outline.clearance(np.array([[footprint[:, 0].max() + 0.1, 0.0]]), at_rest) == pytest.approx(0.1)


def test_a_box_keeps_its_corners_and_a_circle_has_none():
    assert Outline(ROBOT.footprint).rounding == 0.0
    assert Outline(OUTLINES["long"]).rounding == 0.0
    assert Outline(circle(0.2)).rounding == pytest.approx(0.2, abs=1e-6)
    assert 0.01 < Outline(OUTLINES["rounded"]).rounding < 0.2


@given(st.floats(-math.pi, math.pi), st.integers(0, 1000))
@settings(max_examples=30, deadline=None, derandomize=True)
def test_a_round_robot_loses_no_clearance_by_turning(angle, seed):
    points = np.random.default_rng(seed).uniform(-1.0, 1.0, (40, 2))
    outline = Outline(circle(0.2))
    turned = outline.clearance(points, np.array([[0.0, 0.0, angle]]))
    assert turned == pytest.approx(outline.clearance(points, np.zeros((1, 3))), abs=1e-6)


@pytest.mark.parametrize("robot", [ROUND, on_two_wheels(circle(0.2))], ids=["holonomic", "two wheels"])
@pytest.mark.parametrize("turn", [1.0, -1.0])
def test_a_round_robot_turns_freely_between_walls_within_its_margin(robot, turn):
    _, pose = driven(corridor(0.46), Twist(turn=turn), ticks=40, noise=0.003, robot=robot)
    assert abs(math.remainder(pose.heading - turn * 3.9, math.tau)) < 0.3


@given(twists, st.integers(0, 1000))
@settings(max_examples=40, deadline=None, derandomize=True)
def test_no_wish_brings_the_outline_of_a_robot_on_two_wheels_near_a_wall(wanted, seed):
    rng = np.random.default_rng(seed)
    scattered = rng.uniform(-1.5, 1.5, (60, 2))
    points = np.concatenate([scattered[np.abs(scattered).max(axis=1) > 0.45], corridor(1.2)])
    least, _ = driven(points, wanted, ticks=40, robot=on_two_wheels())
    # A turn away from a wall may take half of the least margin, nothing else less than all of it.
    assert least >= SETTINGS.least_margin / 2 - 1e-6


@pytest.mark.parametrize("beside", [0.23, 0.26, 0.3])
@pytest.mark.parametrize("side", [1, -1])
def test_beside_a_wall_a_robot_on_two_wheels_gets_away(side, beside):
    """As close as its rear corner may swing in; parallel, it could else only drive on along the wall."""
    x = np.arange(-2, 8, 0.02)
    wall = np.column_stack([x, np.full_like(x, side * beside)])
    least, pose = driven(wall, Twist(0.3, 0.0, -side * 0.5), ticks=15, robot=on_two_wheels())
    assert -side * pose.heading > 0.15
    assert pose.x > 0.2
    assert least > 0.01


def test_a_robot_on_two_wheels_cannot_give_way_to_what_comes_from_its_side():
    """It stands where a holonomic one moves aside; what comes on from ahead it backs from."""
    for robot, gives_way in ((ROBOT, True), (on_two_wheels(), False)):
        wall = np.column_stack([np.arange(-1, 1, 0.02), np.full(100, 0.28)])
        _, pose = driven(wall, STOP, ticks=20, robot=robot)
        assert (pose.y < -0.02) == gives_way
    _, pose = driven(wall_ahead(0.15), STOP, ticks=20, robot=on_two_wheels())
    assert pose.x < -0.05
