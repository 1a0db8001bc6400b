"""Parameters that an operator may change while the machine runs."""

import json
import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import hsm
from hsm.dsl import check_text
from hsm.dsl.format.formatter import format_text
from hsm.dsl.lsp.completion import completions
from hsm.dsl.lsp.document import Document
from hsm.engine.occurrences import checked_events, event_text
from hsm.engine.transition import Inputs, transition
from hsm.interchange.reports import model_json
from hsm.interchange.scxml.differences import differences
from hsm.testing.proofs.verdicts import Assumptions
from hsm.testing.scenarios.reading import parse_suite
from hsm.testing.scenarios.running import run_suite
from hsm.testing.scenarios.scenarios import Stimulus
from hsm.testing.scenarios.writing import Writer
from tests.dsl.library import make_library

LIBRARY = make_library()
TEXT = """machine m

event go

param near  : length = 0.5 m, adjustable(0.1 m, 2 m)
param side  : Side   = left, adjustable
param tries : int    = 3, adjustable(0, 10)
param calm  : bool   = true, adjustable
param far   : length = 2 * near

var last : length = 0 m

state a
    on go if tries > 5 -> b / last = near
    when clear(distance = near) and not calm -> b
state b
    on go -> a
"""


def model(text=TEXT):
    checked = check_text(text, LIBRARY, "m.maze-machine")
    assert checked.model is not None, checked.diagnostics
    return checked.model


MACHINE = hsm.build(model())


def codes(text):
    found = check_text(text, LIBRARY, "m.maze-machine").diagnostics
    return [one.code for one in found if one.severity is hsm.Severity.ERROR]


def test_a_new_value_counts_from_the_next_event_of_the_same_step_on():
    run = MACHINE.start()
    run.step(0.1, ["go", "tries = 6", "near = 70 cm", "go"])
    assert run.configuration == {"b"}
    assert (run.variables["tries"], run.variables["last"]) == (6, 0.7)
    assert run.variables["far"] == 1.0  # it followed from `near` at the start


def test_a_new_value_alone_makes_a_condition_hold():
    run = MACHINE.start()
    run.step(0.1, facts=True)
    assert run.step(0.2, [hsm.Adjustment("calm", False)], True).transitions
    assert run.configuration == {"b"}


def test_a_signal_is_asked_with_the_new_value():
    asked = []
    library = hsm.Library("asked")

    @library.signal("free")
    def free(facts: float, distance: float = 1.0) -> bool:
        """Whether a distance is free."""
        asked.append(distance)
        return facts > distance

    text = "machine m\nparam near : number = 1, adjustable\nstate a\n    when free(near) -> b\nfinal b\n"
    run = hsm.build(check_text(text, library, "m").model).start()
    for number in range(100):  # the quick steps, too
        run.step(0.1 * number, facts=0.5)
    run.step(20, ["near = 0.4"], facts=0.3)
    assert asked[-1] == 0.4
    run.step(21, facts=0.45)
    assert run.outcome == "b"


@pytest.mark.parametrize(
    ("event", "message"),
    [
        ("far = 1 m", "no adjustable parameter `far`; adjustable: near, side, tries, calm"),
        ("last = 1 m", "no adjustable parameter `last`"),
        ("near = 3 m", "takes 0.1 m to 2 m, not 3 m"),
        ("near = 1 s", "is not a value for parameter `near : length`: write a number and one of"),
        ("near = ", "is not a value"),
        ("near = nan", "is not a value"),
        ("near = 1e999", "this number is too large"),
        ("side = up", "is not a value for parameter `side : Side`: one of left, right"),
        ("tries = 11", "takes 0 to 10, not 11"),
        ("tries = 2.5", "write a whole number"),
        ("calm = 1", "write true or false"),
        (" = 1", "no event ` = 1` is declared"),
    ],
)
def test_what_is_not_allowed_is_refused_and_changes_nothing(event, message):
    run = MACHINE.start()
    before = run.snapshot()
    with pytest.raises(ValueError, match=re.escape(message)):
        run.step(0.1, ["tries = 6", event])
    assert run.snapshot() == before


@pytest.mark.parametrize(("value", "error"), [("1", TypeError), (True, TypeError), (float("nan"), ValueError)])
def test_a_value_from_python_is_of_the_parameters_type(value, error):
    with pytest.raises(error):
        MACHINE.start().step(0.1, [hsm.Adjustment("near", value)])


def test_the_bounds_hold_for_the_start_too():
    with pytest.raises(ValueError, match=r"takes 0\.1 m to 2 m, not 5 m"):
        MACHINE.start({"near": 5.0})


ADJUSTMENTS = st.one_of(
    st.builds(hsm.Adjustment, st.just("near"), st.floats(0.1, 2.0)),
    st.builds(hsm.Adjustment, st.just("side"), st.sampled_from(["left", "right"])),
    st.builds(hsm.Adjustment, st.just("tries"), st.integers(0, 10)),
    st.builds(hsm.Adjustment, st.just("calm"), st.booleans()),
)


@given(ADJUSTMENTS)
def test_an_adjustment_reads_back_from_its_text(one):
    assert checked_events(MACHINE.model, [event_text(MACHINE.model, one)]) == [one]


@given(st.lists(st.tuples(st.booleans(), st.lists(st.one_of(st.just("go"), ADJUSTMENTS), max_size=3)), max_size=12))
@settings(max_examples=60, deadline=None)
def test_a_restored_run_and_pure_steps_go_on_the_same(steps):
    run = MACHINE.start()
    pure = json.loads(json.dumps(run.snapshot()))
    for number, (facts, events) in enumerate(steps):
        time = 0.1 * number
        restored = MACHINE.restore(json.loads(json.dumps(run.snapshot())))
        texts = [event_text(MACHINE.model, one) for one in events]
        pure, pure_step = transition(MACHINE, pure, Inputs(time, texts, facts=facts))
        assert run.step(time, events, facts) == restored.step(time, texts, facts) == pure_step
        assert run.snapshot() == restored.snapshot() == pure


def test_a_changed_machine_keeps_the_new_value():
    run = MACHINE.start()
    run.step(0.1, ["near = 1.5 m"])
    run.reload(hsm.build(model(TEXT.replace("tries > 5", "tries > 4"))))
    assert run.variables["near"] == 1.5


def test_a_snapshot_cannot_defer_an_adjustment():
    snapshot = MACHINE.start().snapshot()
    snapshot["deferred"] = ["near = 1.0 m"]
    with pytest.raises(hsm.SnapshotError, match="cannot be deferred"):
        MACHINE.restore(snapshot)


def test_the_parameter_of_an_instance_belongs_to_the_machine_around_it(tmp_path):
    (tmp_path / "m.maze-machine").write_text(TEXT, encoding="utf-8")
    around = "machine outer\nimport m\nparam near : length = 1 m, adjustable\nstate s = m(near = near)\n"
    path = tmp_path / "outer.maze-machine"
    path.write_text(around, encoding="utf-8")
    machine = hsm.build(hsm.dsl.load_model(path, LIBRARY))
    assert [one.parameter for one in machine.model.adjustable] == ["near"]
    run = machine.start()
    run.step(0.1, ["near = 1.5 m"])
    assert run.variables == {**run.variables, "near": 1.5, "s.near": 1.0}
    with pytest.raises(ValueError, match="adjustable: near"):
        run.step(0.2, ["s.near = 1.5 m"])


def test_a_proof_says_that_nobody_adjusts():
    assert "nobody adjusts near, side, tries, calm during the run" in Assumptions().lines(MACHINE.model)
    assert not [one for one in Assumptions().lines(model("machine m\nstate a\n")) if "adjusts" in one]


def test_an_export_names_what_scxml_cannot_adjust():
    reasons = [one.message for one in differences(MACHINE.model) if "operator may change" in one.message]
    assert [re.search("`(.*)`", one)[1] for one in reasons] == ["near", "side", "tries", "calm"]


def test_the_description_has_the_bounds():
    described = model_json(MACHINE.model, {})
    assert described["adjustable"] == {"near": [0.1, 2.0], "side": [None, None], "tries": [0, 10], "calm": [None, None]}


# In scenarios.


def test_a_scenario_changes_them():
    suite = parse_suite(
        "test m\nscenario s\n    when tries = 6, event go\n    expect b, near == 0.5 m\n"
        "    when side = right, not calm\n    expect side == right, not calm\n",
        MACHINE.model,
        LIBRARY,
    )
    assert [one.failure for one in run_suite(suite, MACHINE)] == [None]
    written = Writer(MACHINE.model).stimulus(Stimulus(None, {}, {}, frozenset(), ("tries = 6", "go")))
    assert written == ["    when tries = 6, event go"]


@pytest.mark.parametrize(("line", "code"), [("tries = 60", "E0301"), ("near = 3 s", "E0301"), ("far = 1 m", "E0202")])
def test_a_scenario_with_another_value_is_refused(line, code):
    with pytest.raises(hsm.MachineError) as caught:
        parse_suite(f"test m\nscenario s\n    when {line}\n    expect a\n", MACHINE.model, LIBRARY)
    assert [one.code for one in caught.value.diagnostics] == [code]


# The language.


@pytest.mark.parametrize(
    ("old", "new", "code"),
    [
        ("adjustable(0.1 m, 2 m)", "adjustable(0.1 s, 2 m)", "E0301"),
        ("adjustable(0.1 m, 2 m)", "adjustable(2 m, 0.1 m)", "E0301"),
        ("adjustable(0.1 m, 2 m)", "adjustable(0.6 m, 2 m)", "E0301"),
        ("adjustable(0.1 m, 2 m)", "adjustable(0.1 m, last)", "E0202"),
        ("adjustable(0, 10)", "adjustable(0, 2 * tries)", "E0303"),
        ("adjustable(0.1 m, 2 m)", "adjustable(0.1 m)", "E0101"),
        ("adjustable(0.1 m, 2 m)", "adjustable()", "E0101"),
        ("0.5 m, adjustable(0.1 m, 2 m)", "0.5 m, adjustble", "E0101"),
        ("0.5 m, adjustable(0.1 m, 2 m)", "0.5 m adjustable", "E0101"),
        ("0.5 m, adjustable(0.1 m, 2 m)", "0.5 m,", "E0101"),
        ("left, adjustable", "left, adjustable(left, right)", "E0213"),
        ("0 m\n", "0 m, adjustable\n", "E0101"),
    ],
)
def test_mistakes(old, new, code):
    assert old in TEXT
    assert codes(TEXT.replace(old, new)) == [code]


def test_it_is_laid_out_and_completed():
    text = "machine m\nparam near:length=0.5 m ,adjustable ( 0.1m,2 m )\nparam a:bool,adjustable\nstate a\n"
    assert "param near : length = 0.5 m, adjustable(0.1 m, 2 m)\nparam a    : bool, adjustable\n" in format_text(text)
    document = Document("machine m\nparam near : length = 0.5 m, adj\nstate a\n", "m.maze-machine", LIBRARY)
    assert [one.label for one in completions(document, 1, 32)] == ["adjustable"]
