"""Anybody's laser: machines see the same maze, wherever its circle begins and however it is mounted."""

import math

import pytest

from maze_machine.catalogue.profile import load_profile
from maze_machine.drive.mission import drive, prepare
from maze_machine.simulated.world import SimulatedWorld
from sim.formats import read_maze
from transport.description import Laser, RobotDescription
from transport.world import LockstepRobot

BEHIND_A_BEND = """\
name behind a bend
start 0.5 2.5 0
wall 0 0  0 3  4 3
wall 1 0  1 2  4 2
wall 0 0  1 0
door gate 3 2  3 3
exit 4 2  4 3
"""
STEP = math.tau / 360
LASERS = {
    "from behind": Laser(beams=360, angle_min=-math.pi, angle_max=math.pi - STEP),
    "from ahead": Laser(beams=360, angle_min=0.0, angle_max=math.tau - STEP),
    "from ahead, turned round": Laser(beams=360, angle_min=0.0, angle_max=math.tau - STEP, mount_heading=math.pi),
    "from the left, askew": Laser(beams=360, angle_min=1.6, angle_max=1.6 + math.tau - STEP, mount_heading=-1.0),
}


@pytest.fixture(scope="module")
def maze(tmp_path_factory):
    file = tmp_path_factory.mktemp("mazes") / "bend.maze"
    file.write_text(BEHIND_A_BEND)
    return read_maze(file, radius=RobotDescription().radius)


def driven(maze, laser, **more):
    profile = load_profile()
    robot = profile.robot.model_copy(update={"laser": laser.model_copy(update=more)})
    profile = profile.model_copy(update={"robot": robot})
    world = LockstepRobot(SimulatedWorld(maze, robot))
    return drive(prepare("right_hand", profile, time_limit=60.0), world, world)


@pytest.mark.parametrize("name", LASERS)
def test_the_door_is_found_and_passed_as_soon(maze, name):
    report = driven(maze, LASERS[name]).report
    assert report["escaped"], report
    assert report["doors_opened"] == ["gate"]
    assert report["contacts"] == []
    assert report["time"] == pytest.approx(10.9, abs=0.5)


def test_a_laser_shorter_than_the_hall_takes_no_place_in_it_for_the_outside(tmp_path):
    # In by a gate at one end, out by a gate at the other, 9 m farther on: the laser sees neither wall from the middle.
    file = tmp_path / "hall.maze"
    file.write_text(
        "name hall\nlimit 300\nstart 0.8 6 0\nwall 0 5.5  2 5.5  2 0  11 0  11 5.5  13 5.5\n"
        "wall 0 6.5  2 6.5  2 12  11 12  11 6.5  13 6.5\nwall 0 5.5  0 6.5\nexit 13 5.5  13 6.5\n"
    )
    ending = driven(read_maze(file, radius=RobotDescription().radius), Laser(), range_max=4.0)
    assert ending.outcome != "outside", ending.report
