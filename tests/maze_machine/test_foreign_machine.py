"""What answers in the name of a machine may be anything: it is checked before anybody uses it."""

import json
from contextlib import nullcontext

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hsm.interchange.reports import model_json
from hsm.testing.scenarios.script import Performed
from maze_machine.catalogue.profile import load_profile
from maze_machine.commands import watch as watching
from maze_machine.debug.chart import Chart
from maze_machine.debug.elsewhere import RemoteRun
from maze_machine.drive.mission import prepare
from maze_machine.remote.client import RemoteMachine
from maze_machine.remote.described import (
    LARGEST_TICK,
    ForeignMessageError,
    machine_schema,
    read_machine,
    read_tick,
    read_why,
)
from maze_machine.remote.messages import Pause
from maze_machine.report.pages import network_head, remote_head, run_head
from maze_machine.view.drawings import Drawings
from transport.memory_bus import MemoryNetwork

jsonschema = pytest.importorskip("jsonschema")

TICK = {
    "tick": 3, "stamp": 300_000_000, "states": ["idle"], "taken": [], "pose": [0, 0, 0.5], "twist": [0, 0, 0],
    "ring": False, "doing": "idle", "fired": [], "regions": {"waiting": "idle"}, "outcomes": [], "variables": {"n": 1},
    "activities": {"idle": {"text": "stop", "arguments": {}}},
    "why": [{"transition": 0, "verdict": "false", "reason": "no event"}],
}  # fmt: skip
TICK_ACTIVITY = TICK["activities"]["idle"]
STATE = {
    "index": 1, "name": "idle", "kind": "atomic", "parent": None, "instance": None, "activity": "stop",
    "file": "waiting.maze-machine", "line": 3,
}  # fmt: skip
TRANSITION = {
    "source": "idle", "targets": [], "trigger": "on go", "actions": [], "file": "waiting.maze-machine", "line": 4
}  # fmt: skip
MACHINE = {
    "machine": "waiting", "parameters": {}, "types": {}, "adjustable": {}, "events": ["go"], "event_data": {},
    "states": [STATE], "transitions": [TRANSITION], "properties": {}, "assumptions": {},
}  # fmt: skip
PAGE = {
    "title": "waiting", "period": 0.1, "footprint": [[0, 0]], "laser": None, "scene": None, "sources": {},
    "drawings": {}, "undrawn": "",
}  # fmt: skip


def sent(value):
    return json.dumps(value).encode()


@pytest.mark.parametrize("machine", ["pledge", "tremaux", "explorer"])
def test_what_a_shipped_machine_says_is_of_the_published_form_and_survives(machine):
    mission = prepare(machine, load_profile())
    told = json.loads(json.dumps(network_head(run_head(mission, None), Drawings(mission.machine))))
    jsonschema.Draft202012Validator(machine_schema()).validate(told)
    assert read_machine(sent(told)) == told
    assert remote_head(told)["model"] == json.loads(json.dumps(model_json(mission.machine.model, mission.parameters)))


def test_a_tick_is_kept_and_what_a_newer_machine_says_besides_is_left_out():
    assert read_tick(b"{}") == {}
    assert read_tick(sent({**TICK, "mood": "fine", "paused": "an operator"})) == {**TICK, "paused": "an operator"}


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"tick": "3"}, "`tick` must be a whole number"),
        ({"tick": None}, "`tick`"),
        ({"stamp": 10**400}, "`stamp`"),
        ({"stamp": -1}, "`stamp` must be at least 0"),
        ({"states": "idle"}, "`states`"),
        ({"states": [7]}, "`states.0` must be a text"),
        ({"pose": [0, 0]}, "`pose`"),
        ({"pose": [0, 0, float("nan")]}, "`pose.2` must be a finite number"),
        ({"variables": {"n": []}}, "`variables.n"),
        ({"variables": {"n": float("inf")}}, "`variables.n"),
        ({"activities": {"idle": "stop"}}, "`activities.idle`"),
        ({"why": [{"transition": 0, "verdict": "perhaps", "reason": ""}]}, "`why.0.verdict`"),
        ({"ended": 7}, "`ended`"),
        ({"doing": "\x1b[2J" * 2**19}, "at most 1048576 are read"),
    ],
    ids=lambda one: str(one)[:40],
)
def test_a_tick_of_another_form_is_refused_with_its_place(change, reason):
    with pytest.raises(ForeignMessageError) as refused:
        read_tick(sent({**TICK, **change}))
    assert reason in str(refused.value)
    assert str(refused.value).isprintable()


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"machine": ""}, "`machine`"),
        ({"states": {}}, "`states`"),
        ({"states": [{**STATE, "parent": "idle"}]}, "before the state around it"),
        ({"states": [STATE, STATE]}, "listed twice"),
        ({"states": [{**STATE, "index": -1}]}, "`states.0.index`"),
        ({"transitions": [{**TRANSITION, "source": "nowhere"}]}, "not a state of it"),
        ({"transitions": [{**TRANSITION, "line": "4"}]}, "`transitions.0.line"),
        ({"page": {**PAGE, "period": 0}}, "`page.period` must be more than 0"),
        ({"page": {**PAGE, "footprint": [[0]]}}, "`page.footprint.0`"),
        ({"page": {**PAGE, "scene": {"walls": [[0, 0, 1, float("inf")]], "doors": [], "exits": []}}}, "`page.scene"),
        ({"page": {**PAGE, "drawings": {"": 7}}}, "`page.drawings.` must be a text"),
    ],
    ids=lambda one: str(one)[:40],
)
def test_a_description_of_another_form_is_refused_with_its_place(change, reason):
    assert read_machine(sent({**MACHINE, "page": PAGE})) == {**MACHINE, "page": PAGE}
    with pytest.raises(ForeignMessageError) as refused:
        read_machine(sent({**MACHINE, **change}))
    assert reason in str(refused.value)


KEYS = st.sampled_from([*TICK, *MACHINE, *STATE])
JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda one: st.lists(one, max_size=3) | st.dictionaries(KEYS, one, max_size=5),
    max_leaves=12,
)


@settings(max_examples=150, deadline=None, derandomize=True)
@given(st.binary(max_size=60) | JSON.map(sent) | st.just(b"[" * 100_000) | st.just(b" " * (LARGEST_TICK + 1)))
def test_any_bytes_are_read_or_refused(message):
    for read in (read_machine, read_tick, read_why):
        try:
            found = read(message)
        except ForeignMessageError:
            continue
        assert isinstance(found, dict)


@settings(max_examples=100, deadline=None, derandomize=True)
@given(st.sampled_from(sorted(TICK)), JSON)
def test_a_tick_with_any_value_in_one_place_is_refused_or_of_the_schema(key, value):
    try:
        found = read_tick(sent({**TICK, key: value}))
    except ForeignMessageError:
        return
    assert set(found) == set(TICK)
    assert json.loads(json.dumps(found, allow_nan=False)) == found


class Impostor:
    """A network on which somebody answers in the name of PICO's machine."""

    def __init__(self, **answers):
        self.network = MemoryNetwork()
        bus = self.network.bus()
        self.publisher = bus.publisher("pico/machine/step")
        for key, answer in answers.items():
            bus.serve(f"pico/machine/{key}", lambda request, answer=answer: request.reply(answer))

    def client(self):
        return RemoteMachine(self.network.bus(), "pico", patience=0.2)


def test_an_answer_that_is_none_is_not_passed_on():
    client = Impostor(operate=b'\xff{"done":', step=b"{}").client()
    assert client.operate(Pause()).reason == "the answer cannot be read"
    assert json.loads(client.ask(b"{}")) == {"done": False, "reason": "the answer cannot be read"}


def test_a_watcher_ends_with_one_message(monkeypatch, capsys):
    impostor = Impostor(model=sent({**MACHINE, "machine": "wait\x1b[2Jing"}), step=sent(TICK))
    client = impostor.client()
    monkeypatch.setattr("maze_machine.remote.reaching.reaching", lambda *_: nullcontext(client))
    steps = iter(({**TICK, "states": ["i\x1bdle"]}, {**TICK, "tick": None}))
    monkeypatch.setattr(client, "steps", lambda _silence: map(read_tick, map(sent, steps)))
    with pytest.raises(ForeignMessageError, match="`tick`"):
        watching.watch("tcp/127.0.0.1:1", None, None, None, 0.1, json=False)
    assert capsys.readouterr().out.splitlines()[0] == "machine wait?[2Jing"


def test_a_debugger_that_watches_says_why_no_more_steps_come(tmp_path):
    file = tmp_path / "waiting.maze-machine"
    text = "machine waiting\nevent go\nstate idle\n    do drive(speed = 0.2 m/s)\n    on go -> idle\n"
    file.write_text(text, encoding="utf-8")
    mission = prepare(str(file), load_profile())
    impostor = Impostor(model=sent(MACHINE), step=sent({**TICK, "states": 7}))
    with pytest.raises(ForeignMessageError):
        impostor.client().newest_step()
    driving = {"idle": {"text": "drive(speed = 0.2 m/s)", "arguments": {"speed": "20 cm/s"}}, "gone": TICK_ACTIVITY}
    good = Impostor(model=sent(MACHINE), step=sent({**TICK, "activities": driving, "fired": [0, 99]}))
    run = RemoteRun(Chart(mission.machine, mission.library), good.client(), lambda: None)
    assert run.advance()
    assert run.steps[0].performed(0) == [Performed("drive", (0.2,))]
    assert run.steps[0].transitions(0) == (0,)
    good.publisher.put(sent({**TICK, "states": 7}))
    assert not run.advance()
    assert "`states`" in run.over
