"""A machine tried line by line: what is done is a scenario, and can be taken back."""

import json

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

import hsm
from hsm.testing.scenarios.session import Session, SessionError
from maze_machine.catalogue.library import robot_names
from maze_machine.cli import app

MACHINE = """machine walk

event go

param pause : time = 1 s

var turns : int = 0

initial idle

state idle
    do stop()
    on go    -> moving

state moving
    do drive(speed = 0.2 m/s)
    when space.left    -> turning    / turns += 1
    on blocked         -> idle

state turning
    do rotate(90 deg)
    on done        -> moving
    after pause    -> idle
"""


@pytest.fixture
def session():
    library = robot_names()
    return Session(hsm.loads(MACHINE, library), library)


def test_a_machine_is_driven_by_the_lines_of_a_scenario(session):
    assert session.moment.states == ("idle",)
    moment = session.do("when event go")
    assert (moment.states, moment.taken) == (("moving",), ("idle -> moving (line 13)",))
    assert moment.doing == ("moving: drive(speed = 0.2 m/s)",)
    moment = session.do("when space.left")
    assert (moment.states, moment.variables["turns"]) == (("turning",), "1")
    moment = session.do("when rotate reports done, not space.left")
    assert moment.states == ("moving",)


def test_it_goes_back(session):
    first = session.moment
    session.do("when event go")
    middle = session.do("when space.left")
    session.tick()
    assert session.back() == middle
    session.back(2)
    assert session.moment.states == first.states
    assert session.lines == []
    with pytest.raises(SessionError, match="there are 0 to take back"):
        session.back()


def test_a_wait_stops_where_something_holds(session):
    session.do("when event go")
    session.do("when space.left")
    session.stop_when("idle")
    moment = session.do("after 5 s")
    assert moment.states == ("idle",)
    assert moment.time == pytest.approx(1.2)
    assert session.lines[-1] == "after 1 s"
    session.stop_when(None)
    assert session.do("after 5 s").time == pytest.approx(6.2)


def test_a_break_stops_what_is_waited_for_too(session):
    session.do("when event go")
    session.do("when space.left")
    session.stop_when("idle")
    assert session.do("expect moving within 5 s").states == ("idle",)
    assert session.lines[-1] == "after 1 s"


def test_why_says_what_decided(session):
    session.do("when event go")
    session.tick()
    assert session.why("moving") == ["line 17: when space.left: `space.left` was false"]
    with pytest.raises(SessionError, match="there is no state `nowhere`"):
        session.why("nowhere")


def test_given_begins_anew(session):
    session.do("when event go")
    moment = session.do("given space.left, pause = 2 s")
    assert moment.states == ("turning",)
    assert moment.variables["pause"] == "2 s"


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("when nonsense", "there is no signal `nonsense`"),
        ("when drive reports done", "drive"),
        ("fly", "a line begins with given, when, after, expect"),
        ("expect moving", "not so: moving"),
        ("after soon", "soon"),
        ("when event gone", "gone"),
    ],
)
def test_a_line_that_cannot_be_done_changes_nothing(session, line, message):
    before, lines = session.moment, list(session.lines)
    with pytest.raises(SessionError, match=message):
        session.do(line)
    assert session.lines == lines
    assert session.moment.states == before.states


LINES = ["when event go", "when space.left", "when not space.left", "after 0.4 s", "when rotate reports done", "tick"]


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.lists(st.sampled_from(LINES), max_size=12), st.integers(0, 12))
def test_going_back_is_never_having_gone(lines, count):
    library = robot_names()
    machine = hsm.loads(MACHINE, library)

    def driven(some):
        session = Session(machine, library)
        for line in some:
            try:
                session.tick() if line == "tick" else session.do(line)
            except SessionError:
                continue
        return session

    session = driven(lines)
    count = min(count, len(session.lines))
    kept = session.lines[: len(session.lines) - count]
    if count:
        session.back(count)
    again = driven(kept)
    assert (session.moment.states, session.moment.variables) == (again.moment.states, again.moment.variables)
    assert session.moment.time == again.moment.time


def simulate(text, *arguments):
    done = CliRunner().invoke(app, ["simulate", *map(str, arguments)], input=text)
    return done.exit_code, done.stdout, done.stderr


def test_a_session_is_saved_as_a_scenario_that_passes(tmp_path):
    machine, scenarios = tmp_path / "walk.maze-machine", tmp_path / "walk.maze-test"
    machine.write_text(MACHINE, encoding="utf-8")
    text = f"when event go\nwhen space.left\nsave {scenarios} it turns\nafter 2 s\nsave {scenarios} it gives up\nquit\n"
    assert simulate(text, machine)[0] == 0
    assert scenarios.read_text(encoding="utf-8").count("scenario ") == 2
    done = CliRunner().invoke(app, ["test", str(scenarios), "--json"])
    suite = json.loads(done.stdout)
    assert [one["passed"] for one in suite["scenarios"]] == [True, True]


def test_each_line_is_answered_by_an_object(tmp_path):
    machine = tmp_path / "walk.maze-machine"
    machine.write_text(MACHINE, encoding="utf-8")
    status, told, _ = simulate("when event go\ntick 3\n", machine, "--json", "--param", "pause=3 s")
    moments = [json.loads(line) for line in told.splitlines()]
    assert status == 0
    assert [one["states"] for one in moments] == [["idle"], ["moving"], ["moving"]]
    assert moments[-1]["time"] == pytest.approx(0.4)


@pytest.mark.parametrize("line", ["when nonsense", "back", "back x", "save", "tick 0", "why nowhere", "break nonsense"])
def test_a_wrong_line_in_a_pipe_ends_with_one_message(line):
    status, _, told = simulate(f"{line}\n", "pledge")
    assert status == 1
    assert len(told.strip().splitlines()) == 1
