"""What is said at once while a machine drives."""

import io
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

import hsm
from hsm import Macrostep
from hsm.interchange.reports import StepReport
from maze_machine.drive.tick import Phases, Tick
from maze_machine.report.notices import Notices
from transport.description import Laser
from transport.messages import Command, LinkStatus, Observation, Odometry, Pose, Scan, Twist

MACHINE = hsm.loads("machine still\ninitial a\nstate a\n", hsm.Library("none"))
SCAN = Scan(0, Laser().geometry(), np.ones(1000, np.float32))


def said(ticks):
    """The lines that are printed about (command, pose, why the base stands) ten times a second."""
    out = io.StringIO()
    notices = Notices(Console(file=out, width=200))
    report = StepReport(MACHINE, Macrostep())
    for index, (twist, pose, blind) in enumerate(ticks):
        stamp = 5 * 10**9 + index * 10**8
        observation = Observation(stamp, SCAN, Odometry.at(stamp, pose), link=LinkStatus(blind=blind))
        notices(Tick(index, observation, report, "", Command(twist), Phases(0, 0, 0, 0, 0, 0)))
    return out.getvalue().splitlines()


STILL = (Twist(), Pose(), "")


def test_a_stop_and_its_end_are_told_once_each():
    blind = replace(STILL[1]), "no scan for 0.40 s"
    ticks = [STILL] * 3 + [(Twist(), *blind)] * 4 + [STILL] * 3
    assert said(ticks) == ["0.3 s: the base was stopped: no scan for 0.40 s", "0.7 s: the base may move again"]


@pytest.mark.parametrize("twist", [Twist(0.5), Twist(0.0, -0.1), Twist(0.0, 0.0, 0.5)])
def test_a_robot_that_does_not_hear_is_told_of_once_with_the_settings_to_look_at(twist):
    (line,) = said([STILL] * 5 + [(twist, Pose(), "")] * 60)
    assert line.startswith("2.6 s: the robot is commanded to move, but its odometry does not change")
    assert "link.command_type" in line


def test_a_robot_that_has_moved_is_heard_of_no_more():
    moved = [(Twist(0.5), Pose(0.02), "")] * 2
    assert said([*moved, *[(Twist(0.5), Pose(0.02), "")] * 60]) != []
    assert said([STILL, *[(Twist(0.5), Pose(0.02), "")] * 60]) == []
    assert said([(Twist(0.01), Pose(), "")] * 60) == []
