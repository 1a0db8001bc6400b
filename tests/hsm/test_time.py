"""Time-outs in logical time."""

import pytest

from hsm.model.expressions import Binary
from hsm.model.types import NUMBER
from tests.hsm.charts import add, after, facts, number, on, signal, start, state, variable, when


def test_a_time_out_fires_in_the_first_step_at_or_after_its_deadline():
    run = start(state("a", after(1.0, "b")), state("b"))
    assert not run.step(0.99)
    assert run.step(1.2).entered == ("b",)


def test_sums_of_time_steps_reach_their_deadline():
    run = start(state("a", after(1.0, "b")), state("b"))
    time = 0.0
    for _ in range(10):
        time += 0.1
        run.step(time)
    assert time < 1.0
    assert run.configuration == {"b"}


def test_it_counts_from_the_last_entry():
    run = start(state("a", after(1.0, "b"), on("again", "a")), state("b"))
    run.step(0.8, ["again"])
    assert not run.step(1.7)
    assert run.step(1.8)


def test_leaving_the_state_ends_it():
    run = start(state("a", after(1.0, "c"), on("go", "b")), state("b"), state("c"))
    run.step(0.5, ["go"])
    assert not run.step(5.0)


def test_a_local_transition_inside_does_not_start_it_again():
    run = start(state("a", state("u", on("go", "v")), state("v"), after(1.0, "b")), state("b"))
    run.step(0.9, ["go"])
    assert run.step(1.0).entered == ("b",)


def test_an_internal_time_out_fires_once_for_each_entry():
    run = start(state("a", after(1.0, actions=[add("n")]), on("again", "a")), variables={"n": 0})
    for time in (1.0, 2.0, 3.0):
        run.step(time)
    assert run.variables["n"] == 1
    run.step(4.0, ["again"])
    run.step(5.0)
    assert run.variables["n"] == 2


def test_a_guarded_time_out_stays_due_until_its_guard_holds():
    run = start(state("i", after(1.0, "j", guard=signal("a"))), state("j"))
    assert not run.step(1.0, (), facts())
    assert not run.step(2.0, (), facts())
    assert run.step(3.0, (), facts("a")).entered == ("j",)


def test_a_guard_of_a_time_out_is_not_asked_before_it_is_due():
    run = start(state("i", after(1.0, "j", guard=signal("a"))), state("j"))
    run.step(0.5, (), None)


def test_events_come_before_time_outs_and_time_outs_before_conditions():
    run = start(
        state("i", when("a", "w"), after(1.0, "t"), on("go", "e")),
        state("e", after(5.0, "t")),
        state("t"),
        state("w"),
    )
    assert run.step(1.0, ["go"], facts("a")).entered == ("e",)
    run = start(state("i", when("a", "w"), after(1.0, "t")), state("t"), state("w"))
    assert run.step(1.0, (), facts("a")).entered == ("t",)


def test_inner_time_outs_come_before_outer_ones():
    run = start(state("a", state("b", after(1.0, "c")), after(0.5, "d")), state("c"), state("d"))
    assert run.step(2.0).entered == ("c",)


def test_all_time_outs_that_are_due_fire_in_one_step():
    run = start(state("a", after(1.0, actions=[add("n")]), after(2.0, actions=[add("n", 10)])), variables={"n": 0})
    run.step(3.0)
    assert run.variables["n"] == 11


def test_a_zero_time_out_fires_in_the_next_step_only():
    run = start(state("a", after(0.0, "b")), state("b", after(0.0, "a")))
    assert run.step(0.0).entered == ("b",)
    assert run.step(0.0).entered == ("a",)


def test_a_duration_is_computed_on_entry():
    run = start(
        state("a", after(Binary("*", variable("n"), number(0.5), NUMBER), "b"), on("more", "a", actions=[add("n")])),
        state("b"),
        variables={"n": 1},
    )
    run.step(0.4, ["more"])
    assert not run.step(1.3)
    assert run.step(1.4)


def test_time_does_not_run_backwards():
    run = start(state("a"))
    run.step(1.0)
    with pytest.raises(ValueError, match="backwards"):
        run.step(0.9)


def test_what_is_left_of_a_time_out_is_told():
    run = start(state("a", after(2.0, "b")), state("b"))
    (one,) = run.step(0.5).why("a")
    assert one.verdict.name == "NOT_DUE"
    assert one.remaining == pytest.approx(1.5)
