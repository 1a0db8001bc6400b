"""The loop on a robot that only remembers what it was told."""

import math
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import hsm
from hsm.model.registry import Library, Outcome
from hsm.model.types import Speed
from maze_machine.catalogue.profile import load_profile
from maze_machine.drive.loop import merged
from maze_machine.drive.mission import Mission, drive
from maze_machine.drive.verdict import read_verdict
from maze_machine.report.result import Result
from perception import Perception
from transport.description import Laser
from transport.messages import Command, Observation, Odometry, Pose, Scan, Twist
from transport.robot import LinkError

LIBRARY = Library("test")
for name in ("lost", "found"):
    LIBRARY.event(name)


@LIBRARY.activity("go", outcomes=("done",), holds=("base",))
class Go:
    """Drive for so many ticks."""

    def __init__(self, speed: Speed, ticks: int) -> None:
        self.speed, self.left = speed, ticks

    def tick(self, facts):
        """The velocity."""
        self.left -= 1
        return Command(Twist(self.speed)) if self.left >= 0 else Outcome("done")


@LIBRARY.activity("fail", holds=("base",))
class Fail:
    """Does not work."""

    def tick(self, facts):
        """Raise."""
        raise RuntimeError("no legs")


VERDICT = read_verdict(
    {
        **{"goal": "out", "solved": True, "escaped": True, "outcome": "escaped", "reason": "out", "line": "out"},
        **{"time": 1.0, "path_length": 2.0, "clearance": None, "doors_opened": [], "contacts": []},
    }
)[0]


@dataclass
class Recorder:
    """A robot in empty space that stands still, whatever it is told."""

    lost_after: int = 10**6
    finished_after: int = 10**6
    told: list[Command] = field(default_factory=list)
    closed: int = 0

    @property
    def finished(self):
        return len(self.told) >= self.finished_after

    def report(self):
        assert not self.closed, "the referee is asked while the robot is still there"
        return VERDICT

    def observe(self):
        assert not self.closed
        if len(self.told) >= self.lost_after:
            raise LinkError("nobody there")
        stamp = 100_000_000 * len(self.told)
        ranges = np.full(1000, math.inf, dtype=np.float32)
        return Observation(stamp, Scan(stamp, Laser().geometry(), ranges), Odometry.at(stamp, Pose()))

    def command(self, command):
        assert not self.closed
        self.told.append(command)

    def close(self):
        self.closed += 1


def mission(tmp_path, text, **more):
    file = tmp_path / "test.maze-machine"
    file.write_text(text)
    return Mission(hsm.load(file, LIBRARY), load_profile(), **more)


GOING = """\
machine test
param speed : speed = 0.3 m/s
initial going
state going
    do go(speed = speed, ticks = 5)
    on done -> over
final over
"""


def test_a_machine_runs_to_its_end_and_the_robot_is_let_go(tmp_path):
    robot, seen = Recorder(), []
    ending = drive(mission(tmp_path, GOING), robot, watchers=[seen.append])
    assert (ending.outcome, ending.reason, ending.report) == ("over", "the machine ended", {})
    assert ending.ticks == len(robot.told) == len(seen) == 7
    assert ending.duration == pytest.approx(0.6)
    assert robot.closed == 1
    assert [tick.index for tick in seen] == list(range(7))
    assert [command.answers for command in robot.told] == [tick.observation.stamp for tick in seen]
    assert [tick.command for tick in seen] == robot.told
    assert all(seconds >= 0 for tick in seen for seconds in tick.phases)


def test_an_outcome_is_seen_one_tick_after_it_was_reported(tmp_path):
    robot, seen = Recorder(), []
    drive(mission(tmp_path, GOING), robot, watchers=[seen.append])
    assert [tick.configuration for tick in seen] == [("going",)] * 6 + [("over",)]
    assert seen[-1].step.transitions[0].place.line == 6


def test_properties_are_watched_and_told_once(tmp_path):
    held = "property driving : never in(over) and doing(go)\n"
    broken = "property short : after in(going), in(over) within 300 ms\n"
    text = GOING.replace("initial", held + broken + "initial", 1)
    lines, ours = [], mission(tmp_path, text)
    ending = drive(ours, Recorder(), watchers=[lambda tick: lines.append(tick.line)])
    assert [(k, line["violated"]) for k, line in enumerate(lines) if "violated" in line] == [(3, ["short"])]
    (told,) = ending.violations
    assert "test.maze-machine:4:" in told
    assert "property short is violated at 0.3 s in going" in told
    result = Result("test", {}, ending)
    assert told in result.lines()
    assert result.as_json()["violations"] == [told]
    assert drive(mission(tmp_path, GOING), Recorder()).violations == ()


def test_a_broken_assumption_is_told_as_such(tmp_path):
    stated = "assume soon : after in(going), in(over) within 300 ms\nassume calm : never in(over) and doing(go)\n"
    lines = []
    ending = drive(
        mission(tmp_path, GOING.replace("initial", f"{stated}initial", 1)),
        Recorder(),
        watchers=[lambda tick: lines.append(tick.line)],
    )
    assert [(number, line["broken"]) for number, line in enumerate(lines) if "broken" in line] == [(3, ["soon"])]
    assert not any("violated" in line for line in lines)
    (told,) = ending.broken
    assert "assumption soon is broken at 0.3 s in going" in told
    result = Result("test", {}, ending)
    assert told in result.lines()
    assert (result.as_json()["broken"], result.as_json()["violations"]) == ([told], [])


def test_parameters_reach_the_activity_and_limits_the_command(tmp_path):
    robot = Recorder()
    drive(mission(tmp_path, GOING, parameters={"speed": 9.0}), robot)
    speeds = [command.twist.forward for command in robot.told]
    limits = load_profile().robot.limits
    assert max(speeds) == pytest.approx(limits.speed)
    assert max(abs(a - b) for a, b in zip([0.0, *speeds], speeds, strict=False)) <= limits.acceleration * 0.1 + 1e-12


def test_a_fault_stops_the_robot_first_and_names_the_line(tmp_path):
    robot = Recorder()
    failing = mission(tmp_path, "machine test\ninitial bad\nstate bad\n    do fail()\n    after 9 s -> bad\n")
    with pytest.raises(hsm.MachineFault, match=r"test.maze-machine:4:8: .*no legs"):
        drive(failing, robot)
    assert robot.closed == 1
    assert all(command.twist == Twist() for command in robot.told)


def test_a_lost_link_or_a_watcher_that_fails_closes_the_robot_too(tmp_path):
    robot = Recorder(lost_after=3)
    with pytest.raises(LinkError):
        drive(mission(tmp_path, GOING), robot)
    assert robot.closed == 1

    def interrupt(tick):
        raise KeyboardInterrupt

    robot = Recorder()
    with pytest.raises(KeyboardInterrupt):
        drive(mission(tmp_path, GOING), robot, watchers=[interrupt])
    assert robot.closed == 1


def test_the_referee_or_the_time_limit_may_end_a_run(tmp_path):
    robot = Recorder(finished_after=2)
    ending = drive(mission(tmp_path, GOING), robot, robot)
    assert (ending.outcome, ending.ticks, ending.report) == (None, 2, VERDICT)
    assert ending.reason == "the referee ended the run"
    ending = drive(mission(tmp_path, GOING, time_limit=0.3), Recorder())
    assert (ending.outcome, ending.ticks) == (None, 4)
    assert ending.reason == "the time limit of 0.3 s was reached"


COMMANDS = st.builds(Command, st.builds(Twist, *[st.floats(-1, 1)] * 3), st.booleans(), st.integers(0, 9))


@given(st.lists(st.booleans(), max_size=4), COMMANDS, st.integers(0, 4))
def test_what_holds_the_base_moves_it_and_any_may_ring(rings, holder, place):
    others = [Command(ring=ring) for ring in rings]
    together = merged([*others[:place], holder, *others[place:]])
    assert together == Command(holder.twist, holder.ring or any(rings))
    assert merged([]) == Command()


@pytest.mark.parametrize(
    "changed",
    [{"time": "soon"}, {"time": math.inf}, {"time": -1.0}, {"solved": 1}, {"clearance": math.nan}, {"line": "x" * 1001},
     {"doors_opened": "all"}, {"contacts": [1]}, {"seed": -5}, {"attempt": 10**30}, {"escaped": None}],
)  # fmt: skip
def test_a_verdict_that_cannot_be_read_is_said_to_be_so_and_the_run_keeps_its_result(tmp_path, changed):
    class Absurd(Recorder):
        def report(self):
            return VERDICT | changed

    robot = Absurd(finished_after=2)
    ending = drive(mission(tmp_path, GOING), robot, robot)
    assert (ending.ticks, ending.report) == (2, {})
    shown = Result("going", {}, ending)
    assert "cannot be read: `" + next(iter(changed)) in "\n".join(shown.lines())
    assert shown.as_json()["verdict"] is None


def test_the_longest_tick_is_printed_where_a_beat_was_missed(tmp_path):
    ending = replace(drive(mission(tmp_path, GOING), Recorder()), longest_tick=0.25)
    assert Result("going", {}, ending).as_json()["longest_tick"] == 0.25
    late, never = ("\n".join(Result("going", {}, ending, link={"overruns": n}).lines()) for n in (1, 0))
    assert "longest tick                 0.250 s" in late
    assert "longest tick" not in never


@pytest.mark.parametrize("name", [name for name in VERDICT if name not in ("maze", "seed", "attempt", "rings")])
def test_a_verdict_lacks_nothing(name):
    verdict, unread = read_verdict({key: value for key, value in VERDICT.items() if key != name})
    assert not verdict
    assert name in unread


class Noticing(Perception):
    """A perception in which the robot is lost in its third tick, and found in its fifth."""

    seen = 0

    def facts(self, observation):
        """The facts, and what has happened in this tick."""
        facts = super().facts(observation)
        facts.world.events = {2: ("lost",), 4: ("found",)}.get(self.seen, ())
        self.seen += 1
        return facts


LOSING = """\
machine test
initial going
state going
    on lost -> looking
state looking
    on found -> over
final over
"""


@pytest.mark.parametrize("text", [LOSING, GOING], ids=["heard", "not heard"])
def test_a_machine_hears_that_the_robot_is_lost_and_found(tmp_path, text):
    ours, seen = mission(tmp_path, text), []
    noticing = Noticing(ours.profile.robot, ours.profile.perception)
    ending = drive(ours, Recorder(), None, [seen.append], noticing)
    assert ending.outcome == "over"
    if text == LOSING:
        assert [tick.configuration for tick in seen] == [("going",)] * 2 + [("looking",)] * 2 + [("over",)]
