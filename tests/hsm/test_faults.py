"""What goes wrong reaches a transition that handles it, or the caller; the machine rests where it was."""

import pytest

from hsm import MachineFault, Spin
from hsm.model.expressions import Binary
from hsm.model.types import NUMBER
from tests.hsm.charts import (
    ASKED,
    DONE,
    Work,
    add,
    always,
    both,
    call,
    compare,
    doing,
    either,
    facts,
    noting,
    number,
    on,
    parallel,
    put,
    raising,
    signal,
    start,
    state,
    variable,
    when,
)

BROKEN = OSError("no data")


def test_a_fault_in_a_signal_can_be_handled():
    run = start(state("i", when("a", "j"), on("fault", "safe")), state("j"), state("safe"))
    assert run.step(1.0, (), facts(a=BROKEN)).entered == ("safe",)


def test_by_a_state_around_too_but_not_by_another():
    run = start(
        parallel(
            "p",
            state("b", state("b1", when("a", "b2")), state("b2"), on("fault", "b2")),
            state("c", state("c1", on("fault", "c2")), state("c2")),
        )
    )
    assert run.step(1.0, (), facts(a=BROKEN)).entered == ("b2",)


def test_unhandled_it_reaches_the_caller_with_state_and_place():
    run = start(state("i", when("a", "j")), state("j"))
    with pytest.raises(MachineFault) as raised:
        run.step(1.0, (), facts(a=BROKEN))
    assert raised.value.state == "i"
    assert raised.value.place.line == 1
    assert raised.value.__cause__ is BROKEN
    assert "signal `a` failed" in str(raised.value)
    assert run.configuration == {"i"}
    assert run.time == 0.0
    assert run.step(1.0, (), facts("a")).entered == ("j",)


def test_a_signal_that_fails_is_asked_once_in_a_step():
    run = start(
        parallel(
            "p",
            state("b", when(both(signal("b"), signal("a")), "x"), when(either(signal("a"), signal("c")), "x")),
            state("c", when("a", "x")),
            on("fault", actions=[add("n")]),
        ),
        state("x"),
        variables={"n": 0},
    )
    run.step(1.0, (), facts("b", a=BROKEN))
    assert ASKED.count("a") == 1
    assert ASKED.count("b") == 1
    assert run.variables["n"] == 2  # once for each state concerned


def test_a_guard_that_needs_a_failed_signal_counts_as_false():
    run = start(state("i", when("a", "j"), when("b", "k"), on("fault")), state("j"), state("k"))
    assert run.step(1.0, (), facts("b", a=BROKEN)).entered == ("k",)


def test_a_fault_comes_before_what_would_fire_besides():
    run = start(state("i", when("a", "j"), when("b", "k"), on("fault", "safe")), *map(state, ("j", "k", "safe")))
    assert run.step(1.0, (), facts("b", a=BROKEN)).entered == ("safe",)


def test_an_event_waits_for_the_fault_that_its_guard_finds():
    run = start(
        state("i", on("go", "j", guard=signal("a")), on("go", "k", guard=signal("b")), on("fault", actions=[add("n")])),
        *map(state, "jk"),
        variables={"n": 0},
    )
    assert run.step(1.0, ["go"], facts("b", a=BROKEN)).entered == ("k",)
    assert run.variables["n"] == 1


def test_a_division_by_zero_in_a_guard_is_a_fault():
    ratio = Binary("/", number(1.0), signal("x"), NUMBER)
    run = start(state("i", when(compare(ratio, "<", number(2.0)), "j"), on("fault", "safe")), state("j"), state("safe"))
    assert run.step(1.0, (), facts(x=0.0)).entered == ("safe",)


def test_a_fault_in_an_action_leaves_the_machine_as_before():
    run = start(
        state("a", state("b"), on("go", "c", actions=[add("n"), call("fail", line=12)]), exit=[noting(1)]),
        state("c"),
        variables={"n": 0},
    )
    before = run.snapshot()
    with pytest.raises(MachineFault) as raised:
        run.step(1.0, ["go"])
    assert raised.value.place.line == 12
    assert str(raised.value).startswith("test.maze-machine:12:")
    assert isinstance(raised.value.__cause__, OSError)
    assert run.snapshot() == before
    assert DONE == [1]  # what was done outside the machine cannot be taken back


def test_a_fault_in_an_assignment_too():
    zero = Binary("/", number(1.0), variable("n"), NUMBER)
    run = start(state("a", on("go", "b", actions=[put("n", zero, line=4)])), state("b"), variables={"n": 0})
    with pytest.raises(MachineFault) as raised:
        run.step(1.0, ["go"])
    assert raised.value.place.line == 4
    assert isinstance(raised.value.__cause__, ZeroDivisionError)
    assert run.configuration == {"a"}


def test_a_fault_late_in_a_step_takes_back_the_whole_step():
    run = start(
        state("a", on("go", "b", actions=[add("n")])),
        state("b", on("on", "c", actions=[call("fail")])),
        state("c"),
        variables={"n": 0},
    )
    with pytest.raises(MachineFault):
        run.step(1.0, ["go", "on"])
    assert run.configuration == {"a"}
    assert run.variables["n"] == 0


def test_a_fault_in_an_activity_is_seen_by_the_next_step():
    run = start(state("a", on("fault", "b"), activity=doing(1)), state("b"))
    run.act(facts())
    assert run.act({1: BROKEN}) == []
    assert run.step(1.0).entered == ("b",)


def test_without_anybody_to_handle_it_it_reaches_the_caller_at_once():
    run = start(state("a", activity=doing(1)))
    with pytest.raises(MachineFault, match="activity `work` failed") as raised:
        run.act({1: BROKEN})
    assert raised.value.state == "a"
    assert raised.value.__cause__ is BROKEN


def test_an_activity_is_not_stopped_by_a_step_that_fails():
    run = start(state("a", on("go", "b", actions=[call("fail")]), activity=doing(1)), state("b"))
    run.act(facts())
    with pytest.raises(MachineFault):
        run.step(1.0, ["go"])
    assert not Work.made[0].stopped


@pytest.mark.parametrize(
    "parts",
    [
        (state("i", when("a", "j")), state("j", when("a", "i"))),
        (state("i", on("go", "j")), state("j", always("k")), state("k", always("j"))),
        (state("i", on("go", actions=[raising("go")])),),
        (state("i", when("a", actions=[add("n")])),),
    ],
    ids=["conditions", "eventless", "raised", "internal"],
)
def test_a_spin_is_an_error_that_names_the_states(parts):
    run = start(*parts, variables={"n": 0})
    with pytest.raises(Spin) as raised:
        run.step(1.0, ["go"], facts("a"))
    assert "without end" in str(raised.value)
    assert f"state {raised.value.state}: " in str(raised.value)
    assert f"{raised.value.place}: " in str(raised.value)
    assert run.configuration == {"i"}


def test_a_spin_names_its_cycle_and_not_the_way_to_it():
    run = start(state("i", when("a", "j")), state("j", when("a", "k")), state("k", when("a", "j")))
    with pytest.raises(Spin) as raised:
        run.step(1.0, (), facts("a"))
    assert "through j (" in str(raised.value) or "through k (" in str(raised.value)
    assert "i (" not in str(raised.value)


def test_a_long_way_is_no_spin():
    states = [state(f"s{n}", when("a", f"s{n + 1}")) for n in range(500)]
    run = start(*states, state("s500"))
    assert len(run.step(1.0, (), facts("a")).microsteps) == 500


def test_a_fault_while_an_activity_is_stopped_is_seen_by_the_next_step(monkeypatch):
    def stop(self):
        raise BROKEN

    monkeypatch.setattr(Work, "stop", stop)
    run = start(state("a", state("b", on("go", "c"), activity=doing(1)), state("c"), on("fault", "x")), state("x"))
    run.act(facts())
    assert run.step(1.0, ["go"]).entered == ("c",)
    assert run.step(2.0).entered == ("x",)
