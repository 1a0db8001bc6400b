"""The rules of the language's page of semantics, each with a machine that would show the opposite."""

import pytest

import hsm
from hsm.dsl import check_text
from hsm.engine.explanation import Verdict

LIBRARY = hsm.Library("rules")
BROKEN = OSError("no data")
DONE = []


@LIBRARY.action("boom")
def boom(facts: object) -> None:
    """Fail."""
    raise BROKEN


@LIBRARY.action("note")
def note(facts: object, number: int = 0) -> None:
    """Note that it was run."""
    DONE.append(number)


@LIBRARY.signal("flag")
def flag(facts: object) -> bool:
    """What the test says."""
    return bool(facts)


@LIBRARY.signal("failing")
def failing(facts: object) -> bool:
    """Fail, if the test says so."""
    if facts:
        raise BROKEN
    return False


def machine(text):
    checked = check_text(text, LIBRARY, "rules.maze-machine")
    assert checked.model is not None, checked.diagnostics
    return hsm.build(checked.model)


@pytest.fixture(autouse=True)
def _forget():
    DONE.clear()


# Completion.

PARALLEL = """
machine m
event a, b
initial p
parallel p
    on done -> over
    state r1
        initial x1
        state x1
            on a -> f1
        final f1
    state r2
        initial x2
        state x2
            on b -> f2
        final f2
final over
"""
COMPOUND = """
machine m
event a, b
initial outer
state outer
    initial inner
    on done -> over
    state inner
        initial i
        state i
            on a -> f
        final f
        on done -> last
    state last
        on b -> end
    final end
final over
"""


@pytest.mark.parametrize(
    ("text", "between"), [(PARALLEL, {"p", "r1", "f1", "r2", "x2"}), (COMPOUND, {"outer", "last"})]
)
def test_a_completion_belongs_to_the_state_that_completed(text, between):
    run = machine(text).start()
    run.step(1.0, ["a"])
    assert run.configuration == between
    run.step(2.0, ["b"])
    assert run.outcome == "over"


def test_the_name_of_a_final_state_goes_outward_and_is_checked():
    text = COMPOUND.replace("        on done -> last\n", "").replace("    on done -> over", "    on f -> over")
    run = machine(text.replace("    state last\n        on b -> end\n    final end\n", "").replace(", b", "")).start()
    run.step(1.0, ["a"])
    assert run.outcome == "over"


def test_a_completion_further_in_does_not_count_as_handled():
    text = COMPOUND.replace("        on done -> last\n", "")
    found = check_text(text, LIBRARY).diagnostics
    assert [(one.code, "`f` of `inner`" in one.message) for one in found if one.code == "W0504"] == [("W0504", True)]


# Faults.

WHERE = {
    "an action of the transition": "state a\n    on go -> b / n = 1, note(1), boom()\n    on fault -> safe\nstate b",
    "around it": "state a\n    state a1\n        on go -> b / n = 1, boom()\n    on fault -> safe\nstate b",
    "at the top": "on fault -> safe\nstate a\n    on go -> b / n = 1, boom()\nstate b",
    "an exit action": "state a\n    on go -> b\n    on fault -> safe\n    exit / n = 1, boom()\nstate b",
    "an entry action": "state a\n    on go -> b\nstate b\n    entry / n = 1, boom()\n    on fault -> safe",
    "an entry action, handled before": (
        "state a\n    on go -> b\n    on fault -> safe\nstate b\n    entry / n = 1, boom()"
    ),
    "an initial action": (
        "state a\n    on go -> b\nstate b\n    initial c / n = 1, boom()\n    on fault -> safe\n    state c"
    ),
    "an assignment": "state a\n    on go -> b / n = 1, x = 1.0 / zero\n    on fault -> safe\nstate b",
    "a condition's action": (
        "state a\n    on go -> b / n = 0\nstate b\n    when true -> a / n = 1, boom()\n    on fault -> safe"
    ),
    "a time-out": "state a\n    after 1 s -> b / n = 1, boom()\n    on fault -> safe\nstate b",
    "a duration": "state a\n    on go -> b / n = 1\nstate b\n    after (1 s / zero) -> a\n    on fault -> safe",
    "the start": "state a\n    entry / n = 1, boom()\n    on fault -> safe",
    "the start, deep": "state a\n    state a1\n        entry / n = 1, boom()\n    on fault -> safe",
}


@pytest.mark.parametrize("where", WHERE)
def test_a_failed_action_is_handled_and_its_microstep_undone(where):
    head = "machine m\nevent go\nvar n : int = 0\nvar x : number = 0.0\nparam zero : number = 0.0\n"
    run = machine(f"{head}{WHERE[where]}\nstate safe\n    stay").start()
    if "start" not in where:
        run.step(1.0, ["go"])
    assert run.configuration == {"safe"}
    assert run.variables["n"] == 0
    assert [1] * (where == "an action of the transition") == DONE  # what was done outside cannot be taken back


def test_events_raised_by_what_was_undone_are_not_heard():
    text = "machine m\nevent go, x\nstate a\n    on go -> b / raise x, boom()\n    on fault -> c\nstate b\nstate c\n"
    run = machine(text + "    on x -> b").start()
    assert run.step(1.0, ["go"]).entered == ("c",)


def test_unhandled_it_leaves_the_machine_as_it_was_before_the_step():
    text = "machine m\nevent go, on_\nvar n : int = 0\nstate a\n    on on_ / n = 1\n    on go -> b / boom()\nstate b"
    run = machine(text).start()
    with pytest.raises(hsm.MachineFault, match="an action failed") as raised:
        run.step(1.0, ["on_", "go"])
    assert raised.value.__cause__ is BROKEN
    assert raised.value.place.line == 6
    assert run.variables["n"] == 0


def test_what_failed_is_not_tried_again_in_the_same_step():
    text = "machine m\nvar n : int = 0\nstate a\n    when true -> b / note(1), boom()\n    on fault / n += 1\nstate b"
    run = machine(text).start()
    run.step(1.0)
    assert DONE == [1]
    run.step(2.0)
    assert DONE == [1, 1]
    assert run.variables["n"] == 2


def test_a_handler_that_fails_is_a_fault_of_the_next_one_out():
    text = "machine m\nevent go\non fault -> safe\nstate a\n    on go -> b / boom()\n"
    text += "    on fault -> b / boom()\nstate b\n"
    run = machine(text + "state safe").start()
    run.step(1.0, ["go"])
    assert run.configuration == {"safe"}


def test_handlers_are_tried_in_order_with_their_guards():
    text = "machine m\nevent go\nvar n : int = 2\nstate a\n    on go -> b / boom()\n    on fault if n < 2 -> b\n"
    run = machine(text + "    on fault -> c\nstate b\nstate c").start()
    run.step(1.0, ["go"])
    assert run.configuration == {"c"}


def test_the_state_of_the_action_comes_before_that_of_the_transition_wherever_they_stand():
    text = "machine m\nevent go\non fault -> c\ninitial a\nstate b\n    entry / boom()\n    on fault -> d\n"
    run = machine(text + "state a\n    on go -> b\n    on fault -> c\nstate c\nstate d").start()
    run.step(1.0, ["go"])
    assert run.configuration == {"d"}


def test_a_fault_while_a_time_out_is_chosen_does_not_lose_what_its_handler_raises():
    text = "machine m\nevent x\nstate a\n    after 1 s if failing -> b\n    on fault -> b / raise x\n"
    run = machine(text + "state b\n    on x -> c\nstate c").start()
    run.step(1.0, facts=True)
    assert run.configuration == {"c"}


DEFERRED = """
machine m
event e, go, leave
parallel p
    on leave -> other
    state r1
        state a
            on * if flag -> b / boom()
            on fault TARGET
        state b
    state r2
        defer e
state other
    on e -> end
final end
"""


def test_a_deferred_event_outlives_the_fault_of_another_region():
    run = machine(DEFERRED.replace("TARGET", "-> b")).start()
    assert run.step(1.0, ["e"], facts=False).deferred == ("e",)
    assert run.step(2.0, ["e"], facts=True).deferred == ("e",)
    run.step(3.0, ["leave"])
    assert run.outcome == "end"


def test_an_undone_microstep_has_moved_nothing():
    run = machine(DEFERRED.replace("TARGET", "/ note(1)")).start()
    run.step(1.0, ["e"], facts=False)
    assert run.step(2.0, ["go"], facts=True).deferred == ()


def test_the_handler_of_a_failed_condition_ends_the_wait_of_deferred_events():
    text = (
        "machine m\nevent e\nstate a\n    defer e\n    when failing -> b\n    on fault -> b\nstate b\n    on e -> c\n"
    )
    run = machine(text + "state c").start()
    run.step(1.0, ["e"], facts=True)
    assert run.configuration == {"c"}


@pytest.mark.parametrize("line", ["after 1 s", "every 1 s"])
def test_a_state_that_is_entered_again_waits_from_its_last_entry_in_the_same_step_too(line):
    text = f"machine m\nevent x\nstate a\n    {line} -> a / note(1)\n    on x -> a\n    state b\n"
    run = machine(text + "        after 1 s / raise x\n").start()
    assert len(run.step(1.0).microsteps) == 2
    assert DONE == []
    assert not run.step(1.9)


def test_a_failing_argument_of_an_instance_is_caught_by_the_instance(tmp_path):
    inner = "machine inner\nparam wait : time\nstate i\n    after wait -> f\nfinal f"
    (tmp_path / "inner.maze-machine").write_text(inner)
    outer = "machine m\nimport inner\nevent go\nvar zero : number = 0.0\nstate a\n    on go -> d\n"
    outer += "state d = inner(wait = 1 s / zero)\n    on f -> a\n    on fault -> safe\nstate safe"
    (tmp_path / "outer.maze-machine").write_text(outer)
    run = hsm.load(tmp_path / "outer.maze-machine", LIBRARY).start()
    run.step(1.0, ["go"])
    assert run.configuration == {"safe"}


def test_the_explanation_says_that_it_was_undone():
    text = "machine m\nevent go\nstate a\n    on go -> b / boom()\n    on fault -> c\nstate b\nstate c"
    step = machine(text).start().step(1.0, ["go"])
    assert [(str(one.trigger), one.verdict) for one in step.considered] == [
        ("go", Verdict.UNDONE),
        ("fault", Verdict.TAKEN),
    ]
