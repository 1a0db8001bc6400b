"""Robots of other sizes: one scaled with its maze goes through the same states, and the profiled ones solve theirs."""

import math
from dataclasses import replace
from itertools import groupby, product

import pytest

from maze_machine.catalogue.profile import Profile, load_profile, shipped_profiles
from maze_machine.drive.mission import drive, prepare
from maze_machine.simulated.world import SimulatedWorld, find_maze
from sim.generate import Recipe, generate
from sim.scaled import scaled
from sim.settings import IDEAL
from transport.description import RobotDescription, fitted
from transport.world import LockstepRobot


def of_size(size):
    """PICO in another size, and as much faster."""
    pico = RobotDescription()
    limits = pico.limits.model_copy(
        update={"speed": size * pico.limits.speed, "acceleration": size * pico.limits.acceleration}
    )
    laser = pico.laser.model_copy(
        update={"range_min": size * pico.laser.range_min, "range_max": size * pico.laser.range_max}
    )
    footprint = tuple((size * x, size * y) for x, y in pico.footprint)
    robot = pico.model_copy(update={"footprint": footprint, "limits": limits, "laser": laser})
    default = Profile()
    perception = fitted(default.perception, robot)
    door = perception.door.model_copy(update={"rule_range": size * 1.3, "range_margin": size * 0.01})
    perception = perception.model_copy(update={"door": door})
    return Profile(robot=robot, perception=perception, skills=fitted(default.skills, robot))


SEED = 1
"""A maze in which `space.left` and `junction == corner_left` never come in neighbouring ticks: either turns left."""
BRIEF = 2
"""Ticks: where two thresholds are crossed at nearly the same time, what does not grow says which comes first."""


def states(machine, size, limit=200.0):
    """The states that a machine goes through in a maze of its robot's size, but for brief ones; whether it is out."""
    profile = of_size(size)
    maze = scaled(generate(Recipe(columns=4, rows=3, corridor=1.0, doors=0), SEED), size)
    robot = LockstepRobot(SimulatedWorld(maze, profile.robot, 0, IDEAL))
    active = []

    def watch(tick):
        active.append(tuple(name for name in tick.configuration if not name.startswith("watch")))

    ending = drive(prepare(machine, profile, time_limit=limit), robot, robot, [watch])
    runs = [(state, len(list(run))) for state, run in groupby(active)]
    return [state for state, _ in groupby(state for state, ticks in runs if ticks > BRIEF)], ending.report["escaped"]


@pytest.mark.parametrize("machine", ["pledge", "pledge_smooth"])
def test_a_robot_scaled_with_its_maze_and_speed_goes_through_the_same_states(machine):
    at_one = states(machine, 1.0)
    assert at_one[1]
    assert len(at_one[0]) > 8
    for size in (0.5, 2.0):
        assert states(machine, size) == at_one


def test_without_growing_the_small_robot_would_go_another_way(monkeypatch):
    at_one, _ = states("pledge", 1.0, limit=30.0)
    monkeypatch.setattr(RobotDescription, "relative_size", 1.0)
    assert states("pledge", 0.5, limit=30.0)[0] != at_one


PROFILED = ("turtlebot3_burger", "turtlebot3_waffle", "turtlebot4")
SOLVERS = ("pledge", "pledge_smooth", "tremaux", "explorer", "right_hand", "right_hand_loop")
RUNS = [*product(PROFILED, SOLVERS), ("turtlebot4", "random_mouse")]  # the mouse has no bound on its time


@pytest.mark.parametrize(("name", "machine"), RUNS)
def test_a_profiled_robot_solves_the_maze_of_its_size(name, machine):
    profile = load_profile(name)
    robot = LockstepRobot(
        SimulatedWorld(replace(find_maze(name, robot=profile.robot), time_limit=math.inf), profile.robot, 0)
    )
    report = drive(prepare(machine, profile, time_limit=400.0), robot, robot).report
    assert report["escaped"], report["line"]
    assert not report["contacts"]


def test_every_profile_of_a_robot_that_is_no_pico_has_its_maze():
    for name in shipped_profiles():
        if not name.startswith("pico"):
            assert find_maze(name, robot=load_profile(name).robot).doors
