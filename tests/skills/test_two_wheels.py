"""A robot that cannot move sideways: it gets where it should be by the heading that it drives with."""

import math
from itertools import pairwise

import pytest

from sim.maze import MazeDoor, MovingObject
from skills.activities.advance import Advance
from skills.activities.align import Align
from skills.activities.arc import Arc
from skills.activities.door import Ring
from skills.activities.drive import Drive
from skills.activities.drive_to import DriveTo
from skills.activities.follow_wall import FollowWall
from skills.activities.make_room import MakeRoom
from skills.activities.move import Move
from skills.activities.pass_corner import PassCorner
from skills.activities.rotate import Rotate
from skills.settings import SkillSettings
from skills.sides import Side
from skills.steering import OnPath, steering_of
from skills.steering.law import Steering
from transport.base import integrate
from transport.description import RobotDescription
from transport.messages import STOP, Pose

CIRCLE = tuple((0.2 * math.cos(angle), 0.2 * math.sin(angle)) for angle in (math.tau * i / 32 for i in range(32)))
BOX = RobotDescription.model_validate({"base": "differential"})
ROUND = RobotDescription.model_validate({"base": "differential", "footprint": CIRCLE})
HOLONOMIC = RobotDescription()
BOX_OF_60_CM = ((0.3, 0.3), (-0.3, 0.3), (-0.3, -0.3), (0.3, -0.3))


@pytest.fixture(params=[BOX, ROUND], ids=["box", "round"])
def robot(request):
    return request.param


@pytest.mark.parametrize("aside", [0.2, -0.2])
def test_off_the_middle_of_a_corridor_it_returns_within_a_metre(world, corridor, drive, robot, aside):
    done = drive(Drive(), world(corridor(1.0), Pose(0, aside)), limit=8, robot=robot)
    off = [(pose.x, pose.y * math.copysign(1, aside)) for pose in done.path]
    assert all(abs(y) < 0.04 for x, y in off if x > 1)
    assert min(y for _, y in off) > -0.02
    assert done.end.x > 3.0


@pytest.mark.parametrize("y", [-0.20, 0.12])
def test_beside_a_wall_it_turns_away_and_gets_on(world, corridor, drive, robot, y):
    """Parallel to a wall within the margin: its rear must swing in before it gets away."""
    done = drive(Drive(), world(corridor(0.9), Pose(0, y)), limit=8, robot=robot)
    assert done.end.x > 3.0
    assert abs(done.end.y) < 0.03
    assert done.clearance > 0.02


@pytest.mark.parametrize("width", [0.6, 0.8, 1.4])
def test_corridors_are_driven_along(world, corridor, drive, robot, width):
    done = drive(Drive(), world(corridor(width), Pose(0, 0, 0.1)), limit=8, robot=robot)
    assert done.end.x > 3.0
    assert abs(done.end.y) < 0.04


def test_where_the_wall_steps_in_it_gives_way(world, drive, robot):
    walls = [(-2, -0.5, 2, -0.5), (2, -0.5, 2, -0.2), (2, -0.2, 8, -0.2), (-2, 0.7, 8, 0.7)]
    done = drive(FollowWall(Side.RIGHT), world(walls), limit=12, robot=robot)
    assert done.end.x > 3.5
    assert not done.touched


@pytest.mark.parametrize("aside", [0.11, 0.12])
def test_the_end_of_a_wall_beside_its_way_does_not_hold_it_up(world, drive, aside):
    walls = [(-0.6, -0.334, 3, -0.334), (0.35, 0.334, 1.2, 0.334), (-0.6, 0.9, 0.3, 0.9), (-0.6, -0.334, -0.6, 0.9)]
    done = drive(Drive(), world(walls, Pose(0, aside)), limit=12, robot=BOX)
    assert done.end.x > 2
    assert not done.touched


@pytest.mark.parametrize(("share", "farthest"), [(0.7, 45), (0.9, 45), (1.3, 80)])
def test_only_for_what_reaches_far_into_its_lane_the_walls_beside_it_come_ahead(robot, share, farthest):
    """Beyond 45 degrees the compass takes the walls beside the robot for those ahead."""
    settings = SkillSettings()
    aside = share * robot.half_width
    turn = steering_of(robot, settings).along(0.0, robot.limits.speed, aside, 0.01).turn
    slant = math.degrees(turn / settings.motion.heading_gain)
    assert farthest - 30 < slant <= farthest + 0.01


@pytest.mark.parametrize("start", [0.35, 0.37, 0.4])
def test_where_a_wall_keeps_it_from_the_arc_it_turns_on_the_spot(world, block, drive, start):
    room = [(-0.335, -1, -0.335, 1.675), (-0.335, 1.675, 2.35, 1.675), (-0.335, -1, 2.35, -1), (2.35, -1, 2.35, 1.675)]
    walls = [*room, *block(1.34, 0, 0.67, 0.67), (0.335, 1, 1, 1), (1.675, 1, 2.35, 1)]
    done = drive(Arc(Side.LEFT), world(walls, Pose(start, 0)), limit=20, robot=BOX)
    assert done.outcome == "done"
    assert abs(math.remainder(done.end.heading - math.pi / 2, math.tau)) < math.radians(6)
    assert not done.touched


@pytest.mark.parametrize("side", list(Side))
@pytest.mark.parametrize(("width", "start"), [(0.8, 1.2), (1.0, 1.8), (1.4, 2.05)])
def test_an_arc_ends_in_the_middle_of_the_opening(world, side_exit, drive, side, width, start):  # noqa: PLR0917
    done = drive(Arc(side), world(side_exit(side.sign, width, width), Pose(start, 0)), robot=BOX)
    assert done.outcome == "done"
    assert abs(math.remainder(done.end.heading - side.sign * math.pi / 2, math.tau)) < math.radians(6)
    assert done.end.x - 2 == pytest.approx(min(width / 2, 0.5), abs=0.1)
    assert done.clearance > 0.1


@pytest.mark.parametrize("robot", [BOX, HOLONOMIC], ids=["two wheels", "holonomic"])
@pytest.mark.parametrize("ahead", [1.1, 1.25, 1.4])
def test_an_arc_into_a_way_whose_corner_is_out_of_sight_ends_beside_the_wall_ahead(world, drive, robot, ahead):
    """A narrow way may begin along that wall, and it is too late to get there by following it."""
    walls = [(-2, -0.5, ahead, -0.5), (ahead, -0.5, ahead, 4), (-2, 0.5, -0.5, 0.5)]
    done = drive(Arc(Side.LEFT), world(walls), robot=robot)
    assert done.outcome == "done"
    assert ahead - done.end.x == pytest.approx(0.5, abs=0.06)


@pytest.mark.parametrize("robot", [BOX, HOLONOMIC], ids=["two wheels", "holonomic"])
@pytest.mark.parametrize("first", [-0.3, -1.5])
def test_an_arc_leads_into_the_next_opening_where_the_first_is_nearly_passed(world, drive, robot, first):
    """Only the end of a thin wall is between the two; the first may begin so far behind that it is out of sight."""
    walls = [(-2, -0.4, 1.2, -0.4), (1.2, -0.4, 1.2, 3), (-2, 0.4, first, 0.4), (0.25, 0.4, 0.25, 3)]
    done = drive(Arc(Side.LEFT), world(walls), robot=robot)
    assert done.outcome == "done"
    assert done.end.x == pytest.approx(0.72, abs=0.1)
    assert done.clearance > 0.1


@pytest.mark.parametrize("side", list(Side))
def test_past_a_corner_it_stands_before_the_opening_along_the_walls(world, side_exit, drive, robot, side):
    done = drive(PassCorner(side), world(side_exit(side.sign, 1.0, 1.0), Pose(2.05, 0.1)), robot=robot)
    assert done.outcome == "done"
    assert done.end.x - 2 == pytest.approx(0.5, abs=0.08)
    assert abs(done.end.heading) < math.radians(12)


@pytest.mark.parametrize("angle", [90, -90, 180])
def test_a_turn_ends_where_it_should(world, corridor, drive, robot, angle):
    done = drive(Rotate(math.radians(angle)), world(corridor(1.0), Pose(0, 0, 0.05)), robot=robot)
    assert done.outcome == "done"
    assert abs(math.remainder(done.end.heading - math.radians(angle), math.tau)) < math.radians(2.5)
    assert math.hypot(done.end.x, done.end.y) < 0.06


def test_before_a_turn_it_backs_from_a_wall_ahead(world, corridor, drive, robot):
    done = drive(Rotate(math.pi / 2), world(corridor(1.0, length=0.28)), robot=robot)
    assert done.outcome == "done"
    assert done.end.x < -0.05


def test_a_turn_away_from_a_wall_makes_its_own_room(world, drive):
    done = drive(Rotate(math.pi), world([(-2, -0.27, 2, -0.27)]), robot=BOX, limit=40)
    assert done.outcome == "done"
    assert not done.touched


def test_a_turn_towards_a_wall_that_leaves_its_corners_no_room_is_taken_back(world, drive):
    done = drive(Rotate(-math.pi), world([(-2, -0.27, 2, -0.27)]), robot=BOX, limit=40)
    assert done.outcome == "blocked"
    assert abs(done.end.heading) < 0.1
    assert not done.touched


def test_a_round_robot_turns_wherever_it_stands(world, drive):
    close = world([(-2, -0.22, 2, -0.22), (-2, 0.22, 2, 0.22)])
    done = drive(Rotate(math.pi), close, robot=ROUND)
    assert done.outcome == "done"
    assert done.clearance > 0.018


def test_aligning_turns_only(world, drive, robot):
    done = drive(Align(Side.LEFT), world([(-3, 0.8, 3, 0.8)], Pose(0, 0, math.radians(20))), robot=robot)
    assert done.outcome == "done"
    assert abs(done.end.heading) < math.radians(2)
    assert math.hypot(done.end.x, done.end.y) < 0.03


def test_room_is_made_away_from_a_wall_beside_and_ahead(world, drive, robot):
    beside = drive(MakeRoom(4.0), world([(-2, -0.26, 2, -0.26)]), robot=robot)
    assert not beside.touched
    assert beside.outcome == "done"
    ahead = drive(MakeRoom(4.0), world([(0.3, -2, 0.3, 2)]), robot=robot)
    assert ahead.outcome == "done"
    assert ahead.end.x < -0.04


def test_moving_goes_straight_there_and_stops(world, hall, drive, robot):
    done = drive(Move(1.0), world(hall, Pose(1, 0, 0.5)), robot=robot)
    assert done.outcome == "done"
    assert math.dist((done.end.x, done.end.y), (1 + math.cos(0.5), math.sin(0.5))) < 0.05
    assert done.last == STOP


def test_advancing_goes_the_distance(world, corridor, drive, robot):
    assert drive(Advance(1.0), world(corridor(1.0)), robot=robot).end.x == pytest.approx(1.0, abs=0.15)


def test_the_bell_is_rung_standing_still(world, drive, robot):
    walls = [(-2, 0.5, 3, 0.5), (-2, -0.5, 3, -0.5)]
    done = drive(Ring(), world(walls, Pose(1.0, 0), [MazeDoor("front", ((2, -0.5), (2, 0.5)))]), robot=robot)
    assert done.outcome == "accepted"
    assert [command.twist for command in done.commands if command.ring] == [STOP]


@pytest.mark.parametrize("bearing", [0, 60, -90, 180])
def test_it_drives_to_a_target_in_the_open(world, hall, drive, robot, bearing):
    target = 1.7 * math.cos(math.radians(bearing)), 1.7 * math.sin(math.radians(bearing))
    done = drive(DriveTo(1.7, math.radians(bearing)), world(hall), robot=robot)
    assert done.outcome == "done"
    assert math.dist((done.end.x, done.end.y), target) < 0.09


def test_behind_a_dead_end_it_is_blocked(world, corridor, drive, robot):
    done = drive(DriveTo(3.0), world(corridor(1.0, length=2.0)), limit=40, robot=robot)
    assert done.outcome == "blocked"
    assert not done.touched
    assert done.last == STOP


def driven(law: Steering, robot: RobotDescription, asked, pose: Pose, ticks: int):
    """The poses of a robot that does what a law says, within its limits."""
    twist, period = STOP, robot.period
    for _ in range(ticks):
        twist = robot.towards(twist, robot.limited(asked(law, pose)), period)
        pose = integrate(pose, twist, period)
        yield pose


@pytest.mark.parametrize("robot", [BOX, HOLONOMIC], ids=["two wheels", "holonomic"])
@pytest.mark.parametrize("side", [1, -1])
def test_a_circle_is_followed(robot, side):
    radius = 0.6

    def asked(law, pose):
        x, y = pose.x, pose.y - side * radius
        error = math.remainder(math.atan2(y, x) + side * math.pi / 2 - pose.heading, math.tau)
        return law.follow(OnPath(side * (math.hypot(x, y) - radius), error, side / radius), 0.4)

    poses = list(driven(steering_of(robot, SkillSettings()), robot, asked, Pose(0, 0.1, 0.2), 100))
    assert all(math.hypot(pose.x, pose.y - side * radius) == pytest.approx(radius, abs=0.03) for pose in poses[40:])
    assert sum(math.dist((a.x, a.y), (b.x, b.y)) for a, b in pairwise(poses)) > 3.0


@pytest.mark.parametrize("robot", [BOX, HOLONOMIC], ids=["two wheels", "holonomic"])
def test_a_straight_path_is_followed(robot):
    def asked(law, pose):
        return law.follow(OnPath(-pose.y, -pose.heading), 0.4)

    poses = list(driven(steering_of(robot, SkillSettings()), robot, asked, Pose(0, 0.2, -0.3), 100))
    assert all(abs(pose.y) < 0.03 and abs(pose.heading) < 0.05 for pose in poses if pose.x > 1.5)
    assert poses[-1].x > 3.0


@pytest.mark.parametrize("away", [0.65, 0.7, 0.8])
def test_a_turn_makes_room_beforehand_for_what_comes_on_ahead(world, corridor, drive, away):
    """Also where there was room for the turn when it began."""
    crate = MovingObject("crate", BOX_OF_60_CM, ((away, 0.0), (0.1, 0.0)), speed=0.1, near=5.0)
    done = drive(Rotate(math.pi), world(corridor(1.0), Pose(0, 0), objects=[crate]), limit=15, robot=BOX)
    assert done.outcome == "done"
    assert done.clearance > 0.05
    assert done.end.x < -0.15
    assert len(done.path) < 60  # the turn takes 3.5 s


@pytest.mark.parametrize("aside", [0.23, -0.23])
def test_a_round_robot_keeps_its_margin_while_it_turns_away(world, corridor, drive, aside):
    """What has no corner that swings in needs none of the margin for it."""
    done = drive(Drive(), world(corridor(1.0), Pose(0, aside, math.copysign(0.5, aside))), limit=8, robot=ROUND)
    assert done.end.x > 2.0
    assert done.clearance > 0.05
