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
from maze_machine.simulated.console import Console

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


def test_a_line_that_a_break_stops_keeps_what_it_did(session):
    session.stop_when("moving")
    session.do("when event go")
    assert session.do("after 1 s, space.left").time == pytest.approx(1.1), "it has come to hold once"
    session.stop_when("idle")
    session.do("after 1 s, event go")
    assert session.lines == ["when event go", "after 1 s, space.left", "after 1 s, event go"]
    session.stop_when("line 23")
    session.back()
    assert session.do("after 5 s").time == pytest.approx(2.1)


def test_a_violated_property_is_told():
    library = robot_names()
    text = "machine m\nevent go\nproperty never_b : never in(b)\ninitial a\nstate a\n    on go -> b\nstate b\n"
    session = Session(hsm.loads(text, library), library)
    assert session.moment.violated == ()
    assert session.do("when event go").violated == ("never_b: never in(b)",)
    assert session.do("after 5 s").violated == ("never_b: never in(b)",)
    session.back(2)
    assert session.moment.violated == ()
    assert session.do("when event go").violated == ("never_b: never in(b)",)


def test_a_break_stops_what_is_waited_for_too(session):
    session.do("when event go")
    session.do("when space.left")
    session.stop_when("idle")
    assert session.do("expect moving within 5 s").states == ("idle",)
    assert session.lines[-1] == "after 1 s"


def test_why_says_what_decided(session):
    session.do("when event go")
    session.tick()
    assert session.why("moving") == [
        "line 17: when space.left: `space.left` was false",
        "line 18: on blocked: none of its events arrived",
    ]
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
        ("expect moving", "not true: moving"),
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


QUICK = """machine quick

event go, floor(number : int)

var n : int = 0

initial first

state first
    on go                  -> second
    on floor if floor.number > 2 -> third

state second
    when n == 0  -> third    / n = 4

state third
    after 2 s        -> first
    when door.near   -> first
"""


@pytest.fixture
def quick():
    library = robot_names()
    return Session(hsm.loads(QUICK, library), library)


def test_microsteps_are_seen_one_by_one(quick):
    console = Console(quick)
    first = console.do("micro when event go")
    assert (first.states, first.variables["n"], first.taken) == (("second",), "0", ("first -> second (line 10)",))
    second = console.do("micro")
    assert (second.states, second.variables["n"]) == (("third",), "4")
    assert second.taken == ("second -> third (line 14)",)
    assert quick.moment.states == ("third",)
    assert console.do("micro").time == pytest.approx(0.2)


def test_what_comes_next_is_what_the_engine_does_with_it(quick):
    coming = quick.prospects()
    assert [(one.enabled, one.line) for one in coming] == [
        (True, "when event go"),
        (True, "when event floor(number = 3)"),
    ]
    quick.do("when event go")
    late, near = quick.prospects()
    assert (late.enabled, late.line) == (True, "after 2 s")
    assert (near.enabled, near.reason) == (False, "`door.near` was false")
    before = quick.moment
    quick.do(late.line)
    assert quick.moment.states == ("first",)
    quick.back()
    assert quick.moment.states == before.states


def test_what_an_event_carries_is_chosen_by_the_guard():
    library = robot_names()
    text = """machine measured

event moved(by : length, turned : angle, sure : bool)

param far : length = 35 cm

initial first

state first
    on moved if moved.by > 2 * far and moved.turned == 90 deg and moved.sure -> second
    on moved if moved.by < -far and moved.by > far                           -> second

state second
"""
    session = Session(hsm.loads(text, library), library)
    coming, never = session.prospects()
    assert coming.line == "when event moved(by = 2 m, turned = 90 deg, sure = true)"
    assert not never.enabled
    assert session.do(coming.line).states == ("second",)


def test_whatever_is_said_to_fire_fires(session):
    session.do("when event go")
    for chosen in range(6):
        enabled = [one for one in session.prospects() if one.enabled]
        if not enabled:
            session.do("when space.left")
            continue
        one = enabled[chosen % len(enabled)]
        before = session.moment.time
        session.do(one.line)
        assert one.transition.index in {taken.index for taken in session.driver.last.transitions}, one
        assert session.moment.time > before


def test_a_wait_stops_at_a_transition_by_its_line(session):
    session.do("when event go")
    session.do("when space.left")
    session.stop_when("line 23")
    assert session.do("after 5 s").time == pytest.approx(1.2)
    assert session.moment.taken == ("turning -> idle (line 23)",)
    with pytest.raises(SessionError, match="there is no transition in line 99"):
        session.stop_when("line 99")


def test_a_wait_stops_at_a_transition_of_an_imported_machine(tmp_path):
    (tmp_path / "inner.maze-machine").write_text(
        "machine inner\nstate a\n    after 1 s -> b\nstate b\n    after 1 s -> over\nfinal over\n", encoding="utf-8"
    )
    outer = tmp_path / "outer.maze-machine"
    outer.write_text(
        "machine outer\nimport inner\nstate one = inner()\n    on over -> two\nstate two = inner()\n", encoding="utf-8"
    )
    library = robot_names()
    session = Session(hsm.load(outer, library), library)
    for place, times in (("inner:5", (2.0, 4.0)), ("inner.maze-machine:3", (1.0, 3.0)), ("line 4", (2.0,))):
        session.back(len(session.lines)) if session.lines else None
        session.stop_when(place)
        assert [session.do("after 9 s").time for _ in times] == [pytest.approx(one) for one in times]
    with pytest.raises(SessionError, match=r"no transition in line 5; of an imported file: inner:5"):
        session.stop_when("line 5")
    with pytest.raises(SessionError, match="has no file `door`; its files: outer, inner"):
        session.stop_when("door:5")


def test_a_page_saves_where_it_may_and_nothing_but_scenarios(session, tmp_path):
    console = Console(session, tmp_path)
    session.do("when event go")
    for name in ("../walk.maze-test", f"{tmp_path}/walk.maze-test", ".bashrc"):
        with pytest.raises(SessionError):
            console.do(f"save {name}")
    assert list(tmp_path.iterdir()) == []
    console.do("save walk.maze-test it goes")
    assert "scenario it goes" in (tmp_path / "walk.maze-test").read_text(encoding="utf-8")


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
