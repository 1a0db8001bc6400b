"""Events that are deferred, variables that are exposed, machines that send each other events."""

import json
from textwrap import dedent

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import hsm
from hsm.dsl import check_file, check_text
from hsm.dsl.format.formatter import format_text
from hsm.engine.monitoring import Monitor
from hsm.engine.occurrences import event_text
from hsm.interchange.scxml import differences
from hsm.model.chart import Defer
from hsm.model.unparse import action_text, trigger_text
from hsm.testing.generation.generating import generate
from hsm.testing.mutation.mutating import mutants
from hsm.testing.proofs.proving import check
from hsm.testing.scenarios.reading import parse_suite
from hsm.testing.scenarios.running import run_scenario
from hsm.testing.scenarios.writing import Writer

LIBRARY = hsm.Library("talk")


@LIBRARY.signal("near")
def is_near(facts: dict) -> bool:
    """What the test says."""
    return bool(facts.get("near"))


@LIBRARY.activity("drive", outcomes=("blocked",), holds=("base",))
class Drive:
    """Drive on."""

    def tick(self, facts):
        """What it is told to do."""
        return hsm.Outcome("blocked") if facts.get("blocked") else "driving"


def start(text, facts=None):
    checked = check_text(text, LIBRARY, "talk.maze-machine")
    assert checked.model is not None, checked.diagnostics
    return hsm.build(checked.model).start(facts=facts)


def codes(text):
    return [one.code for one in check_text(text, LIBRARY, "talk.maze-machine").diagnostics]


def machine_of(folder, name, **texts):
    for one, text in texts.items():
        (folder / f"{one}.maze-machine").write_text(dedent(text))
    checked = check_file(folder / f"{name}.maze-machine", LIBRARY)
    assert checked.model is not None, checked.diagnostics
    return hsm.build(checked.model)


# Deferred events.

OVEN = """machine oven
event open, dish(number : int), rest
var served : int = 0
var last : int = 0
state busy
    defer dish if served < 9
    on rest -> idle
    after 1 s -> idle
state idle
    on dish -> busy / served += 1, last = dish.number
    on open -> over
final over
"""


def test_a_deferred_event_happens_once_another_state_is_active():
    run = start(OVEN)
    step = run.step(0.1, ["dish(1)", "dish(2)", "open"])
    assert step.deferred == ("dish", "dish")
    assert step.handled == ()
    assert step.ignored == ("open",)
    step = run.step(0.2, ["rest"])
    # The first is taken at once; that enters `busy`, where the second is deferred again.
    assert (run.variables["served"], run.variables["last"]) == (1, 1)
    assert step.handled == ("rest", "dish")
    assert step.deferred == ("dish",)
    run.step(1.3)
    assert (run.variables["served"], run.variables["last"]) == (2, 2)


def test_what_was_deferred_comes_before_what_comes_next():
    run = start(OVEN)
    run.step(0.1, ["dish(1)"])
    run.step(0.2, ["rest", "dish(7)"])
    assert run.variables["last"] == 1


def test_a_snapshot_holds_what_is_deferred():
    run = start(OVEN)
    run.step(0.1, ["dish(4)", "dish(5)"])
    saved = json.loads(json.dumps(run.snapshot()))
    assert saved["deferred"] == ["dish(number = 4)", "dish(number = 5)"]
    other = run.machine.restore(saved)
    assert other.step(0.2, ["rest"]) == run.step(0.2, ["rest"])
    assert other.snapshot() == run.snapshot()


def test_a_guard_of_defer_is_asked_when_the_event_comes():
    run = start(OVEN.replace("served < 9", "served < 1"))
    assert run.step(0.1, ["dish(1)"]).deferred == ("dish",)
    run.step(0.2, ["rest"])
    assert run.step(0.3, ["dish(2)"]).ignored == ("dish",)


def test_an_inner_state_defers_what_the_states_around_would_take():
    text = "machine m\nevent go, next\nstate outer\n    on go -> over\n    state one\n        defer go\n"
    run = start(text + "        on next -> two\n    state two\n        stay\nfinal over\n")
    run.step(0.1, ["go"])
    assert run.configuration == {"outer", "one"}
    run.step(0.2, ["next"])
    assert run.outcome == "over"


def test_an_event_that_another_region_takes_is_not_deferred():
    text = "machine m\nevent go, next\nvar n : int = 0\nparallel both\n    state one\n        defer go\n"
    run = start(text + "        on next -> one\n    state two\n        on go / n += 1\n")
    step = run.step(0.1, ["go"])
    assert step.handled == ("go",)
    assert step.deferred == ()
    run.step(0.2, ["next"])
    assert run.variables["n"] == 1


def test_everything_can_be_deferred_but_not_without_end():
    text = "machine m\nevent go, stop\nstate one\n    defer *\n    after 1 s -> two\n"
    run = start(text + "state two\n    on stop -> over\nfinal over\n")
    assert run.step(0.1, ["go", "stop", "go"]).deferred == ("go", "stop", "go")
    for _ in range(2):
        with pytest.raises(hsm.MachineFault, match="more than 1000 events are deferred"):
            run.step(0.2, ["go"] * 1000)
    run.step(1.0)
    assert run.outcome == "over"


@pytest.mark.parametrize(
    ("line", "code"),
    [
        ("defer nothing", "E0203"),
        ("defer blocked", "E0203"),
        ("defer done", "E0203"),
        ("defer go -> a", "E0101"),
        ("defer", "E0101"),
        ("defer go\n    on go -> b", "W0503"),
    ],
)
def test_mistakes_with_defer(line, code):
    text = f"machine m\nevent go\nstate a\n    do drive()\n    {line}\n    on blocked -> b\nstate b\n    on go -> a\n"
    assert code in codes(text)


def test_defer_is_written_as_it_is_read():
    trigger = start(OVEN).machine.model.transitions[0].trigger
    assert isinstance(trigger, Defer)
    assert trigger_text(trigger) == "defer dish"
    assert "    defer dish if served < 9\n" in format_text(OVEN)


def test_generated_tests_and_scxml_know_defer():
    machine = start(OVEN.replace(" if served < 9", "")).machine
    found = generate(machine)
    assert found.unreached == ()
    for scenario in parse_suite(Writer(machine.model).suite(found.scenarios), machine.model, LIBRARY).scenarios:
        assert run_scenario(scenario, machine, 0.1).passed
    assert "deferr" in " ".join(one.message for one in differences(machine.model))


# What an instance exposes.

DOOR = """
machine door
event knock, quit
param most : int = 2
var rings : int = 0
var seen : bool = false
expose rings
state waiting
    on knock / rings += 1, seen = true
    when rings > most and seen -> opened
    on quit -> shut
final opened
final shut
"""
HOUSE = """
machine house
import door
event knock, quit, leave
var total : int = 0
define loud = front.rings > 1
initial outside
state outside
    on leave -> front
    on knock if front.rings == 0 and front.outcome == none / total += 100
state front = door(most = 3)
    on opened -> inside / total += front.rings
    on shut -> outside
    on leave if loud -> outside
state inside
    when front.outcome == opened and front.rings == 4 -> over
final over
"""


def test_what_an_instance_exposes_can_be_read_before_during_and_after(tmp_path):
    run = machine_of(tmp_path, "house", door=DOOR, house=HOUSE).start()
    run.step(0.1, ["knock"])
    assert run.variables["total"] == 100
    assert run.variables["front.rings"] == 0
    run.step(0.2, ["leave", "knock", "leave"])
    assert "front" in run.configuration
    run.step(0.3, ["knock", "leave"])
    assert run.configuration == {"outside"}
    run.step(0.4, ["leave"])
    assert run.variables["front.rings"] == 0
    other = run.machine.restore(json.loads(json.dumps(run.snapshot())))
    for one in (run, other):
        one.step(0.5, ["knock"] * 4)
        assert one.outcome == "over"
        assert one.variables["total"] == 104
        assert one.variables["front.outcome"] == "opened"


def test_an_instance_within_an_instance_is_exposed_step_by_step(tmp_path):
    street = (
        "machine street\nimport house\nevent leave\nstate h = house()\n    on over -> b\n    when {} -> b\nfinal b\n"
    )
    texts = {"door": DOOR, "house": HOUSE.replace("define loud", "expose front.rings, total\ndefine loud")}
    run = machine_of(tmp_path, "street", **texts, street=street.format("h.front.rings > 1 and h.total == 0")).start()
    run.step(0.1, ["leave", "knock", "knock"])
    assert run.outcome == "b"
    (tmp_path / "street.maze-machine").write_text(street.format("h.front.seen"))
    assert "E0202" in [one.code for one in check_file(tmp_path / "street.maze-machine", LIBRARY).diagnostics]


@pytest.mark.parametrize(
    ("old", "new", "code"),
    [
        ("front.rings == 0", "front.seen", "E0202"),
        ("total += 100", "front.rings = 0", "E0304"),
        ("front.outcome == none", "front.outcome == ajar", "E0202"),
        ("front.outcome == none", "front.outcome == 3", "E0302"),
        ("var total : int = 0", "var total : int = front.rings", "E0202"),
    ],
)
def test_mistakes_with_what_is_exposed(tmp_path, old, new, code):
    (tmp_path / "door.maze-machine").write_text(DOOR)
    assert old in HOUSE
    (tmp_path / "house.maze-machine").write_text(HOUSE.replace(old, new))
    assert code in [one.code for one in check_file(tmp_path / "house.maze-machine", LIBRARY).diagnostics]


@pytest.mark.parametrize(
    ("line", "code"),
    [
        ("expose most", "E0202"),
        ("expose ring", "E0202"),
        ("expose rings, rings", "E0209"),
        ("expose rings\nvar late : int = most\nexpose late", "E0303"),
        ("state x\n    expose rings", "E0402"),
    ],
)
def test_mistakes_with_expose(line, code):
    assert code in codes(DOOR.replace("expose rings", line))


# Machines that send each other events.

WALKER = """
machine walker

event claim(key : int), granted

param key : int
var waits : int = 0
expose waits

initial outside

state outside
    do drive()
    on claim / send granted
    when near  -> asking
    on blocked -> gone

state asking
    entry / send claim(key)
    on claim if claim.key > key / send granted
    defer claim
    on granted -> inside
    every 0.5 s / waits += 1

state inside
    defer claim
    do drive()
    on blocked -> gone

state gone
    entry / send granted
    on claim / send granted
    after 1 s -> over

final over
"""
PAIR = """
machine pair

import walker

property apart : never in(red.inside) and in(blue.inside)
property few : always red.waits <= 3

parallel both
    when red.outcome == over and blue.outcome == over -> finished
    member red = walker(key = 1)
    member blue = walker(key = 2)

final finished
"""


def test_what_is_sent_is_part_of_the_step(tmp_path):
    walker = machine_of(tmp_path, "walker", walker=WALKER)
    run = walker.start({"key": 7}, facts={})
    step = run.step(0.1, ["claim(3)"], {"near": True})
    assert step.sent == ("granted", hsm.Occurrence("claim", {"key": 7}))
    assert run.step(0.2, [], {}).sent == ()
    assert action_text(walker.model.transitions[0].actions[0]) == "send granted"


def test_members_have_their_own_signals_and_events(tmp_path):
    pair = machine_of(tmp_path, "pair", walker=WALKER, pair=PAIR)
    assert pair.model.members == ("red", "blue")
    assert {"red.claim", "blue.claim", "red.granted", "blue.granted"} <= pair.model.events
    assert {one.event for one in pair.model.event_data} == {"red.claim", "blue.claim"}
    facts = {"red": {"near": True}, "blue": {}}
    run = pair.start(facts=facts)
    run.step(0.1, [], facts)
    assert {"red.asking", "blue.outside"} <= run.configuration
    assert run.act(facts) == [("blue.outside", "driving")]
    run.step(0.2, [], facts)  # blue hears the claim, and grants it
    run.step(0.3, [], facts)  # red receives that
    assert {"red.inside", "blue.outside"} <= run.configuration


def test_a_snapshot_between_sending_and_hearing(tmp_path):
    pair = machine_of(tmp_path, "pair", walker=WALKER, pair=PAIR)
    facts = {"red": {"near": True}, "blue": {}}
    run = pair.start(facts=facts)
    run.step(0.1, [], facts)
    saved = json.loads(json.dumps(run.snapshot()))
    assert [one[1] for one in saved["sent"]] == ["blue.claim(key = 1)"]
    other = pair.restore(saved)
    for time in (0.2, 0.3, 0.4):
        assert other.step(time, [], facts) == run.step(time, [], facts)


def _apart(machine, keys, histories):
    """The same machines, each in a run of its own, that hand over what was sent with the next step."""
    runs = {name: machine.start({"key": key}, facts={}) for name, key in keys.items()}
    inbox = {name: [] for name in runs}
    found = []
    for number, facts in enumerate(histories, 1):
        steps = {}
        for name, run in runs.items():
            steps[name] = run.step(0.1 * number, inbox[name], facts[name])
            run.act(facts[name])
        for name in runs:
            others = [step for other, step in steps.items() if other != name]
            inbox[name] = [event_text(machine.model, one) for step in others for one in step.sent]
        found.append({f"{name}.{state}" for name, run in runs.items() for state in run.configuration})
    return found


@given(st.lists(st.tuples(*[st.booleans()] * 4), min_size=1, max_size=25))
@settings(max_examples=60, deadline=None)
def test_together_and_apart_they_do_the_same(tmp_path_factory, history):
    folder = tmp_path_factory.mktemp("pair", numbered=True)
    walker = machine_of(folder, "walker", walker=WALKER)
    pair = machine_of(folder, "pair", walker=WALKER, pair=PAIR)
    histories = [{"red": {"near": a, "blocked": b}, "blue": {"near": c, "blocked": d}} for a, b, c, d in history]
    run = pair.start(facts={"red": {}, "blue": {}})
    monitor = Monitor(run)
    separate = _apart(walker, {"red": 1, "blue": 2}, histories)
    for number, (facts, apart) in enumerate(zip(histories, separate, strict=True), 1):
        step = run.step(0.1 * number, [], facts)
        run.act(facts)
        if run.outcome is not None:
            break
        assert {one for one in run.configuration if "." in one} == apart
        assert not [one for one in monitor.look(facts, step) if one.property.name == "apart"]


def test_the_product_is_decided(tmp_path):
    pair = machine_of(tmp_path, "pair", walker=WALKER, pair=PAIR)
    found = {one.name: one for one in check(pair, seconds=5)}
    assert found["few"].violated
    scenario = found["few"].counterexample
    text = Writer(pair.model).suite([scenario])
    assert "given red.near, blue.near" in text
    (again,) = parse_suite(text, pair.model, LIBRARY).scenarios
    assert run_scenario(again, pair, 0.1).passed
    assert found["apart"].proved


def test_the_product_shows_where_the_protocol_is_wrong(tmp_path):
    wrong = WALKER.replace("    on claim if claim.key > key / send granted\n", "    on claim / send granted\n")
    pair = machine_of(tmp_path, "pair", walker=wrong, pair=PAIR)
    assert {one.name: one for one in check(pair, seconds=5)}["apart"].violated


def test_the_file_around_members_hears_and_sends(tmp_path):
    referee = """
        machine referee
        import walker
        event granted, claim(key : int)
        var claims : int = 0
        parallel both
            on claim / claims += claim.key
            when claims > 2 -> over / send granted
            member red = walker(key = 1)
            member blue = walker(key = 2)
        final over
    """
    run = machine_of(tmp_path, "referee", walker=WALKER, referee=referee).start(facts={"red": {}, "blue": {}})
    facts = {"red": {"near": True}, "blue": {"near": True}}
    run.step(0.1, [], facts)
    step = run.step(0.2, [], facts)
    assert run.outcome == "over"
    assert run.variables["claims"] == 3
    assert step.sent[-1] == "granted"


@pytest.mark.parametrize(
    ("old", "new", "code"),
    [
        ("parallel both", "state both", "E0402"),
        ("red = walker(key = 1)", "red = walker()", "E0212"),
        ("in(red.inside)", "in(red.nowhere)", "E0201"),
        ("always red.waits <= 3", "never near", "E0202"),
        ("always red.waits <= 3", "never red.near and in(blue.inside)", None),
    ],
)
def test_mistakes_with_members(tmp_path, old, new, code):
    (tmp_path / "walker.maze-machine").write_text(WALKER)
    assert old in PAIR
    (tmp_path / "pair.maze-machine").write_text(PAIR.replace(old, new))
    found = [one.code for one in check_file(tmp_path / "pair.maze-machine", LIBRARY).diagnostics]
    assert code in found if code else not [one for one in found if one.startswith("E")]


def test_a_machine_with_members_is_no_part_of_another(tmp_path):
    outer = "machine outer\nimport pair\nstate a = pair()\n    on finished -> b\nfinal b\n"
    for name, text in {"walker": WALKER, "pair": PAIR, "outer": outer}.items():
        (tmp_path / f"{name}.maze-machine").write_text(text)
    found = check_file(tmp_path / "outer.maze-machine", LIBRARY).diagnostics
    assert "E0208" in [one.code for one in found]


@pytest.mark.parametrize(
    ("line", "passes"),
    [
        ("sent grant", None),
        ("sent granted", True),
        ("not sent claim", True),
        ("sent claim", False),
        ("sent claim(3)", None),
    ],
)
def test_scenarios_expect_what_is_sent(tmp_path, line, passes):
    machine = machine_of(tmp_path, "walker", walker=WALKER)
    text = f"test walker\nscenario one\n    given key = 1\n    when event claim(2)\n    expect {line}\n"
    if passes is None:
        with pytest.raises(hsm.MachineError):
            parse_suite(text, machine.model, LIBRARY)
        return
    (scenario,) = parse_suite(text, machine.model, LIBRARY).scenarios
    assert run_scenario(scenario, machine, 0.1).passed is passes


def test_generated_tests_expect_what_is_sent(tmp_path):
    machine = machine_of(tmp_path, "walker", walker=WALKER.replace("param key : int", "param key : int = 5"))
    text = Writer(machine.model).suite(generate(machine).scenarios)
    assert "sent claim" in text
    assert "sent granted" in text
    for scenario in parse_suite(text, machine.model, LIBRARY).scenarios:
        assert run_scenario(scenario, machine, 0.1).passed


def test_generated_tests_notice_what_is_not_deferred():
    machine = start(OVEN.replace(" if served < 9", "")).machine
    scenarios = generate(machine).scenarios
    (dropped,) = [one for one in mutants(machine.model) if one.kind == "dropped defer"]
    mutated = hsm.build(dropped.model)
    assert not all(run_scenario(one, mutated, 0.1).passed for one in scenarios)


@pytest.mark.parametrize(
    ("line", "code"),
    [("send nothing", "E0203"), ("send claim", "E0212"), ("send claim(1 m)", "E0301"), ("send granted(1)", "E0213")],
)
def test_mistakes_with_send(line, code):
    assert code in codes(WALKER.replace("entry / send granted", f"entry / {line}"))
