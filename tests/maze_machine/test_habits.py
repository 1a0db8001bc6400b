"""A robot that does not see stands: the loop, the gate and the simulator, with the habits of real drivers."""

import importlib.util
import sys
from pathlib import Path

import pytest

import hsm
from maze_machine.catalogue.library import robot_library
from maze_machine.catalogue.machines import shipped_machines
from maze_machine.catalogue.profile import load_profile
from maze_machine.drive.mission import Mission, drive, prepare
from maze_machine.simulated.settings import simulator_settings
from maze_machine.simulated.world import SimulatedWorld, find_maze
from transport.description import RobotDescription
from transport.messages import STOP
from transport.world import LockstepRobot

FILE = Path(__file__).parents[2] / "benchmarks" / "habits.py"
SPEC = importlib.util.spec_from_file_location("habits", FILE)
habits = sys.modules["habits"] = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(habits)

NAMED = {habit.name: habit for habit in habits.HABITS}
BRAKING = 0.36
"""From 0.5 m/s at 1.5 m/s^2, and a step of the simulated driver, s."""
PERIOD, STALE, RESUME = 0.1, 0.35, 0.3


@pytest.fixture(autouse=True)
def soon(monkeypatch):
    """Habits that begin as soon as the robot drives, watched for as long as it takes to see what comes of them."""
    monkeypatch.setattr(habits, "ONSET", 1.0)
    monkeypatch.setattr(habits, "LENGTH", 1.5)


@pytest.mark.parametrize(
    ("robot", "habit", "said"),
    [
        ("bare", "the scans stop", "no scan for 0."),
        ("bare", "the odometry stops", "no odometry for 0."),
        ("gated", "the scans stop", "no scan for 0."),
        ("gated", "the odometry stops", "no odometry for 0."),
        ("simulated", "the scans stop", "no scan for 0."),
        ("simulated", "the odometry stops", "no odometry for 0."),
    ],
)
def test_a_sensor_that_falls_silent_stops_the_base_after_what_is_stale_and_a_period(robot, habit, said):
    row = getattr(habits, robot)(NAMED[habit])
    assert STALE < row.stood <= STALE + PERIOD + BRAKING
    assert row.rolled <= 0.5 * (STALE + PERIOD) + 0.5 * BRAKING / 2 + 0.01
    assert row.said.startswith(said)
    assert not row.moves


@pytest.mark.parametrize("robot", ["bare", "gated"])
def test_what_is_refused_stops_the_base_at_once(robot):
    row = getattr(habits, robot)(NAMED["another laser's scans"])
    assert row.stood <= 2 * PERIOD + BRAKING
    assert row.said == "the scan has 500 beams, the profile says 1000 (robot.laser.beams)"


@pytest.mark.parametrize("habit", ["five beams -inf", "all beams +inf", "stamps 100 s back", "all stamps 0"])
def test_what_says_nothing_against_driving_does_not_stop_it(habit):
    row = habits.bare(NAMED[habit])
    assert (row.stood, row.moves) == (None, True)
    assert row.said == {"stamps 100 s back": "the robot's clock was set back"}.get(
        habit, "the robot's clock stood still" if "0" in habit else ""
    )


MACHINE = """\
machine test

event other

initial going

state going
    do drive(speed = 0.5 m/s)
    on blinded -> waiting

state waiting
    when not link.blind -> driven_on

state driven_on
    do drive(speed = 0.5 m/s)
    on blocked -> over

final over
"""


def test_the_machine_hears_of_it_and_goes_on_by_rule(tmp_path):
    file = tmp_path / "test.maze-machine"
    file.write_text(MACHINE)
    profile = load_profile()
    mission = Mission(hsm.load(file, robot_library()), profile, time_limit=6.0)
    faults = simulator_settings(faults=["laser_silent at=2 lasts=1"])
    robot, seen = LockstepRobot(SimulatedWorld(habits.long_corridor(), profile.robot, settings=faults)), []
    drive(mission, robot, watchers=[seen.append])
    blind = [tick for tick in seen if tick.blind]
    first, last = blind[0], blind[-1]
    assert first.time == pytest.approx(1.9 + STALE, abs=PERIOD)
    assert last.time == pytest.approx(3.0 + RESUME, abs=PERIOD)
    assert blind == seen[first.index : last.index + 1]
    assert all(tick.command.twist == STOP for tick in blind)
    assert [tick.configuration for tick in seen if tick.step.transitions] == [("waiting",), ("driven_on",)]
    assert seen[first.index].configuration == ("waiting",)
    assert first.line["blind"] == first.blind
    assert "blind" not in seen[0].line
    assert seen[-1].command.twist.forward > 0.4


def test_an_activity_goes_on_where_it_was_however_long_the_robot_was_kept_standing():
    profile = load_profile()
    mission = prepare("right_hand", profile, time_limit=9.0)
    faults = simulator_settings(faults=["odometry_silent at=2 lasts=4"])
    robot, seen = LockstepRobot(SimulatedWorld(habits.long_corridor(), profile.robot, settings=faults)), []
    drive(mission, robot, watchers=[seen.append])
    assert {state for tick in seen for state in tick.configuration if "turn" in state} == set()
    assert seen[-1].command.twist.forward > 0.4


@pytest.mark.parametrize("name", sorted(set(shipped_machines()) - {"door", "watch"}))
def test_every_shipped_machine_ends_where_the_sensors_do_not_come_back(name):
    profile = load_profile()
    maze = find_maze("corridor" if "corridor" in name else "final_2015", robot=RobotDescription())
    robot = LockstepRobot(
        SimulatedWorld(maze, profile.robot, settings=simulator_settings(faults=["laser_silent at=2"]))
    )
    seen = []
    ending = drive(prepare(name, profile, time_limit=20.0), robot, watchers=[seen.append])
    assert ending.outcome == "link_lost"
    assert ending.duration == pytest.approx(1.9 + STALE + 10.0, abs=0.3)
    assert all(tick.command.twist == STOP for tick in seen if tick.time > 1.9 + STALE + PERIOD)
