"""Regions side by side: entry, preemption, snapshots, completion."""

import pytest

from tests.hsm.charts import (
    DONE,
    active,
    add,
    both,
    compare,
    facts,
    final,
    no,
    noting,
    number,
    on,
    parallel,
    put,
    raising,
    start,
    state,
    variable,
    when,
)


def two_regions(*ways, first=(), second=()):
    return parallel(
        "p",
        state("b", state("b1", *first), state("b2")),
        state("c", state("c1", *second), state("c2")),
        *ways,
    )


def test_all_regions_are_entered_in_document_order():
    run = start(two_regions())
    assert run.initial.entered == ("p", "b", "b1", "c", "c1")


def test_each_region_reacts_to_one_event_in_one_microstep():
    run = start(two_regions(first=[on("go", "b2")], second=[on("go", "c2")]))
    step = run.step(1.0, ["go"])
    assert len(step.microsteps) == 1
    assert step.exited == ("c1", "b1")
    assert step.entered == ("b2", "c2")


def test_leaving_a_parallel_state_leaves_all_regions_from_the_last():
    run = start(two_regions(on("out", "x")), state("x"))
    assert run.step(1.0, ["out"]).exited == ("c1", "c", "b1", "b", "p")


def test_an_inner_transition_preempts_an_outer_one():
    run = start(two_regions(on("go", "x"), first=[on("go", "b2")]), state("x"))
    assert run.step(1.0, ["go"]).entered == ("b2",)
    assert "p" in run.configuration


def test_of_two_conflicting_regions_the_first_in_the_document_wins():
    run = start(two_regions(first=[on("go", "x")], second=[on("go", "y")]), state("x"), state("y"))
    step = run.step(1.0, ["go"])
    assert run.configuration == {"x"}
    assert [one.targets for one in step.transitions] == [(6 + 2,)]


def test_a_preempted_transition_is_told_apart():
    run = start(two_regions(first=[on("go", "x")], second=[on("go", "y")]), state("x"), state("y"))
    verdicts = [one.verdict.name for one in run.step(1.0, ["go"]).considered]
    assert verdicts == ["TAKEN", "PREEMPTED"]


def test_no_region_sees_what_a_sibling_does_in_the_same_microstep():
    run = start(
        two_regions(
            first=[on("go", "b2", actions=[put("n", 1)])],
            second=[on("go", "c2", guard=compare(variable("n"), "==", number(1)))],
        ),
        variables={"n": 0},
    )
    assert run.step(1.0, ["go"]).entered == ("b2",)
    assert run.step(2.0, ["go"]).entered == ("c2",)


def test_guards_see_the_configuration_before_the_microstep():
    run = start(two_regions(first=[on("go", "b2")], second=[on("go", "c2", guard=active("b1"))]))
    assert run.step(1.0, ["go"]).entered == ("b2", "c2")


def test_a_transition_into_one_region_from_outside_enters_the_others_by_default():
    run = start(state("x", on("go", "c2")), two_regions())
    assert run.step(1.0, ["go"]).entered == ("p", "b", "b1", "c", "c2")


def test_a_transition_across_regions_leaves_and_enters_both():
    run = start(two_regions(first=[on("go", "c2")]))
    step = run.step(1.0, ["go"])
    assert step.exited == ("c1", "c", "b1", "b", "p")
    assert step.entered == ("p", "b", "b1", "c", "c2")


def test_actions_run_in_document_order_of_their_regions():
    run = start(
        two_regions(
            first=[on("go", "b2", actions=[noting(1)])],
            second=[on("go", "c2", actions=[noting(2)])],
        )
    )
    run.step(1.0, ["go"])
    assert DONE == [1, 2]


def test_conditions_of_regions_fire_together():
    run = start(two_regions(first=[when("a", "b2")], second=[when(both(no(active("b2")), active("b1")), "c2")]))
    assert run.step(1.0, (), facts("a")).entered == ("b2", "c2")


def test_a_region_can_raise_an_event_for_another():
    run = start(two_regions(first=[on("go", "b2", actions=[raising("next")])], second=[on("next", "c2")]))
    assert run.step(1.0, ["go"]).entered == ("b2", "c2")


@pytest.mark.parametrize("handles", [True, False])
def test_done_when_all_regions_are_final(handles):
    ways = [on("done", actions=[add("n")])] if handles else []
    run = start(
        parallel(
            "p",
            state("b", state("b1", on("one", "bf")), final("bf"), *ways),
            state("c", state("c1", on("two", "cf")), final("cf")),
            on("done", "x"),
        ),
        state("x"),
        variables={"n": 0},
    )
    run.step(1.0, ["one"])
    assert run.configuration == {"p", "b", "bf", "c", "c1"}
    assert run.variables["n"] == handles
    run.step(2.0, ["two"])
    assert run.configuration == {"x"}


def test_regions_nested_in_regions():
    run = start(
        parallel(
            "p",
            parallel("q", state("q1", state("q1a", on("go", "q1b")), state("q1b")), state("q2", state("q2a"))),
            state("r", state("r1", on("go", "r2")), state("r2")),
        )
    )
    assert run.step(1.0, ["go"]).entered == ("q1b", "r2")
    assert run.configuration == {"p", "q", "q1", "q1b", "q2", "q2a", "r", "r2"}
