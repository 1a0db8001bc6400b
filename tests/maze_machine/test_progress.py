"""What a terminal shows while a machine drives."""

from dataclasses import replace
from io import StringIO

from rich.console import Console

from maze_machine.catalogue.profile import load_profile
from maze_machine.drive.mission import drive, prepare
from maze_machine.report.progress import ProgressDisplay
from maze_machine.simulated.world import SimulatedWorld, find_maze
from transport.description import RobotDescription
from transport.world import LockstepRobot


def shown(terminal):
    out = StringIO()
    profile = load_profile()
    robot = LockstepRobot(SimulatedWorld(find_maze("corridor", robot=RobotDescription()), profile.robot))
    with ProgressDisplay(Console(file=out, force_terminal=terminal, width=120)) as progress:
        drive(prepare("pledge", profile, time_limit=2.0), robot, robot, [progress])
    return out.getvalue()


def test_a_terminal_shows_time_state_position_and_speed():
    text = shown(terminal=True)
    assert " s  " in text
    assert "start" in text
    assert " m  " in text
    assert "x real time" in text


def test_nothing_else_is_written_to():
    assert shown(terminal=False) == ""


def test_the_line_fits_a_terminal_of_80_columns_whatever_a_state_is_called():
    profile, lines = load_profile(), []
    progress = ProgressDisplay(Console(file=StringIO(), force_terminal=True, width=80))
    robot = LockstepRobot(SimulatedWorld(find_maze("corridor", robot=RobotDescription()), profile.robot))

    def note(tick):
        lines.append(progress._line(replace(tick, leading="a.very.long.name." * 5 + "end"), 1e9).plain)

    drive(prepare("pledge", profile, time_limit=0.5), robot, robot, [note])
    assert lines
    assert all(len(line) < 80 and "name.end" in line for line in lines)
