"""The challenge's rules, each with a robot that keeps and one that breaks them."""

import math
from dataclasses import replace

import numpy as np
import pytest

from sim.faults import DoorStuck
from sim.maze import Maze, MazeDoor, Start
from sim.referee import AttemptOutcome
from sim.robot import SimulatedRobot
from sim.settings import Rules, SimulatorSettings
from transport.messages import Command, Pose, Twist

RING = Command(ring=True)


def corridor(*, length=6.0, door=None, time_limit=420.0, start=1.0):
    """A corridor along x, one metre wide, with its exit at the far end and perhaps a door across it at some x."""
    walls = np.array([[0, 0, length, 0], [0, 0, 0, 1], [0, 1, length, 1]], dtype=float)
    doors = () if door is None else (MazeDoor("front", ((door, 0.0), (door, 1.0))),)
    exits = np.array([[length, 1.0, length, 0.0]])
    return Maze("corridor", walls, Start(Pose(start, 0.5, 0.0)), exits[:, [2, 3, 0, 1]], doors, time_limit=time_limit)


def drive(robot, twist, ticks):
    for _ in range(ticks):
        if robot.finished:
            return
        robot.command(Command(twist))


AHEAD = Twist(0.5, 0.0, 0.0)


def outward(maze):
    """The same maze with its exit the other way round."""
    return replace(maze, exits=maze.exits[:, [2, 3, 0, 1]])


def test_the_whole_robot_must_be_across_the_exit():
    maze = corridor(length=3.0)
    maze = maze if _left_is_outside(maze) else outward(maze)
    robot = SimulatedRobot(maze)
    while not robot.finished:
        assert robot.truth.x < 3.3
        robot.command(Command(AHEAD))
    # Its rear is 0.1 m behind its origin.
    assert robot.verdict.outcome is AttemptOutcome.ESCAPED
    assert 3.1 < robot.truth.x <= 3.1 + 0.05 + 1e-9
    assert robot.verdict.escaped
    assert robot.verdict.line().startswith("escaped after 4.")


def _left_is_outside(maze):
    ax, ay, bx, by = maze.exits[0]
    return (bx - ax) * (0.5 - ay) - (by - ay) * (maze.walls[:, [0, 2]].max() + 1 - ax) > 0


def test_going_out_through_an_exit_and_in_again_is_no_escape():
    maze = corridor(length=3.0)
    maze = maze if _left_is_outside(maze) else outward(maze)
    robot = SimulatedRobot(maze)
    drive(robot, AHEAD, 42)
    assert 3.0 < robot.truth.x < 3.1
    drive(robot, Twist(-0.5, 0.0, 0.0), 20)
    assert robot.verdict.outcome is AttemptOutcome.RUNNING


def test_path_length_time_and_clearance_are_measured():
    robot = SimulatedRobot(corridor())
    drive(robot, Twist(0.25, 0.05, 0.0), 40)
    verdict = robot.verdict
    assert verdict.time == pytest.approx(4.0)
    travelled = robot.truth.x - 1.0, robot.truth.y - 0.5
    assert verdict.path_length == pytest.approx(math.hypot(*travelled), abs=1e-9)
    # Its side is 0.2 m beside its origin; the nearest wall is the left one.
    assert verdict.clearance == pytest.approx(1.0 - robot.truth.y - 0.2, abs=1e-9)


def test_a_touched_wall_fails_the_attempt_with_place_and_speed():
    robot = SimulatedRobot(corridor())
    drive(robot, Twist(0.0, -0.3, 0.0), 30)
    assert robot.verdict.outcome is AttemptOutcome.TOUCHED
    assert robot.verdict.clearance == 0.0
    (contact,) = robot.verdict.contacts
    assert contact.place[1] == pytest.approx(0.0, abs=5e-3)
    assert contact.speed == pytest.approx(0.3, abs=1e-6)
    assert "touched wall at" in robot.verdict.line()


def test_a_touched_wall_does_not_fail_where_the_rules_allow_it():
    robot = SimulatedRobot(corridor(), settings=SimulatorSettings(rules=Rules(contact_fails=False)))
    drive(robot, Twist(0.0, -0.3, 0.0), 30)
    assert robot.verdict.outcome is AttemptOutcome.RUNNING
    assert len(robot.verdict.contacts) == 1


@pytest.mark.parametrize("sway", [Twist(), Twist(0.0, 0.0, 1e-4)])
def test_thirty_seconds_of_standing_still_fail_the_attempt(sway):
    robot = SimulatedRobot(corridor())
    drive(robot, AHEAD, 10)
    while not robot.finished:
        robot.command(Command(sway))
    assert robot.verdict.outcome is AttemptOutcome.STOOD_STILL
    # It rolls on a little after the first second.
    assert 31.0 <= robot.verdict.time <= 31.5


def test_turning_on_the_spot_is_not_standing_still():
    robot = SimulatedRobot(corridor())
    drive(robot, Twist(0.0, 0.0, 0.5), 400)
    assert robot.verdict.outcome is AttemptOutcome.RUNNING


def test_time_runs_out():
    robot = SimulatedRobot(corridor(time_limit=20.0))
    drive(robot, Twist(0.0, 0.0, 0.5), 1000)
    assert robot.verdict.outcome is AttemptOutcome.OUT_OF_TIME
    assert robot.verdict.time == pytest.approx(20.0)


@pytest.mark.parametrize(
    ("distance", "command", "opens"),
    [
        (1.0, RING, True),
        (1.19, RING, True),  # its rear corners are 0.1 m farther: 1.29 m
        (1.21, RING, False),
        (1.0, Command(Twist(0.01, 0.0, 0.0), ring=True), False),
        (1.0, Command(Twist(0.0, 0.0, 0.01), ring=True), False),
        (1.0, Command(), False),
    ],
)
def test_the_door_has_three_conditions(distance, command, opens):
    robot = SimulatedRobot(corridor(door=4.0, start=4.0 - distance))
    robot.command(command)
    reply = robot.observe().door
    assert (reply is not None and reply.accepted) == opens
    if command.ring and not opens:
        assert reply.reason
    for _ in range(49):
        robot.command(Command())
    assert robot.verdict.doors_opened == (("front",) if opens else ())
    assert robot.verdict.rings == int(command.ring)


@pytest.mark.parametrize(("distance", "opens"), [(0.99, True), (1.01, False)])
def test_the_lax_door_opens_within_a_metre_even_while_driving(distance, opens):
    lax = SimulatorSettings(rules=Rules(lax_door=True))
    robot = SimulatedRobot(corridor(door=4.0, start=4.0 - distance), settings=lax)
    robot.command(Command(Twist(0.0, 0.0, 0.3), ring=True))
    assert robot.observe().door.accepted == opens


def test_a_ring_where_there_is_no_door_is_told_so():
    robot = SimulatedRobot(corridor())
    robot.command(RING)
    assert "no door" in robot.observe().door.reason


def test_the_way_through_a_door_is_open_within_five_seconds_and_shut_before():
    maze = corridor(door=2.0, length=3.0)
    maze = maze if _left_is_outside(maze) else outward(maze)
    robot = SimulatedRobot(maze)
    centre = 500
    assert robot.observe().scan.ranges[centre] == pytest.approx(1.0, abs=0.02)
    robot.command(RING)
    for _ in range(49):
        robot.command(Command())
    assert math.isinf(robot.observe().scan.ranges[centre])
    drive(robot, AHEAD, 100)
    assert robot.verdict.escaped
    assert robot.verdict.doors_opened == ("front",)


def test_there_are_two_attempts_within_the_time_limit():
    robot = SimulatedRobot(corridor(door=4.0, start=3.0, time_limit=60.0))
    simulation = robot.simulation
    assert not simulation.try_again()  # the first is still running
    robot.command(RING)
    drive(robot, Twist(0.0, 0.5, 0.0), 30)
    assert robot.verdict.outcome is AttemptOutcome.TOUCHED
    assert simulation.try_again()
    assert (robot.truth.x, robot.truth.y) == (3.0, 0.5)
    assert robot.verdict.outcome is AttemptOutcome.RUNNING
    assert robot.verdict.attempt == 2
    assert simulation.world.doors[0].shift == 0.0
    began = simulation.time
    drive(robot, Twist(0.0, 0.0, 0.4), 1000)
    assert robot.verdict.outcome is AttemptOutcome.OUT_OF_TIME
    assert robot.verdict.time == pytest.approx(60.0 - began)
    assert not simulation.try_again()
    assert [verdict.outcome for verdict in simulation.verdicts()] == [
        AttemptOutcome.TOUCHED,
        AttemptOutcome.OUT_OF_TIME,
    ]


def test_there_is_no_second_attempt_after_a_success():
    maze = corridor(length=3.0)
    robot = SimulatedRobot(maze if _left_is_outside(maze) else outward(maze))
    drive(robot, AHEAD, 100)
    assert robot.verdict.escaped
    assert not robot.simulation.try_again()


def test_a_third_attempt_is_not_given():
    robot = SimulatedRobot(corridor())
    for attempt, granted in ((1, True), (2, False)):
        drive(robot, Twist(0.0, 0.5, 0.0), 30)
        assert robot.verdict.attempt == attempt
        assert robot.simulation.try_again() == granted


def test_a_door_that_stays_shut_is_not_counted_as_opened():
    settings = SimulatorSettings(faults=(DoorStuck(door="front"),))
    robot = SimulatedRobot(corridor(door=4.0, start=3.0), settings=settings)
    robot.command(RING)
    assert robot.observe().door.accepted
    for _ in range(60):
        robot.command(Command())
    assert robot.verdict.doors_opened == ()
    assert robot.observe().scan.ranges[500] == pytest.approx(1.0, abs=0.02)


def test_the_verdict_stays_as_it_was_at_the_end():
    robot = SimulatedRobot(corridor())
    drive(robot, Twist(0.0, 0.5, 0.0), 30)
    verdict = robot.verdict
    for _ in range(20):
        robot.command(Command(AHEAD))
    assert robot.verdict == verdict
