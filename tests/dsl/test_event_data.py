"""Events that carry data, and choices between values: what they mean, and what is said of mistakes."""

import json
from enum import StrEnum

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import hsm
from hsm.dsl import check_text
from hsm.dsl.format.formatter import format_text
from hsm.engine.occurrences import checked_events, event_text
from hsm.interchange.scxml import differences, write_text
from hsm.model.expressions import Choice, EventValue
from hsm.model.unparse import action_text, expression_text, trigger_text
from hsm.testing.generation.generating import generate
from hsm.testing.mutation.mutating import mutants
from hsm.testing.proofs.proving import check
from hsm.testing.scenarios.reading import parse_suite
from hsm.testing.scenarios.running import run_scenario
from hsm.testing.scenarios.writing import Writer


class Side(StrEnum):
    """Where a door is."""

    LEFT = "left"
    RIGHT = "right"


LIBRARY = hsm.Library("lift")
LIBRARY.event("weighed", "the scales have settled", data={"weight": float, "side": Side})


@LIBRARY.signal("dark")
def is_dark(facts: object) -> bool:
    """What the test says."""
    return bool(facts)


LIFT = """machine lift

event floor(number : int, express : bool), stop
event moved(by : length), home(number : int)

var target : int = 0
var height : length = 0 m
var side : Side = left

initial waiting

state waiting
    on floor if floor.number > target or floor.express -> going / target = floor.number
    on moved                                                    / height += moved.by
    on weighed if weighed.weight < 100.0                        / side = weighed.side
    on home if home.number < target and side == left   -> going / target = home.number

state going
    on floor if floor.number != target / target = max(target, floor.number), raise moved(floor.number * 3 m)
    on moved if height < 99 m          / height = moved.by if moved.by < 30 m else 30 m
    on stop -> waiting / raise home(target - 1) after 2 s
"""


def checked(text, file="lift.maze-machine"):
    found = check_text(text, LIBRARY, file)
    assert found.model is not None, found.diagnostics
    return found.model


def start(text=LIFT):
    return hsm.build(checked(text)).start()


def codes(text):
    return [one.code for one in check_text(text, LIBRARY, "lift.maze-machine").diagnostics]


# What they mean.


def test_a_guard_and_an_action_read_what_the_event_carries():
    run = start()
    step = run.step(0.1, ["floor(0, false)"])
    assert step.ignored == ("floor",)
    step = run.step(0.2, ["floor(number = 4, express = false)"])
    assert step.handled == ("floor",)
    assert run.configuration == {"going"}
    assert run.variables["target"] == 4


def test_the_text_and_the_value_are_the_same_event():
    one, other = start(), start()
    one.step(0.1, ["floor(7, true)", "moved(50 cm)", "weighed(2.5, right)"])
    events = [hsm.Occurrence("floor", {"express": True, "number": 7}), hsm.Occurrence("moved", {"by": 0.5})]
    other.step(0.1, [*events, hsm.Occurrence("weighed", {"weight": 2.5, "side": "right"})])
    assert dict(one.variables) == dict(other.variables) == {"target": 7, "height": 0.5, "side": "left"}


def test_a_member_of_the_registrys_enumeration_is_the_member_itself():
    run = start()
    run.step(0.1, ["weighed(20, right)"])
    assert run.variables["side"] is Side.RIGHT


def test_what_is_raised_carries_its_values_and_each_event_its_own():
    run = start()
    run.step(0.1, ["floor(2, true)", "floor(5, false)", "floor(3, false)"])
    assert run.variables["target"] == 5
    assert run.variables["height"] == pytest.approx(9.0)


def test_what_is_raised_later_carries_the_values_of_that_moment():
    run = start()
    run.step(0.1, ["floor(6, false)", "stop", "floor(9, true)", "stop"])
    other = run.machine.restore(json.loads(json.dumps(run.snapshot())))
    for one in (run, other):
        one.step(2.2)
        assert one.variables["target"] == 5  # `home(8)` is on its way behind it, and comes too late
        assert one.configuration == {"going"}


def test_nothing_is_known_of_an_event_once_it_was_handled():
    run = start()
    step = run.step(0.1, ["floor(4, false)"])
    assert set(run.variables) == {"target", "height", "side"}
    assert all("floor" not in name for name in run.snapshot()["variables"])
    assert step.considered[0].values == (("floor.number", 4), ("target", 0))


def test_a_handled_fault_ends_with_the_event_forgotten():
    text = LIFT.replace("target = floor.number", "target = floor.number * 922337203685477580 * 10", 1)
    text = text.replace("    on moved  ", "    on fault / target = -1\n    on moved  ", 1)
    run = start(text)
    run.step(0.1, ["floor(4, false)"])
    assert run.variables["target"] == -1
    assert run.configuration == {"waiting"}


def test_events_of_imported_machines_carry_the_same(tmp_path):
    inner = (
        "machine inner\nevent floor(number : int)\nvar seen : int = 0\nstate a\n    on floor / seen = floor.number\n"
    )
    (tmp_path / "inner.maze-machine").write_text(inner + "    on floor if floor.number > 9 -> b\nfinal b\n")
    outer = "machine outer\nimport inner\nvar n : int = 0\nparallel both\n    on floor / n = floor.number\n"
    outer += "    state one = inner()\n        on b -> over\n    state two\n        stay\nfinal over\n"
    (tmp_path / "outer.maze-machine").write_text(outer.replace("    on floor / n", "    on floor if in(two) / n"))
    machine = hsm.load(tmp_path / "outer.maze-machine", LIBRARY)
    run = machine.start()
    run.step(0.1, ["floor(3)"])
    assert run.variables["one.seen"] == 3
    other = "machine outer\nimport inner\nevent floor(number : number)\nstate a = inner()\n    on b -> c\nfinal c\n"
    (tmp_path / "outer.maze-machine").write_text(other)
    with pytest.raises(hsm.MachineError, match="is declared elsewhere with other data"):
        hsm.load(tmp_path / "outer.maze-machine", LIBRARY)


# What Python gives.


@pytest.mark.parametrize(
    ("event", "error", "message"),
    [
        ("floor", ValueError, "carries .number : int, express : bool.; `number` is missing"),
        ("floor(1)", ValueError, "`express` is missing"),
        ("floor(1, 2)", ValueError, "`2` is not a value for `express : bool` of event `floor`"),
        ("floor(1.5, true)", ValueError, "`number : int` of event `floor`: write a whole number"),
        ("floor(1, true, 3)", ValueError, "carries 2 values, not more"),
        ("floor(1, number = 2)", ValueError, "given twice"),
        ("floor(level = 1, express = true)", ValueError, "`level` is not part of it"),
        ("floor(99999999999999999999, true)", ValueError, "write a whole number"),
        ("moved(3 s)", ValueError, "write a number and one of m, cm, mm"),
        ("moved(nan)", ValueError, "write a number"),
        ("moved(1e999)", ValueError, "this number is too large"),
        ("weighed(1, up)", ValueError, "one of left, right"),
        ("stop(3)", ValueError, "event `stop` has no data"),
        ("flor(3)", ValueError, "no event `flor` is declared"),
        ("floor(3", ValueError, "no event"),
        (hsm.Occurrence("moved", {"by": float("nan")}), ValueError, "`by` of event `moved` cannot be nan"),
        (hsm.Occurrence("moved", {"by": "far"}), TypeError, "a number, its length in m, not 'far'"),
        (hsm.Occurrence("floor", {"number": True, "express": True}), TypeError, "a whole number, not True"),
        (hsm.Occurrence("floor", {"number": 2**63, "express": True}), ValueError, "cannot be 9223372036854775808"),
        (hsm.Occurrence("moved"), ValueError, "`by` is missing"),
        (("floor", 3), TypeError, "an event is a text or an Occurrence"),
    ],
)
def test_what_an_event_cannot_carry(event, error, message):
    run = start()
    before = run.snapshot()
    with pytest.raises(error, match=message):
        run.step(0.1, ["stop", event])
    assert run.snapshot() == before


@given(
    number=st.integers(-(2**63), 2**63 - 1),
    express=st.booleans(),
    by=st.floats(allow_nan=False, allow_infinity=False),
    side=st.sampled_from(["left", "right"]),
)
@settings(max_examples=50, deadline=None)
def test_an_event_reads_back_from_its_text(number, express, by, side):
    model = checked(LIFT)
    for one in (
        hsm.Occurrence("floor", {"number": number, "express": express}),
        hsm.Occurrence("moved", {"by": by}),
        hsm.Occurrence("weighed", {"weight": by, "side": side}),
    ):
        assert checked_events(model, [event_text(model, one)]) == [one]


@given(
    st.lists(
        st.one_of(
            st.just("stop"),
            st.builds("floor({}, {})".format, st.integers(-2, 12), st.sampled_from(["true", "false"])),
            st.builds("moved({} m)".format, st.integers(0, 40)),
        ),
        max_size=12,
    )
)
@settings(max_examples=50, deadline=None)
def test_a_restored_run_goes_on_the_same(events):
    machine = hsm.build(checked(LIFT))
    run, split = machine.start(), len(events) // 2
    for number, event in enumerate(events[:split]):
        run.step(0.5 * number, [event])
    other = machine.restore(json.loads(json.dumps(run.snapshot())))
    for number, event in enumerate(events[split:], split):
        assert run.step(0.5 * number, [event]) == other.step(0.5 * number, [event])
        assert run.snapshot() == other.snapshot()


def test_reload_refuses_what_is_on_its_way_and_no_longer_fits():
    run = start()
    run.step(0.1, ["floor(6, false)", "stop"])
    changed = LIFT.replace("home(number : int)", "home(number : int, soon : bool)").replace(
        "home(target - 1)", "home(1, true)"
    )
    with pytest.raises(hsm.SnapshotError, match=r"pending event `home\(number = 5\)`"):
        run.reload(hsm.build(checked(changed)))


# Mistakes.


@pytest.mark.parametrize(
    ("old", "new", "code"),
    [
        ("moved.by < 30 m", "floor.number < 3", "E0202"),
        ("height += moved.by", "height += moved.bye", "E0202"),
        ("height += moved.by", "height = moved.by * 2 s", "E0301"),
        ("on stop -> waiting", "on stop, moved -> waiting / height = moved.by\n    on stop -> waiting", "E0202"),
        ("moved(by : length)", "moved(by : size)", "E0206"),
        ("moved(by : length)", "moved(by : length, by : length)", "E0209"),
        ("moved(by : length)", "moved(b.y : length)", "E0211"),
        ("moved(by : length)", "moved(by : length), moved(by : length)", "E0209"),
        ("raise moved(floor.number * 3 m)", "raise moved", "E0212"),
        ("raise moved(floor.number * 3 m)", "raise moved(3)", "E0301"),
        ("raise moved(floor.number * 3 m)", "raise moved(1 m, 2 m)", "E0213"),
        ("raise moved(floor.number * 3 m)", "raise moved(far = 1 m)", "E0210"),
        ("raise moved(floor.number * 3 m)", "raise stop(3)", "E0213"),
        ("event moved(by", "event weighed(weight : int)\nevent moved(by", "E0209"),
        ("event moved(by", "define far = moved.by > 1 m\nevent moved(by", "W0606"),
        ("event moved(by", "property p : never moved.by > 1 m\nevent moved(by", "E0202"),
    ],
)
def test_mistakes_with_what_an_event_carries(old, new, code):
    assert old in LIFT
    assert code in codes(LIFT.replace(old, new))


def test_a_definition_knows_no_event():
    text = LIFT.replace("moved.by < 30 m", "far")
    assert "E0202" in codes(text.replace("var target", "define far = moved.by < 30 m\nvar target"))


def test_the_example_has_no_findings():
    assert [one for one in codes(LIFT) if one != "N0601"] == []


# Choices.


@pytest.mark.parametrize(
    ("expression", "value", "dark"),
    [
        ("1 if dark else 2", 1, True),
        ("1 if dark else 2", 2, False),
        ("1 if dark else 2 if n > 3 else 5", 5, False),
        ("(1 if dark else 2) + n * 10", 2, False),
        ("n if not dark and n > 0 else -n", 0, True),
        ("7 if true else 2", 7, False),
    ],
)
def test_a_choice_of_numbers(expression, value, dark):
    run = start(f"machine m\nevent go\nvar n : int = 0\nstate a\n    on go / n = {expression}\n")
    run.step(0.1, ["go"], dark)
    assert run.variables["n"] == value


def test_a_choice_evaluates_only_what_is_chosen():
    text = "machine m\nevent go\nvar n : number = 0\nvar m : number = 0\nstate a\n"
    run = start(f"{text}    on go / n = 1 / m if m > 0 else -1\n")
    run.step(0.1, ["go"])
    assert run.variables["n"] == -1


def test_a_choice_of_conditions_is_made_of_conditions():
    model = checked("machine m\nvar n : int = 0\nstate a\n    when ((n > 1) if dark else (n < 1)) -> b\nfinal b\n")
    assert trigger_text(model.transitions[0].trigger) == "when dark and n > 1 or not dark and n < 1"


def test_a_choice_is_written_as_it_is_read():
    text = "machine m\nvar n : int = 0\nevent go\nstate a\n    on go if (n if dark else 1) > 0"
    model = checked(f"{text} / n = 2 * (n if dark else 1) - (1 if n > 2 or dark else 3)\n")
    transition = model.transitions[0]
    assert trigger_text(transition.trigger, transition.guard) == "on go if (n if dark else 1) > 0"
    assert action_text(transition.actions[0]) == "n = 2 * (n if dark else 1) - (1 if n > 2 or dark else 3)"
    assert isinstance(transition.guard.left, Choice)


@pytest.mark.parametrize(
    ("expression", "code"),
    [
        ("1 if 2 else 3", "E0301"),
        ("1 if dark else 3 s", "E0302"),
        ("1 if dark else true", "E0302"),
        ("1 if dark", "E0101"),
    ],
)
def test_mistakes_in_choices(expression, code):
    assert code in codes(f"machine m\nevent go\nvar n : int = 0\nstate a\n    on go / n = {expression}\n")


def test_the_checks_look_into_choices():
    lines = "machine m\nvar n : int = 0\nvar up : bool = false\nstate a\n    when (n if dark else 5) > 3 -> b\n"
    assert "W0506" in codes(lines.replace("(n if dark else 5) > 3", "(2 if dark else 3) > 3") + "final b\n")
    assert "W0503" in codes(lines + "    when not dark -> c\nfinal b\nfinal c\n")


# The tools.

SPACED = """machine  lift
event floor( number:int ,express : bool ),stop
var n:int=0
state a
    on floor if floor.number>3->b/n=floor.number if floor.express else 0,raise floor( 1,express=true )after 2s
final b
"""


def test_the_formatter_lays_them_out():
    text = format_text(SPACED)
    assert "event floor(number : int, express : bool), stop" in text
    assert "n = floor.number if floor.express else 0, raise floor(1, express = true) after 2 s" in text
    assert format_text(text) == text


def test_generated_tests_send_what_makes_a_difference():
    machine = hsm.build(checked(LIFT))
    found = generate(machine)
    assert [one.text for one in found.unreached] == []
    writer = Writer(machine.model)
    text = writer.suite(found.scenarios)
    assert "event floor(number = " in text
    for scenario in parse_suite(text, machine.model, LIBRARY).scenarios:
        assert run_scenario(scenario, machine, 0.1).passed


@pytest.mark.parametrize(
    ("line", "code"),
    [
        ("when event floor(3, true)", None),
        ("when event floor(number = 3, express = true)", None),
        ("when event floor", "E0212"),
        ("when event floor(3)", "E0212"),
        ("when event floor(3, 4)", "E0301"),
        ("when event floor(dark, true)", "E0301"),
        ("when event stop(3)", "E0213"),
    ],
)
def test_scenarios_send_events_with_data(line, code):
    text = f"test lift\nscenario one\n    {line}\n    expect going, target == 3\n"
    model = checked(LIFT)
    if code is None:
        (scenario,) = parse_suite(text, model, LIBRARY).scenarios
        assert run_scenario(scenario, hsm.build(model), 0.1).passed
        return
    with pytest.raises(hsm.MachineError) as caught:
        parse_suite(text, model, LIBRARY)
    assert caught.value.diagnostics[0].code == code


def test_mutants_read_another_part_and_choose_the_other_value():
    text = LIFT.replace("express : bool", "express : bool, other : int").replace("event stop, ", "event stop, ")
    kinds = {one.kind for one in mutants(checked(text))}
    assert {"other part of an event", "swapped choice"} <= kinds


def test_scxml_has_params_for_what_an_event_carries():
    model = checked(LIFT)
    text = write_text(model)
    assert 'cond="_event.data.number &gt; target || _event.data.express"' in text
    assert '<send event="moved" target="#_internal">' in text
    assert '<param name="by" expr="_event.data.number * 3.0" />' in text
    assert differences(model) == []


def test_what_proofs_do_not_follow_is_looked_for():
    stated = "property low : always target >= 0\nproperty high : never height > 200 m\ninitial waiting"
    machine = hsm.build(checked(LIFT.replace("initial waiting", stated)))
    found = {one.name: one for one in check(machine, seconds=5)}
    assert not any(one.proved for one in found.values())
    assert found["low"].violated
    assert "event floor(number = -" in Writer(machine.model).suite([found["low"].counterexample])
    assert "no violation found in" in found["high"].reason


def test_what_a_machine_raises_may_come_from_outside_too():
    text = (
        "machine m\nevent go, late\nproperty quiet : never in(b)\ninitial a\nstate a\n    defer late\n    on go -> b\n"
        "state b\n    stay\nstate c\n    on late -> a / raise go\n"
    )
    quiet = next(one for one in check(hsm.build(checked(text)), seconds=5) if one.name == "quiet")
    assert quiet.violated


def test_who_can_send_an_event_is_said_with_what_it_carries():
    text = "machine m\nevent floor(number : int, up : bool)\nstate a\n    on floor -> b\nfinal b\n"
    note = next(one for one in check_text(text, LIBRARY).diagnostics if one.code == "N0601")
    assert "`maze-machine send 'floor(number = ..., up = ...)'`" in note.suggestion
    assert "`run --event-at '1:floor(number = ..., up = ...)'`" in note.suggestion


def test_a_raised_event_that_carries_something_is_declared():
    text = "machine m\nstate a\n    when true -> b / raise change(3)\nstate b\n    on change -> a\n"
    found = next(one for one in check_text(text, LIBRARY).diagnostics if one.code == "E0213")
    assert (found.message, "event change(NAME : TYPE)" in found.suggestion) == ("event `change` carries no data", True)


def test_expressions_tell_what_they_are():
    model = checked(LIFT)
    guard = model.transitions[0].guard
    assert isinstance(guard.left.left, EventValue)
    assert expression_text(guard) == "floor.number > target or floor.express"
