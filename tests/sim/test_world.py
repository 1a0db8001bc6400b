"""Doors, objects and other robots: they block laser and robot alike."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim.geometry import edges, outline_distance, placed
from sim.maze import Maze, MazeDoor, MovingObject, Start
from sim.odometry import displacement
from sim.robot import SimulatedRobot
from sim.settings import IDEAL, Rules, SimulatorSettings
from sim.simulation import Simulation
from sim.world import SLOP
from transport.description import PICO_FOOTPRINT, Laser, Limits, RobotDescription
from transport.messages import Command, Pose, Twist

SETTINGS = IDEAL.model_copy(update={"rules": Rules(contact_fails=False)})
ROOM = np.array([[0, 0, 8, 0], [8, 0, 8, 8], [8, 8, 0, 8], [0, 8, 0, 0]], dtype=float)
AHEAD = 500


def room(*, doors=(), objects=(), walls=ROOM, start=Pose(1.0, 4.0, 0.0)):  # noqa: B008 - a frozen value
    exits = np.array([[20.0, 0.0, 20.0, 1.0]])
    return Maze("room", walls, Start(start), exits, doors, objects, time_limit=math.inf)


def ahead(robot):
    return float(robot.observe().scan.ranges[AHEAD])


def test_a_door_slides_at_its_speed_by_its_length_and_may_close_again():
    door = MazeDoor("gate", ((2.0, 3.5), (2.0, 4.5)), speed=0.25, stays=3.0)
    robot = SimulatedRobot(room(doors=(door,)), settings=SETTINGS)
    robot.command(Command(ring=True))
    shifts = []
    for _ in range(150):
        shifts.append(robot.simulation.world.doors[0].shift)
        robot.command(Command())
    assert shifts[0] == pytest.approx(0.025)
    assert np.diff(shifts[:39]) == pytest.approx(0.025)
    assert max(shifts) == 1.0
    assert shifts.count(1.0) == pytest.approx(30, abs=1)
    assert shifts[-1] == 0.0
    assert robot.simulation.world.doors[0].leaf().tolist() == [[2.0, 3.5, 2.0, 4.5]]


def test_the_laser_and_the_physics_agree_about_a_door_for_ten_minutes():
    door = MazeDoor("gate", ((2.0, 3.5), (2.0, 4.5)), speed=0.27, stays=3.0)
    simulation = Simulation(room(doors=(door,)), settings=SETTINGS)
    world = simulation.world
    for tick in range(6000):
        if tick % 130 == 0:
            world.doors[0].ask()
        world.carry({"pico": Twist()}, 10)
    leaf = world._leaves[0]
    assert leaf.position.y == pytest.approx(world.doors[0].shift, abs=1e-9)


def test_an_open_door_waits_for_whoever_stands_in_the_doorway():
    door = MazeDoor("gate", ((2.0, 3.5), (2.0, 4.5)), speed=1.0, stays=2.0)
    robot = SimulatedRobot(room(doors=(door,)), settings=SETTINGS)
    robot.command(Command(ring=True))
    for _ in range(10):
        robot.command(Command())
    for _ in range(22):
        robot.command(Command(Twist(0.5, 0.0, 0.0)))
    for _ in range(100):
        robot.command(Command())
    assert robot.truth.x == pytest.approx(2.0, abs=0.2)
    assert robot.simulation.world.doors[0].shift == 1.0
    assert robot.verdict.contacts == ()


def test_a_shut_door_stops_the_robot():
    door = MazeDoor("gate", ((2.0, 3.5), (2.0, 4.5)))
    robot = SimulatedRobot(room(doors=(door,)), settings=SETTINGS)
    for _ in range(60):
        robot.command(Command(Twist(0.5, 0.0, 0.0)))
    assert robot.truth.x == pytest.approx(1.9, abs=2e-3)
    assert [contact.other for contact in robot.verdict.contacts] == ["gate"]


BOX = ((0.2, -0.3), (0.2, 0.3), (-0.2, 0.3), (-0.2, -0.3))


def test_an_object_goes_along_its_path_and_comes_back():
    cart = MovingObject("cart", BOX, ((4.0, 4.0), (6.0, 4.0), (6.0, 5.0)), speed=0.5, returns=True)
    robot = SimulatedRobot(room(objects=(cart,)), settings=SETTINGS)
    seen = []
    for _ in range(121):
        seen.append(robot.simulation.world.objects[0].place)
        robot.command(Command())
    assert seen[20] == pytest.approx((5.0, 4.0), abs=1e-9)
    assert seen[40] == pytest.approx((6.0, 4.0), abs=1e-9)
    assert seen[60] == pytest.approx((6.0, 5.0), abs=1e-9)
    assert seen[120] == pytest.approx((4.0, 4.0), abs=1e-9)


def test_the_laser_sees_an_object_where_it_is():
    cart = MovingObject("cart", BOX, ((4.0, 4.0), (6.0, 4.0)), speed=0.5)
    robot = SimulatedRobot(room(objects=(cart,)), settings=SETTINGS)
    for tick in range(50):
        assert ahead(robot) == pytest.approx(2.8 + min(0.05 * tick, 2.0), abs=1e-5)
        robot.command(Command())


def test_an_object_waits_until_a_robot_comes_near():
    cart = MovingObject("cart", BOX, ((4.0, 4.0), (4.0, 6.0)), speed=0.5, near=2.0)
    robot = SimulatedRobot(room(objects=(cart,)), settings=SETTINGS)
    for _ in range(20):
        robot.command(Command())
    assert robot.simulation.world.objects[0].place == (4.0, 4.0)
    for _ in range(30):
        robot.command(Command(Twist(0.5, 0.0, 0.0)))
    assert robot.simulation.world.objects[0].place[1] > 4.1


def test_an_object_pushes_against_the_robot_and_is_reported():
    cart = MovingObject("cart", BOX, ((2.5, 4.0), (1.2, 4.0)), speed=0.3)
    robot = SimulatedRobot(room(objects=(cart,)), settings=SETTINGS)
    for _ in range(60):
        robot.command(Command())
    (contact, *_) = robot.verdict.contacts
    assert contact.other == "cart"
    assert contact.speed == pytest.approx(0.3, abs=1e-6)
    # It has pushed the robot back; its near side has come to 1.0.
    assert robot.truth.x == pytest.approx(0.9, abs=0.01)


def two_robots(**options):
    names = [RobotDescription(name=name) for name in ("one", "two")]
    maze = replace(room(start=Pose(1.0, 4.0, 0.0)), others=(Start(Pose(4.0, 4.0, math.pi)),))
    return Simulation(maze, names, settings=SETTINGS, **options)


def test_robots_see_and_stop_each_other():
    simulation = two_robots()
    assert simulation.names == ("one", "two")
    # From the other's front, which is set back to 0.05 m between its arms.
    assert simulation.observations["one"].scan.ranges[AHEAD] == pytest.approx(3.0 - 0.05, abs=1e-5)
    for _ in range(100):
        simulation.step({"one": Command(Twist(0.3, 0.0, 0.0))})
    assert {contact.other for contact in simulation.verdict("one").contacts} == {"two"}
    assert {contact.other for contact in simulation.verdict("two").contacts} == {"one"}
    one, two = simulation.truth("one"), simulation.truth("two")
    assert two.x - one.x == pytest.approx(0.2, abs=0.02)


def test_robots_need_different_names_and_one_period():
    pico = RobotDescription()
    with pytest.raises(ValueError, match="names"):
        Simulation(room(), [pico, pico])
    with pytest.raises(ValueError, match="period"):
        Simulation(room(), [pico, RobotDescription(name="slow", period=0.2)])
    with pytest.raises(ValueError, match="starts"):
        Simulation(room(), [pico, RobotDescription(name="second")])


@given(
    heading=st.floats(-math.pi, math.pi),
    direction=st.floats(-math.pi, math.pi),
    turn=st.floats(-1.2, 1.2),
    speed=st.floats(0.1, 0.5),
)
def test_no_robot_gets_through_a_wall(heading, direction, turn, speed):
    """Whatever it is told to do in a small closed room, its outline stays inside to within the solver's slop."""
    walls = np.array([[0, 0, 1, 0.02], [1, 0.02, 0.98, 1], [0.98, 1, 0.01, 1.01], [0.01, 1.01, 0, 0]])
    robot = SimulatedRobot(room(walls=walls, start=Pose(0.5, 0.5, heading)), settings=SETTINGS)
    twist = Twist(speed * math.cos(direction), speed * math.sin(direction), turn)
    for _ in range(60):
        robot.command(Command(twist))
    corners = placed(np.asarray(PICO_FOOTPRINT), robot.truth)
    assert corners.min() > -0.02
    assert corners.max() < 1.03
    # On a small circle it touches nothing.
    assert robot.verdict.contacts or speed < 0.35 * abs(turn)


def test_a_wall_holds_to_within_the_solvers_slop():
    robot = SimulatedRobot(room(), settings=SETTINGS)
    for _ in range(200):
        robot.command(Command(Twist(-0.5, 0.0, 0.0)))
    assert robot.truth.x == pytest.approx(0.1, abs=2 * SLOP)


def test_a_robot_slides_along_a_wall_that_it_drives_into_at_an_angle():
    robot = SimulatedRobot(room(start=Pose(1.0, 0.3, 0.0)), settings=SETTINGS)
    for _ in range(50):
        robot.command(Command(Twist(0.3, -0.2, 0.0)))
    assert robot.truth.x > 2.0
    assert robot.truth.y == pytest.approx(0.2, abs=5e-3)


@pytest.mark.parametrize(
    ("translation", "command", "expected"),
    [
        ("norm", Twist(3.0, 4.0, 0.0), (0.3, 0.4)),
        ("axis", Twist(3.0, 4.0, 0.0), (0.5, 0.5)),
        ("axis", Twist(-3.0, 0.2, 0.0), (-0.5, 0.2)),
    ],
)
def test_speeds_are_limited_by_norm_or_by_axis(translation, command, expected):
    robot = RobotDescription(limits=Limits(translation=translation))
    simulation = Simulation(room(start=Pose(4.0, 4.0, 0.0)), robot, settings=SETTINGS)
    for _ in range(20):
        simulation.step(Command(command))
    before = simulation.truth()
    simulation.step(Command(command))
    after = simulation.truth()
    assert (after.x - before.x, after.y - before.y) == pytest.approx((expected[0] * 0.1, expected[1] * 0.1))


TWO_WHEELS = {"base": {"kind": "differential", "track": 0.3, "wheel_speed": 0.4}}


def test_a_base_on_two_wheels_does_not_move_sideways():
    simulation = Simulation(
        room(start=Pose(4.0, 4.0, 0.7)), RobotDescription.model_validate(TWO_WHEELS), settings=IDEAL
    )
    for turn in (0.0, 0.4, -1.0):
        for _ in range(10):
            before = simulation.truth()
            simulation.step(Command(Twist(0.2, 0.5, turn)))
            moved = displacement(before, simulation.truth())
            # Within a tick the circle changes, so the chord is not quite along the middle heading.
            assert moved.left == pytest.approx(0.0, abs=2e-4)
            assert simulation.observation.odometry.twist.left == 0.0
    assert math.dist((simulation.truth().x, simulation.truth().y), (4.0, 4.0)) > 0.3


sizes = st.floats(0.1, 0.6)
velocities = st.floats(-3.0, 3.0)


@settings(max_examples=25, deadline=None, derandomize=True)
@given(sizes, sizes, sizes, st.lists(st.builds(Twist, velocities, velocities, velocities), min_size=1, max_size=5))
def test_no_base_on_two_wheels_moves_sideways_whatever_it_is_sent(track, speed, half, twists):
    base = {"kind": "differential", "track": track, "wheel_speed": speed}
    footprint = ((half, half), (-half, half), (-half, -half), (half, -half))
    robot = RobotDescription.model_validate({"base": base, "footprint": footprint})
    simulation = Simulation(room(start=Pose(4.0, 4.0, 0.7)), robot, settings=SimulatorSettings())
    for twist in twists:
        simulation.step(Command(twist))
        assert simulation.observation.odometry.twist.left == 0.0


@pytest.mark.parametrize("wanted", [Twist(0.5, 0.0, 1.0), Twist(0.0, 0.0, 5.0), Twist(-0.5, 0.0, 0.3)])
def test_no_wheel_is_faster_than_it_can_be_and_the_robot_stays_on_its_circle(wanted):
    robot = RobotDescription.model_validate(TWO_WHEELS | {"limits": {"turn_rate": 5.0}})
    simulation = Simulation(room(start=Pose(4.0, 4.0, 0.0)), robot, settings=IDEAL)
    for _ in range(20):
        simulation.step(Command(wanted))
        twist = simulation.observation.odometry.twist
        assert max(abs(twist.forward - 0.15 * twist.turn), abs(twist.forward + 0.15 * twist.turn)) <= 0.4 + 1e-6
    assert twist.forward * wanted.turn == pytest.approx(twist.turn * wanted.forward, abs=1e-4)
    assert abs(twist.forward) + 0.15 * abs(twist.turn) == pytest.approx(0.4, abs=1e-4)


def test_the_base_gets_to_its_speed_within_its_acceleration():
    limits = Limits(acceleration=0.5, turn_acceleration=1.0)
    simulation = Simulation(room(), RobotDescription(limits=limits), settings=SETTINGS)
    xs = []
    for _ in range(20):
        xs.append(simulation.truth().x)
        simulation.step(Command(Twist(0.5, 0.0, 0.0)))
    speeds = np.diff(xs) / 0.1
    assert np.diff(speeds[:9]) == pytest.approx(0.05, abs=1e-9)
    assert speeds[-1] == pytest.approx(0.5)


def test_turning_obeys_its_limits_too():
    simulation = Simulation(room(start=Pose(4.0, 4.0, 0.0)), settings=SETTINGS)
    for _ in range(10):
        simulation.step(Command(Twist(0.0, 0.0, 9.0)))
    # 1.2 rad/s, reached with 6 rad/s^2 after 0.2 s.
    assert simulation.truth().heading == pytest.approx(1.2 * 1.0 - 1.2 * 0.2 / 2, abs=0.02)


def test_the_laser_mount_is_honoured():
    laser = Laser(mount_x=0.15, mount_y=0.1, mount_heading=math.pi / 2)
    simulation = Simulation(room(), RobotDescription(laser=laser), settings=SETTINGS)
    assert simulation.observation.scan.ranges[AHEAD] == pytest.approx(8.0 - 4.1, abs=0.01)


def test_distances_to_an_outline_are_exact():
    square = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
    assert outline_distance(square, np.array([[2.0, -5.0, 2.0, 5.0]])) == 1.0
    assert outline_distance(square, np.array([[2.0, 2.0, 3.0, 3.0]])) == pytest.approx(math.sqrt(2))
    assert outline_distance(square, np.empty((0, 4))) == math.inf
    assert len(edges(square)) == 4


def test_settings_refuse_what_they_do_not_know():
    with pytest.raises(ValueError, match="extra"):
        SimulatorSettings.model_validate({"nois": {}})
