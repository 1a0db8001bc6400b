"""The simulated robot: lockstep, determinism, contact, noise."""

import math

import numpy as np
import pytest

from sim.referee import AttemptOutcome
from sim.robot import SimulatedRobot
from sim.settings import IDEAL
from transport.description import Limits, RobotDescription
from transport.messages import Command, Pose, Twist


def trace(robot, twists):
    seen = []
    for twist in twists:
        observation = robot.observe()
        seen.append((observation.stamp, observation.scan.ranges.tobytes(), observation.odometry))
        robot.command(Command(twist))
    return seen


def test_observation_k_has_the_stamp_of_k_periods(final):
    robot = SimulatedRobot(final)
    stamps = [stamp for stamp, _, _ in trace(robot, [Twist()] * 5)]
    assert stamps == [0, 100_000_000, 200_000_000, 300_000_000, 400_000_000]


def test_one_seed_one_run_and_another_seed_another_run(final):
    twists = [Twist(0.1 * math.sin(k), 0.02, 0.3) for k in range(60)]
    first, again, other = (trace(SimulatedRobot(final, seed=seed), twists) for seed in (4, 4, 5))
    assert first == again
    assert first != other


def test_reset_restores_everything(final):
    robot = SimulatedRobot(final, seed=9)
    twists = [Twist(0.2, 0.0, 0.5)] * 50
    first = trace(robot, twists)
    robot.simulation.reset()
    assert trace(robot, twists) == first


def test_a_constant_twist_follows_its_arc_exactly(final):
    swift = RobotDescription(limits=Limits(acceleration=1e6, turn_acceleration=1e6))
    robot = SimulatedRobot(final, swift, settings=IDEAL)
    speed, turn = 0.1, -1.0
    start = robot.truth
    for _ in range(15):
        robot.command(Command(Twist(speed, 0.0, turn)))
    angle = turn * 1.5
    radius = speed / turn
    expected = Pose(
        start.x + radius * (math.sin(start.heading + angle) - math.sin(start.heading)),
        start.y - radius * (math.cos(start.heading + angle) - math.cos(start.heading)),
        start.heading + angle,
    )
    assert (robot.truth.x, robot.truth.y, robot.truth.heading) == pytest.approx(
        (expected.x, expected.y, expected.heading), abs=1e-9
    )


def test_a_wall_stops_the_robot_and_the_referee_sees_it(final):
    robot = SimulatedRobot(final)
    for _ in range(60):
        robot.command(Command(Twist(0.0, 0.5, 0.0)))
    assert robot.verdict.outcome is AttemptOutcome.TOUCHED
    assert not robot.verdict.escaped
    (contact, *_) = robot.verdict.contacts
    assert contact.other == "wall"
    assert contact.speed == pytest.approx(0.5, abs=0.06)
    # The left end of its footprint, 0.2 m from its origin, stays at the wall.
    assert robot.truth.x == pytest.approx(1.0 + 0.2, abs=2e-3)


def test_noise_is_within_a_centimetre_and_uses_all_of_it(final):
    noisy, ideal = SimulatedRobot(final, seed=3), SimulatedRobot(final, seed=3, settings=IDEAL)
    error = noisy.observe().scan.ranges.astype(float) - ideal.observe().scan.ranges
    assert noisy.observe().scan.ranges.dtype == np.float32
    assert np.abs(error).max() <= 0.01 + 1e-6
    assert np.abs(error).max() > 0.0095
    assert abs(error.mean()) < 0.001
