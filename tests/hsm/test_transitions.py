"""Which states a transition leaves and enters, in which order, and what runs meanwhile."""

import pytest

from hsm.model.chart import TransitionKind
from tests.hsm.charts import (
    DONE,
    EXTERNAL,
    active,
    add,
    always,
    facts,
    no,
    noting,
    on,
    parallel,
    put,
    raising,
    start,
    state,
    when,
)


def test_the_initial_states_are_entered_from_the_outside_in():
    run = start(state("a", state("b", state("c", entry=[noting(3)]), entry=[noting(2)]), entry=[noting(1)]))
    assert run.initial.entered == ("a", "b", "c")
    assert run.configuration == {"a", "b", "c"}
    assert DONE == [1, 2, 3]


def test_states_are_left_from_the_inside_out_then_actions_then_entries():
    run = start(
        state(
            "a",
            state("b", exit=[noting(1)]),
            on("go", "d", actions=[noting(3)]),
            exit=[noting(2)],
        ),
        state("c", state("d", entry=[noting(5)]), entry=[noting(4)]),
    )
    step = run.step(1.0, ["go"])
    assert step.exited == ("b", "a")
    assert step.entered == ("c", "d")
    assert DONE == [1, 2, 3, 4, 5]
    assert [str(action.arguments[0].value) for action in step.actions] == ["1", "2", "3", "4", "5"]


def test_an_inner_state_comes_before_an_outer_one():
    run = start(state("a", state("b", on("go", "c")), on("go", "d")), state("c"), state("d"))
    assert run.step(1.0, ["go"]).entered == ("c",)


def test_the_outer_state_is_asked_when_the_guards_of_the_inner_fail():
    run = start(state("a", state("b", on("go", "c", guard=active("d"))), on("go", "d")), state("c"), state("d"))
    assert run.step(1.0, ["go"]).entered == ("d",)


def test_within_a_state_the_first_in_the_text_wins():
    run = start(state("a", on("go", "b"), on("go", "c")), state("b"), state("c"))
    assert run.step(1.0, ["go"]).entered == ("b",)


def test_a_local_transition_does_not_leave_its_source():
    run = start(state("a", state("b"), state("c"), on("go", "c")))
    step = run.step(1.0, ["go"])
    assert step.exited == ("b",)
    assert step.entered == ("c",)


def test_an_external_transition_leaves_and_enters_its_source():
    run = start(state("a", state("b"), state("c"), on("go", "c", **EXTERNAL)))
    step = run.step(1.0, ["go"])
    assert step.exited == ("b", "a")
    assert step.entered == ("a", "c")


def test_an_internal_transition_leaves_nothing():
    run = start(state("a", on("count", actions=[add("n")])), variables={"n": 0})
    step = run.step(1.0, ["count", "count"])
    assert (step.exited, step.entered) == ((), ())
    assert run.variables["n"] == 2
    assert len(step.microsteps) == 2


@pytest.mark.parametrize("kind", [TransitionKind.LOCAL, TransitionKind.EXTERNAL])
def test_a_transition_of_an_atomic_state_to_itself_enters_it_again(kind):
    run = start(state("a", on("again", "a", kind=kind)))
    step = run.step(1.0, ["again"])
    assert (step.exited, step.entered) == (("a",), ("a",))


def test_a_local_transition_to_the_source_itself_enters_it_again():
    run = start(state("a", state("b"), on("again", "a")))
    step = run.step(1.0, ["again"])
    assert (step.exited, step.entered) == (("b", "a"), ("a", "b"))


def test_a_transition_of_the_whole_machine():
    run = start(state("a"), state("b"), on("stop", "b"))
    assert run.step(1.0, ["stop"]).entered == ("b",)


def test_a_deep_target_enters_all_between():
    run = start(state("x", on("go", "c")), state("a", state("b", state("c"), state("d"))))
    assert run.step(1.0, ["go"]).entered == ("a", "b", "c")


def test_raised_events_come_before_the_next_event_from_outside():
    run = start(
        state("a", on("go", "b")),
        state("b", on("inner", "c"), on("outer", "d"), entry=[raising("inner")]),
        state("c", on("outer", "e")),
        state("d"),
        state("e"),
    )
    step = run.step(1.0, ["go", "outer"])
    assert step.entered == ("b", "c", "e")
    assert [one.trigger for one in step.microsteps] == ["go", "inner", "outer"]


def test_events_are_taken_in_their_order_and_those_that_nobody_waits_for_are_ignored():
    run = start(state("a", on("one", "b")), state("b", on("two", "a")))
    step = run.step(1.0, ["two", "one", "three", "two"])
    assert step.handled == ("one", "two")
    assert step.ignored == ("two", "three")


def test_transitions_without_a_trigger_follow_at_once_and_before_raised_events():
    run = start(
        state("a", on("go", "b", actions=[raising("e")])),
        state("b", always("c"), on("e", "wrong")),
        state("c", on("e", "d")),
        state("d"),
        state("wrong"),
    )
    assert run.step(1.0, ["go"]).entered == ("b", "c", "d")


def test_an_eventless_transition_at_the_start():
    run = start(state("a", always("b")), state("b"))
    assert run.configuration == {"b"}
    assert run.initial.entered == ("a", "b")


def test_conditions_fire_one_after_the_other_within_a_step():
    run = start(state("i", when("a", "j")), state("j", when("b", "k")), state("k", when("c", "i")))
    step = run.step(1.0, (), facts("a", "b"))
    assert step.entered == ("j", "k")


def test_events_come_before_conditions():
    run = start(state("i", when("a", "j"), on("go", "k")), state("j"), state("k"))
    assert run.step(1.0, ["go"], facts("a")).entered == ("k",)


def test_initial_actions_run_only_when_the_initial_state_is_taken():
    inner = [state("b"), state("c")]
    run = start(
        state("x", on("default", "a"), on("direct", "c")),
        state("a", *inner, initial="b", initial_actions=[noting(7)], entry=[noting(6)]),
    )
    run.step(1.0, ["direct"])
    assert DONE == [6]


def test_a_multiple_target_enters_both_regions():
    run = start(
        state("x", on("go", ["b2", "c2"])),
        parallel("p", state("b", state("b1"), state("b2")), state("c", state("c1"), state("c2"))),
    )
    assert run.step(1.0, ["go"]).entered == ("p", "b", "b2", "c", "c2")


def test_in_is_true_of_active_states_around_too():
    run = start(
        state("a", state("b", on("go", "c", guard=active("a"))), on("no", "c", guard=no(active("a")))), state("c")
    )
    assert not run.step(1.0, ["no"])
    assert run.step(1.0, ["go"]).entered == ("c",)


def test_assignments_see_those_before_them():
    run = start(state("a", on("go", actions=[put("n", 5), add("n", 2), add("m", 1)])), variables={"n": 0, "m": 0})
    run.step(1.0, ["go"])
    assert dict(run.variables) == {"n": 7, "m": 1}


def test_variables_of_a_state_are_set_when_it_is_entered():
    run = start(
        state("a", state("a1", on("count", actions=[add("n")])), on("go", "b"), variables={"n": 3}),
        state("b", on("back", "a")),
    )
    run.step(1.0, ["count"])
    assert run.variables["n"] == 4
    run.step(2.0, ["go", "back"])
    assert run.variables["n"] == 3
