"""What is sent where the robot's senses fail."""

import math
from dataclasses import replace

import pytest

from perception import Perception
from sim.faults import LaserBlinded
from sim.settings import SimulatorSettings
from sim.simulation import Simulation
from skills.activities.drive import Drive
from skills.chain import MotionChain
from skills.settings import SkillSettings
from transport.description import Limits, RobotDescription
from transport.messages import STOP, Command, Twist

ROBOT = RobotDescription()


def driven(maze, faults=(), ticks=70):
    """A simulation in which the robot has driven towards the end of a corridor for a while."""
    simulation = Simulation(maze, ROBOT, 0, SimulatorSettings(faults=faults))
    perception, chain, activity = Perception(ROBOT), MotionChain(ROBOT, SkillSettings()), Drive()
    for _ in range(ticks):
        facts = perception.facts(simulation.observation)
        twist = chain.shape(activity.tick(facts), facts).twist
        simulation.step(Command(twist, answers=simulation.observation.stamp))
    return simulation


def test_a_robot_that_sees_nothing_stops(world, corridor):
    end = 3.0
    maze = world(corridor(1.0, length=end))
    blinded = driven(maze, faults=(LaserBlinded(at=3.0, lasts=1.5),), ticks=44)
    assert blinded.verdict().contacts == ()
    assert 1.0 < blinded.truth().x < 1.6
    again = driven(maze, faults=(LaserBlinded(at=3.0, lasts=1.5),), ticks=75)
    assert again.truth().x > 2.0


@pytest.mark.parametrize(("speed", "acceleration"), [(4.0, 1.5), (0.5, 0.05), (3.0, 0.8)])
def test_a_robot_that_needs_long_to_stop_looks_that_far(world, corridor, speed, acceleration):
    robot = RobotDescription(limits=Limits(speed=speed, acceleration=acceleration))
    simulation = Simulation(world(corridor(1.0, length=12.0)), robot, 0)
    perception, chain, before = Perception(robot), MotionChain(robot, SkillSettings()), STOP
    for _ in range(400):
        facts = perception.facts(simulation.observation)
        before = chain.shape(Command(Twist(speed)), facts).twist
        simulation.step(Command(before, answers=simulation.observation.stamp))
    assert simulation.verdict().contacts == ()
    assert before.speed < 0.01
    assert simulation.truth().x > 11.0


def test_a_robot_that_does_not_know_where_it_is_stops(world, corridor):
    simulation = Simulation(world(corridor(1.0)), ROBOT, 0)
    perception, chain, activity = Perception(ROBOT), MotionChain(ROBOT, SkillSettings()), Drive()
    sent = []
    for tick in range(20):
        observation = simulation.observation
        if tick >= 10:
            observation = replace(observation, odometry=replace(observation.odometry, x=math.nan, qz=math.nan))
        facts = perception.facts(observation)
        sent.append(chain.shape(activity.tick(facts), facts).twist)
        simulation.step(Command(sent[-1], answers=observation.stamp))
    assert sent[9].speed > 0.4
    assert sent[14:] == [STOP] * 6
