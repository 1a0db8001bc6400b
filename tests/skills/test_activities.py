import math

import pytest

from sim.maze import MazeDoor
from skills.activities.advance import Advance
from skills.activities.align import Align
from skills.activities.arc import Arc
from skills.activities.cross_space import CrossSpace
from skills.activities.door import Ring
from skills.activities.drive import Drive
from skills.activities.follow_wall import FollowWall
from skills.activities.make_room import MakeRoom
from skills.activities.move import Move
from skills.activities.pass_corner import PassCorner
from skills.activities.reach_corner import ReachCorner
from skills.activities.rotate import Rotate
from skills.activities.stop import Stop
from skills.frames import Frame
from skills.sides import Side
from transport.description import Laser, Limits, RobotDescription
from transport.messages import STOP, Pose, wrap_angle

SEEDS = (0, 1, 2)


def degrees_between(heading, wanted):
    return math.degrees(abs(wrap_angle(heading - wanted)))


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("width", [0.6, 0.8, 1.0])
def test_driving_leads_to_the_middle_of_a_corridor_and_along_it(world, corridor, drive, width, seed):
    offset = (width - 0.6) / 2 + 0.02
    done = drive(Drive(), world(corridor(width), Pose(0, offset, math.radians(8))), seed, limit=8)
    assert done.end.x > 2.5
    assert abs(done.end.y) < 0.03
    assert degrees_between(done.end.heading, 0) < 2
    assert not done.touched


def test_in_a_wide_space_driving_keeps_its_own_line(world, corridor, drive):
    done = drive(Drive(), world(corridor(2.0), Pose(0, 0.3)), limit=8)
    assert done.end.y == pytest.approx(0.3, abs=0.05)


def test_before_a_wall_driving_stops_and_is_blocked(world, corridor, drive):
    done = drive(Drive(), world(corridor(1.0, length=2.0)))
    assert done.outcome == "blocked"
    assert done.clearance > 0.08
    assert done.last == STOP


@pytest.mark.parametrize("side", list(Side))
@pytest.mark.parametrize("start", [0.35, 0.5, 0.8])
def test_a_wall_is_followed_at_its_distance(world, drive, side, start):
    wall = (-2, 0, 9, 0)
    done = drive(FollowWall(side), world([wall], Pose(0, -side.sign * start)), limit=10)
    assert abs(done.end.y) == pytest.approx(0.5, abs=0.04)
    assert done.end.x > 3.5


def test_where_the_wall_steps_in_the_robot_gives_way(world, drive):
    walls = [(-2, -0.5, 2, -0.5), (2, -0.5, 2, -0.2), (2, -0.2, 8, -0.2), (-2, 0.7, 8, 0.7)]
    done = drive(FollowWall(Side.RIGHT), world(walls), limit=9)
    assert done.end.x > 3.5
    assert done.clearance > 0.1


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("angle", [90, -90, 180, 30])
def test_a_turn_ends_where_it_should(world, corridor, drive, angle, seed):
    start = Pose(0, 0, math.radians(3)) if angle != 30 else Pose()
    done = drive(Rotate(math.radians(angle)), world(corridor(1.0), start), seed)
    assert done.outcome == "done"
    assert degrees_between(done.end.heading, math.radians(angle)) < 2.5
    assert math.hypot(done.end.x, done.end.y) < 0.06


def test_a_turn_too_near_to_a_wall_first_makes_room(world, drive):
    done = drive(Rotate(math.pi), world([(-2, -0.27, 2, -0.27)]))
    assert done.outcome == "done"
    assert done.end.y > 0.05
    assert not done.touched
    assert done.clearance >= 0.06


def test_where_there_is_no_room_a_turn_is_taken_back(world, corridor, drive):
    done = drive(Rotate(math.pi / 2), world(corridor(0.5)), limit=30)
    assert done.outcome == "blocked"
    assert degrees_between(done.end.heading, 0) < 3
    assert not done.touched


@pytest.mark.parametrize("distance", [0.3, 1.0, 2.0])
def test_advancing_goes_the_distance(world, corridor, drive, distance):
    done = drive(Advance(distance), world(corridor(1.0)))
    assert done.outcome == "done"
    assert done.end.x == pytest.approx(distance, abs=0.15)


def test_advancing_against_a_wall_is_blocked(world, corridor, drive):
    assert drive(Advance(3.0), world(corridor(1.0, length=1.5))).outcome == "blocked"


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(("forward", "left"), [(1.0, 0.0), (0.0, 0.6), (0.0, -0.6), (0.7, 0.7), (0.3, -1.0)])
def test_moving_goes_straight_there_and_stops(world, hall, drive, forward, left, seed):  # noqa: PLR0917
    heading = 0.5
    done = drive(Move(forward, left), world(hall, Pose(1, 0, heading)), seed)
    wanted = Frame(Pose(1, 0, heading)).outer(Pose(forward, left))
    assert done.outcome == "done"
    assert math.dist((done.end.x, done.end.y), (wanted.x, wanted.y)) < 0.05
    assert degrees_between(done.end.heading, heading) < 2
    assert done.last == STOP
    way = math.hypot(forward, left)
    for pose in done.path:
        here = Frame(Pose(1, 0, heading)).local(pose)
        assert abs(forward * here.y - left * here.x) / way < 0.04


@pytest.mark.parametrize(("forward", "left"), [(2.0, 0.0), (0.0, 1.0), (0.0, -2.0), (1.0, 1.0)])
def test_moving_into_a_wall_is_blocked(world, block, drive, forward, left):
    done = drive(Move(forward, left), world(block(0, 0, 1.4, 1.4)))
    assert done.outcome == "blocked"
    assert done.clearance > 0.1


def test_moving_slowly_is_not_taken_for_being_blocked(world, hall, drive):
    done = drive(Move(0.3, speed=0.02), world(hall), limit=40)
    assert done.outcome == "done"


WIDENS = [(-2, -0.5, 8, -0.5), (-2, 0.5, 0, 0.5), (0, 0.5, 0, 4), (0, 4, 5, 4), (5, 4, 5, 0.5), (5, 0.5, 8, 0.5)]


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("side", list(Side))
def test_an_open_space_is_crossed_along_the_wall_to_where_a_corridor_begins(world, drive, side, seed):
    walls = [(ax, -side.sign * ay, bx, -side.sign * by) for ax, ay, bx, by in WIDENS]
    done = drive(CrossSpace(side), world(walls, Pose(-1, 0)), seed)
    assert done.outcome == "done"
    assert done.end.x == pytest.approx(4.6, abs=0.2)
    assert abs(done.end.y) < 0.05
    assert done.clearance > 0.25


@pytest.mark.parametrize("seed", SEEDS)
def test_at_the_far_wall_of_an_open_space_it_is_crossed(world, hall, drive, seed):
    done = drive(CrossSpace(Side.RIGHT, distance=0.7), world(hall, Pose(-1, -2.5)), seed)
    assert done.outcome == "done"
    assert done.end.x == pytest.approx(5.5, abs=0.1)
    assert all(pose.y == pytest.approx(-2.3, abs=0.06) for pose in done.path if pose.x > 1)


@pytest.mark.parametrize("side", list(Side))
def test_the_wall_ends_before_the_open_space_is_crossed(world, drive, side):
    y = side.sign * 0.5
    walls = [(-1, y, 2.5, y), (3.5, y, 6, y), (6, -3, 6, 3)]
    done = drive(CrossSpace(side), world(walls))
    assert done.outcome == "lost"
    assert done.end.x == pytest.approx(2.65, abs=0.15)


def test_without_a_wall_there_is_nothing_to_cross_along(world, hall, drive):
    assert drive(CrossSpace(Side.LEFT), world(hall)).outcome == "lost"


def test_following_a_wall_does_not_tell_that_the_space_is_crossed(world, drive):
    assert drive(FollowWall(Side.RIGHT), world(WIDENS, Pose(-1, 0)), limit=14).outcome is None


@pytest.mark.parametrize("side", list(Side))
@pytest.mark.parametrize("opening", [0.7, 1.0, 2.0])
def test_past_a_corner_the_robot_stands_before_the_opening(world, side_exit, drive, side, opening):
    maze = world(side_exit(side.sign, 1.0, opening), Pose(2.05, 0))
    done = drive(PassCorner(side), maze)
    assert done.outcome == "done"
    assert done.end.x - 2 == pytest.approx(min(opening / 2, 0.5), abs=0.06)


@pytest.mark.parametrize("side", list(Side))
def test_a_thin_wall_is_noticed_beside_the_robot(world, drive, side):
    thin = (2, side.sign * 0.4, 2, side.sign * 3)
    done = drive(ReachCorner(side, distance=4.0), world([thin, (-1, -side.sign, 6, -side.sign)]))
    assert done.outcome == "done"
    assert done.end.x == pytest.approx(2, abs=0.2)


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("aside", [0.6, 0.66])
def test_a_sparse_laser_notices_the_end_of_a_thin_wall(world, drive, aside, seed):
    # Few of its beams meet the wall as near as its end is; the others meet it farther on.
    sparse = Laser(beams=180, angle_min=0.0, angle_max=math.radians(358), range_max=3.5)
    robot = RobotDescription(laser=sparse)
    done = drive(ReachCorner(distance=4.0), world([(2, -aside, 2, -3), (-1, aside, 6, aside)]), seed=seed, robot=robot)
    assert done.outcome == "done"
    assert done.end.x == pytest.approx(2, abs=0.25)


@pytest.mark.parametrize("side", list(Side))
def test_a_wall_farther_aside_is_not_the_corner_about_which_the_robot_turned(world, drive, side):
    walls = [(0.3, side.sign * 0.76, 0.3, side.sign * 2), (0.9, side.sign * 0.4, 3, side.sign * 0.4)]
    done = drive(ReachCorner(side), world([*walls, (-1, -side.sign, 6, -side.sign)]))
    assert done.outcome == "done"
    assert done.end.x == pytest.approx(0.9, abs=0.2)


def test_a_corner_that_is_not_there_is_given_up(world, drive):
    done = drive(ReachCorner(Side.RIGHT, distance=1.0), world([(-1, 2, 6, 2)]))
    assert done.outcome == "done"
    assert done.end.x == pytest.approx(1.0, abs=0.2)


@pytest.mark.parametrize("side", list(Side))
@pytest.mark.parametrize(
    ("width", "start"), [(0.8, 1.2), (0.8, 2.05), (1.0, 1.8), (1.0, 2.05), (1.4, 1.2), (1.4, 2.05)]
)
def test_an_arc_ends_in_the_middle_of_the_opening(world, side_exit, drive, side, width, start):  # noqa: PLR0917
    done = drive(Arc(side), world(side_exit(side.sign, width, width), Pose(start, 0)))
    assert done.outcome == "done"
    assert degrees_between(done.end.heading, side.sign * math.pi / 2) < 6
    assert done.end.x - 2 == pytest.approx(min(width / 2, 0.5), abs=0.1)
    assert done.clearance > 0.1


def test_an_arc_is_driven_without_a_stop(world, side_exit, drive):
    done = drive(Arc(Side.RIGHT), world(side_exit(-1, 1.0, 1.0), Pose(1.5, 0)))
    speeds = [command.twist.speed for command in done.commands[5:-5]]
    assert min(speeds) > 0.15


@pytest.mark.parametrize("side", list(Side))
def test_aligning_turns_along_the_wall_and_keeps_its_distance(world, drive, side):
    wall = (-3, side.sign * 0.8, 3, side.sign * 0.8)
    done = drive(Align(side), world([wall], Pose(0, 0, math.radians(20))))
    assert done.outcome == "done"
    assert degrees_between(done.end.heading, 0) < 2
    assert abs(done.end.y) == pytest.approx(0.3, abs=0.07)


def test_there_is_nothing_to_align_to_where_there_is_no_wall(world, drive):
    assert drive(Align(Side.RIGHT), world([(-3, 2.5, 3, 2.5)])).outcome == "blocked"


def test_the_bell_is_rung_once_and_standing_still(world, corridor, drive):
    door = MazeDoor("front", ((2, -0.5), (2, 0.5)))
    walls = [(-2, 0.5, 3, 0.5), (-2, -0.5, 3, -0.5)]
    done = drive(Ring(), world(walls, Pose(1.0, 0), [door]))
    assert done.outcome == "accepted"
    assert [command.twist for command in done.commands if command.ring] == [STOP]


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("end", [-0.24, -0.3])
def test_the_bell_is_rung_standing_still_where_something_is_too_near(world, drive, seed, end):
    """The guard would have the robot move off the end of the wall, and a door opens for no robot that moves."""
    door = MazeDoor("front", ((2, -0.5), (2, 0.5)))
    walls = [(-2, 0.5, 3, 0.5), (-2, -0.5, 3, -0.5), (0.95, -0.5, 0.95, end)]
    done = drive(Ring(), world(walls, Pose(1.0, 0), [door]), seed)
    assert done.outcome == "accepted"
    assert [command.twist for command in done.commands if command.ring] == [STOP]


def test_where_there_is_no_door_the_ring_is_refused(world, corridor, drive):
    assert drive(Ring(), world(corridor(1.0, length=1.0))).outcome == "refused"


def test_standing_still_is_still(world, corridor, drive):
    done = drive(Stop(), world(corridor(1.0)), limit=3)
    assert done.path[0] == done.end


def test_room_is_made_away_from_a_wall(world, drive):
    done = drive(MakeRoom(), world([(-2, -0.25, 2, -0.25)]))
    assert done.outcome == "done"
    assert done.end.y > 0.1


@pytest.mark.parametrize("seed", SEEDS)
def test_no_command_breaks_the_limits(world, corridor, drive, seed):
    limits = Limits()
    done = drive(Drive(speed=5.0), world(corridor(1.0), Pose(0, 0.1, 0.3)), seed, limit=6)
    before = STOP
    for command in done.commands:
        twist = command.twist
        assert twist.speed <= limits.speed + 1e-9
        assert abs(twist.turn) <= limits.turn_rate + 1e-9
        change = math.hypot(twist.forward - before.forward, twist.left - before.left)
        assert change <= limits.acceleration * 0.1 + 1e-9
        before = twist


@pytest.mark.parametrize("y", [1.75, 1.8, 1.85, 1.9])
def test_a_turn_into_a_way_stays_before_it(world, drive, y):
    """What lies aside of the robot is the way that it turns into, not the passage whose middle gives room."""
    walls = [
        (2.19, 0, 2.19, 2.2), (2.19, 2.2, 2.91, 2.2), (0.72, 1.46, 1.46, 1.46), (1.46, 1.46, 1.46, 0.73),
        (0.72, 1.46, 0.73, 2.92), (0.73, 2.92, 1.47, 2.92), (2.19, 2.91, 2.91, 2.91), (2.91, 2.2, 2.91, 2.91),
    ]  # fmt: skip
    done = drive(Rotate(-math.pi / 2), world(walls, Pose(1.8, y, 0.0)))
    assert done.outcome == "done"
    assert math.hypot(done.end.x - 1.8, done.end.y - y) < 0.2
