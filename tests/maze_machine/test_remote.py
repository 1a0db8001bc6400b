"""A running machine that is open to others: what they see, what they may do, and that the loop waits for nobody."""

import json
import socket
import threading
from contextlib import contextmanager

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

from hsm.interchange.reports import model_json
from maze_machine.catalogue.profile import load_profile
from maze_machine.cli import app
from maze_machine.drive.mission import drive, prepare
from maze_machine.drive.operation import ScheduledEvents
from maze_machine.errors import UsageError
from maze_machine.remote.client import NoMachineError, RemoteMachine
from maze_machine.remote.looking import looked_on
from maze_machine.remote.messages import (
    AdvanceRun,
    EndRun,
    OperationError,
    Pause,
    PauseAt,
    Resume,
    SendEvent,
    SetParameter,
    encoded,
    read_operation,
)
from maze_machine.remote.opened import OpenRun
from maze_machine.remote.operated import BACKLOG, OperatedRun
from maze_machine.remote.seen import read_sights
from maze_machine.remote.telling import EventForwarder
from maze_machine.simulated.world import SimulatedWorld, find_maze
from transport.connect import dialling, listening
from transport.description import RobotDescription
from transport.memory_bus import MemoryNetwork
from transport.security import Access, Identity, make_certificates
from transport.world import LockstepRobot

MACHINE = """machine waiting

event go, halt

param pace : speed = 0.2 m/s, adjustable(0.1 m/s, 0.3 m/s)

var heard : int = 0

initial idle

state idle
    do stop()
    on go -> moving    / heard += 1

state moving
    do drive(speed = pace)
    on halt    -> idle
    on blocked -> idle
"""


@pytest.fixture
def mission(tmp_path):
    path = tmp_path / "waiting.maze-machine"
    path.write_text(MACHINE, encoding="utf-8")
    return prepare(str(path), load_profile("pico"), time_limit=20.0)


@contextmanager
def running(mission, *, pausable=True):
    """The mission in the corridor, in a thread of its own; its ticks, its run and a client of it."""
    network = MemoryNetwork()
    seen = []
    operated = OperatedRun(mission, pausable=pausable)
    with OpenRun(network.bus(), mission, operated, model_json(mission.machine.model, mission.parameters)) as opened:
        client = RemoteMachine(network.bus(), mission.profile.robot.name)
        assert client.operate(Pause()).done == pausable
        world = SimulatedWorld(find_maze("corridor", robot=RobotDescription()), mission.profile.robot, 0)
        robot = LockstepRobot(world)
        work = threading.Thread(
            target=lambda: drive(mission, robot, robot, [seen.append, opened, operated], operator=operated)
        )
        work.start()
        try:
            yield seen, client, work
        finally:
            client.operate(EndRun())
            work.join(60)
            assert not work.is_alive()


def until(condition, seconds=30.0):
    event = threading.Event()
    for _ in range(int(seconds / 0.01)):
        if condition():
            return
        event.wait(0.01)
    raise AssertionError("it did not come to that")


def test_an_operator_sends_events_and_steps_through_the_run(mission):
    with running(mission) as (seen, client, _):
        until(lambda: len(seen) == 1)
        assert client.operate(SendEvent(name="go")).done
        assert client.operate(AdvanceRun(ticks=1)).done
        until(lambda: len(seen) == 2)
        assert seen[1].events == ("go",)
        assert seen[1].configuration == ("moving",)
        assert seen[1].variables["heard"] == 1
        assert client.operate(AdvanceRun(ticks=3)).done
        until(lambda: len(seen) == 5)
        assert client.operate(SendEvent(name="halt")).done
        assert client.operate(AdvanceRun()).done
        until(lambda: len(seen) == 6)
        assert seen[5].configuration == ("idle",)


def test_an_operator_changes_a_parameter_that_the_machine_allows(mission):
    with running(mission) as (seen, client, _):
        until(lambda: len(seen) == 1)
        assert client.model()["adjustable"] == {"pace": [0.1, 0.3]}
        assert client.operate(SetParameter(parameter="pace", value="30 cm/s")).done
        assert client.operate(SendEvent(name="go")).done
        assert client.operate(AdvanceRun(ticks=12)).done
        until(lambda: len(seen) == 13)
        assert seen[1].events == ("pace = 0.3 m/s", "go")
        assert seen[1].variables["pace"] == 0.3
        assert seen[12].command.twist.forward == pytest.approx(0.3)


@pytest.mark.parametrize(
    ("at", "tick"),
    [("moving", 1), ("line 13", 1), ("waiting:13", 1), ("heard == 1", 1), ("pace > 0.25 m/s, moving", 3)],
)
def test_a_run_pauses_where_it_comes_to_a_place(mission, at, tick):
    with running(mission) as (seen, client, _):
        until(lambda: len(seen) == 1)
        assert client.operate(PauseAt(at=at)).done
        assert client.operate(SendEvent(name="go")).done
        if tick == 3:
            assert client.operate(AdvanceRun(ticks=2)).done
            until(lambda: len(seen) == 3)
            assert client.operate(SetParameter(parameter="pace", value="0.3 m/s")).done
        steps = client.steps(10.0)
        assert client.operate(Resume()).done
        assert next(step for step in steps if step.get("paused") == at)["tick"] == tick
        assert len(seen) == tick + 1
        assert client.operate(AdvanceRun()).done  # what holds on does not pause it again
        assert next(step for step in steps if step["tick"] > tick and step.get("paused"))["paused"] != at


@pytest.mark.parametrize(
    ("at", "reason"),
    [
        ("line 99", "there is no transition in line 99"),
        ("door:3", "the machine has no file `door`; its files: waiting"),
        ("nowhere", "nowhere"),
        ("moving within 3 s", "remove `within`"),
        ("called stop", "stop"),
    ],
)
def test_a_place_that_cannot_be_is_refused(mission, at, reason):
    answer = json.loads(OperatedRun(mission, pausable=True).answer(PauseAt(at=at).model_dump_json().encode()))
    assert not answer["done"]
    assert reason in answer["reason"]


@pytest.mark.parametrize(
    ("parameter", "value", "reason"),
    [("pace", "0.5 m/s", "takes 0.1 m/s to 0.3 m/s"), ("pace", "1 s", "not a value"), ("heard", "1", "no adjustable")],
)
def test_a_change_that_the_machine_does_not_allow_is_refused(mission, parameter, value, reason):
    operated = OperatedRun(mission, pausable=True)
    answer = json.loads(operated.answer(SetParameter(parameter=parameter, value=value).model_dump_json().encode()))
    assert not answer["done"]
    assert reason in answer["reason"]
    assert list(operated.events(0, 0.0)) == []


def test_a_viewer_sees_the_machine_and_asks_why(mission):
    with running(mission) as (seen, client, _):
        until(lambda: len(seen) == 1)
        model = client.model()
        assert model["machine"] == "waiting"
        assert {"go", "halt"} <= set(model["events"])
        assert [one["name"] for one in model["states"]] == ["idle", "moving"]
        steps = client.steps(10.0)
        client.operate(AdvanceRun())
        step = next(steps)
        assert step["states"] == ["idle"]
        assert step["activities"] == {"idle": {"text": "stop", "arguments": {}}}
        assert step["variables"] == {"pace": 0.2, "heard": 0}
        client.operate(SendEvent(name="halt"))
        client.operate(AdvanceRun())
        until(lambda: ("halt",) in [one.events for one in seen])
        why = client.why("idle")
        assert why["active"] is True
        assert client.why("nowhere")["reason"] == "machine waiting has no state `nowhere`"


def test_who_looks_on_sees_what_perception_found_and_a_pause_is_no_end(mission):
    with running(mission) as (_, client, _):
        frames = looked_on(client, silence=0.05)
        first = next(frames)
        assert first["tick"] == 0
        assert {"landmarks", "nodes", "ways", "minimap", "at"} <= set(first["sights"])
        later = threading.Timer(0.3, lambda: client.operate(AdvanceRun()))
        later.start()
        second = next(one for one in frames if one["tick"] > 0)  # the first comes again once the run stands
        later.join()
        assert second["tick"] == 1
        assert second["sights"]["minimap"]["rows"]


SEEN = {
    "at": [0.0, 1.0, 2.0],
    "pose": [0.0, 0.0, 0.0],
    "landmarks": [[0, 0, 1.5, 1]],
    "nodes": [[1, 2, "corner"]],
    "ways": [[[0, 0], [1, 0], [1, 1]]],
    "minimap": {"size": 2, "cell": 0.1, "turn": 0.0, "rows": ["02", "20"]},
}


def test_valid_sights_are_kept():
    assert read_sights(json.dumps(SEEN).encode()) == SEEN
    assert read_sights(b"{}") == {}


@pytest.mark.parametrize(
    "change",
    [
        {"at": None},
        {"at": [0, 1]},
        {"at": [0, 1, float("nan")]},
        {"landmarks": 7},
        {"landmarks": [[0, 0, 1]]},
        {"landmarks": [["0", 0, 1, 1]]},
        {"nodes": [[1, 2, {}]]},
        {"ways": [None]},
        {"door": "wide"},
        {"minimap": {**SEEN["minimap"], "size": 10**9}},
        {"minimap": {**SEEN["minimap"], "rows": [7]}},
        {"map": {"poses": [[0, 0]], "points": "all", "ellipse": [1, 1, 0]}},
        {"map": {}},
    ],
    ids=str,
)
def test_sights_that_a_page_could_not_draw_are_left_out(change):
    assert read_sights(json.dumps({**SEEN, **change}).encode()) == {}


@pytest.mark.parametrize("answer", [b"", b"[]", b"null", b"\xff", b"[" * 10_000])
def test_sights_that_are_none_are_left_out(answer):
    assert read_sights(answer) == {}


def test_an_operator_ends_the_run(mission):
    with running(mission) as (_, client, work):
        assert client.operate(Resume()).done
        assert client.operate(EndRun()).done
        work.join(60)
        assert not work.is_alive()


@pytest.mark.parametrize("event", ["gone", "", "x" * 300])
def test_an_event_that_the_machine_does_not_know_is_refused(mission, event):
    with running(mission) as (seen, client, _):
        answer = client._bus.ask("pico/machine/operate", encoded({"kind": "event", "name": event}), 5.0)
        assert json.loads(answer)["done"] is False
        client.operate(AdvanceRun(ticks=2))
        until(lambda: len(seen) >= 2)
        assert all(tick.events == () for tick in seen)


def test_more_events_than_can_wait_are_refused(mission):
    with running(mission) as (_, client, _work):
        answers = [client.operate(SendEvent(name="go")).done for _ in range(BACKLOG + 1)]
        assert answers == [True] * BACKLOG + [False]


def test_a_robot_that_does_not_wait_cannot_be_paused(mission):
    with running(mission, pausable=False) as (_, client, _work):
        assert "only a simulation" in client.operate(Pause()).reason


def test_nobody_there_is_one_message():
    client = RemoteMachine(MemoryNetwork().bus(), "pico", patience=0.05)
    with pytest.raises(NoMachineError, match="no machine that drives `pico` answers"):
        client.operate(EndRun())


@settings(max_examples=200, deadline=None, derandomize=True)
@given(st.binary(max_size=200) | st.recursive(st.none() | st.integers() | st.text(max_size=9), st.lists).map(encoded))
def test_any_question_is_an_operation_or_refused(payload):
    try:
        operation = read_operation(payload)
    except OperationError:
        return
    assert operation.kind in ("event", "pause", "resume", "advance", "speed", "end")


def test_a_schedule_sends_each_event_once_at_its_tick():
    schedule = ScheduledEvents([(0.2, "b"), (0.0, "a"), (0.2, "c")])
    assert [list(schedule.events(index, 5.0 + index / 10)) for index in range(4)] == [["a"], [], ["b", "c"], []]


def run(*arguments):
    done = CliRunner().invoke(app, ["run", *map(str, arguments), "--no-picture"])
    return done.exit_code, done.stdout, done.stderr


def test_a_scripted_event_is_in_the_trace_and_in_the_replay(tmp_path):
    machine, trace, recording = (tmp_path / name for name in ("waiting.maze-machine", "t.jsonl", "r.mcap"))
    machine.write_text(MACHINE, encoding="utf-8")
    at = ("--event-at", "1:go", "--event-at", "1.5:pace=0.3m/s", "--event-at", "2.5:halt", "--time-limit", 4)
    run(machine, *at, "--maze", "corridor", "--trace", trace, "--record", recording)
    lines = [json.loads(line) for line in trace.read_text(encoding="utf-8").splitlines()[1:]]
    heard = {line["tick"]: line["events"] for line in lines if "events" in line}
    assert heard == {10: ["go"], 15: ["pace = 0.3 m/s"], 25: ["halt"]}
    assert (lines[10]["states"], lines[25]["states"]) == (["moving"], ["idle"])
    again = tmp_path / "again.jsonl"
    done = CliRunner().invoke(app, ["replay", str(recording), "--trace", str(again)])
    assert done.exit_code == 0, done.output
    assert again.read_bytes() == trace.read_bytes()


@pytest.mark.parametrize("entry", ["go", "x:go", "-1:go", "nan:go", "1:", "1:gone", "1e400:go", "1:pace = 9 m/s"])
def test_a_wrong_script_is_refused(tmp_path, entry):
    machine = tmp_path / "waiting.maze-machine"
    machine.write_text(MACHINE, encoding="utf-8")
    status, _, told = run(machine, "--event-at", entry)
    assert status == UsageError.status
    assert len(told.strip().splitlines()) == 1


def test_a_watcher_looks_on_and_an_operator_operates(tmp_path, mission):
    pytest.importorskip("trustme")
    access = Access(controllers={"alice": ["pico"]}, watchers={"eve": ["pico"]}, operators={"olga": ["pico"]})
    make_certificates(tmp_path / "ca", access)
    alice, eve, olga = (Identity.at(tmp_path / "ca" / name) for name in ("alice", "eve", "olga"))
    endpoint = f"tls/localhost:{free_port()}"
    operated = OperatedRun(mission, pausable=True)
    told = model_json(mission.machine.model, mission.parameters)
    with listening(endpoint, security=alice.listening()) as bus, OpenRun(bus, mission, operated, told):
        with dialling(endpoint, security=eve.dialling()) as theirs:
            watcher = RemoteMachine(theirs, "pico", patience=5.0)
            assert watcher.model()["machine"] == "waiting"
            with pytest.raises(NoMachineError):
                RemoteMachine(theirs, "pico", patience=0.5).operate(EndRun())
        assert operated.ended == ""
        with dialling(endpoint, security=olga.dialling()) as theirs:
            assert RemoteMachine(theirs, "pico", patience=5.0).operate(SendEvent(name="go")).done
        assert list(operated.events(0, 0.0)) == ["go"]


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


# What a machine sends to the machine of another robot.

TALKER = """machine talker

event go, claim(key : int)

state a
    do stop()
    after 0.5 s -> b / send go, send claim(7)

state b
    after 0.5 s -> c / send go

final c
"""


@pytest.fixture
def talker(tmp_path):
    path = tmp_path / "talker.maze-machine"
    path.write_text(TALKER, encoding="utf-8")
    return prepare(str(path), load_profile("pico"))


def tell(talker, network, losses):
    """Drive the talker, whose events go to the machine of the robot `pico`."""

    @contextmanager
    def dial():
        yield network.bus()

    lines = []
    with EventForwarder(dial, "pico", losses) as teller:
        world = SimulatedWorld(find_maze("corridor", robot=RobotDescription()), talker.profile.robot, 0)
        robot = LockstepRobot(world)
        drive(talker, robot, robot, [teller, lambda tick: lines.append(tick.line)])
    return [event for line in lines for event in line.get("sent", ())]


def test_what_a_machine_sends_is_an_event_of_another_robots_machine(mission, talker):
    network, losses, seen = MemoryNetwork(), [], []
    operated = OperatedRun(mission, pausable=True)
    with OpenRun(network.bus(), mission, operated, model_json(mission.machine.model, {})) as opened:
        client = RemoteMachine(network.bus(), "pico")
        client.operate(Pause())
        world = SimulatedWorld(find_maze("corridor", robot=RobotDescription()), mission.profile.robot, 0)
        robot = LockstepRobot(world)
        watchers = [seen.append, opened, operated]
        work = threading.Thread(target=lambda: drive(mission, robot, robot, watchers, operator=operated))
        work.start()
        assert tell(talker, network, losses) == ["go", "claim(key = 7)", "go"]
        client.operate(AdvanceRun(ticks=3))
        until(lambda: any(tick.events for tick in seen))
        client.operate(EndRun())
        work.join(60)
    assert losses == []
    assert [event for tick in seen for event in tick.events] == ["go", "go"]  # it declares no `claim`


def test_events_that_reach_nobody_are_told(talker):
    losses = []
    assert tell(talker, MemoryNetwork(), losses) == ["go", "claim(key = 7)", "go"]
    assert losses == ["3 events did not reach pico: no machine that drives `pico` answers"]


@pytest.mark.parametrize("other", ["pico", "@tcp/127.0.0.1:1", "pico@"])
def test_whom_to_tell_is_a_robot_and_an_endpoint(other):
    result = CliRunner().invoke(app, ["run", "pledge", "--no-picture", "--tell", other])
    assert result.exit_code == 2
    assert "write ROBOT@ENDPOINT" in result.output


def test_a_machine_with_members_is_not_run_on_one_robot(tmp_path):
    (tmp_path / "talker.maze-machine").write_text(TALKER, encoding="utf-8")
    pair = tmp_path / "pair.maze-machine"
    pair.write_text("machine pair\nimport talker\nparallel both\n    member a1 = talker()\n    member a2 = talker()\n")
    with pytest.raises(UsageError, match=r"machine pair has members \(a1, a2\)"):
        prepare(str(pair), load_profile("pico"))


def test_a_run_that_stands_still_keeps_its_robot_and_another_pace_is_kept(mission, monkeypatch):
    monkeypatch.setattr("maze_machine.remote.operated.KEEP", 0.01)
    kept, seen = threading.Event(), []
    operated = OperatedRun(mission, pausable=False)
    assert json.loads(operated.answer(b'{"kind":"pause"}'))["done"] is False
    operated.drives(waits=True, keep=kept.set)
    assert json.loads(operated.answer(b'{"kind":"pause"}'))["done"] is True
    world = SimulatedWorld(find_maze("corridor", robot=RobotDescription()), mission.profile.robot, 0)
    robot = LockstepRobot(world)
    work = threading.Thread(target=lambda: drive(mission, robot, robot, [seen.append, operated], operator=operated))
    work.start()
    assert kept.wait(30.0), "the robot hears from a paused run"
    assert len(seen) == 1
    assert json.loads(operated.answer(b'{"kind":"speed","factor":0.001}'))["done"] is True
    assert json.loads(operated.answer(b'{"kind":"resume"}'))["done"] is True
    until(lambda: len(seen) == 2)
    threading.Event().wait(0.05)
    assert len(seen) == 2, "a tick takes 100 s at this pace"
    assert json.loads(operated.answer(b'{"kind":"speed","factor":null}'))["done"] is True
    work.join(60)
    assert not work.is_alive()


@pytest.mark.parametrize("factor", ["0", "-1", "1e9", '"x"', "1e999", "1e-300", "0.0009"])
def test_a_pace_that_is_none_is_refused(mission, factor):
    operated = OperatedRun(mission, pausable=True)
    assert json.loads(operated.answer(b'{"kind":"speed","factor":' + factor.encode() + b"}"))["done"] is False
