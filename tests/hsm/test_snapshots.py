"""Runs saved, restored, and carried over to a changed machine."""

import json

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hsm import SnapshotError, build
from tests.hsm.charts import (
    Work,
    add,
    after,
    doing,
    facts,
    final,
    history,
    model,
    on,
    parallel,
    signal,
    start,
    state,
    when,
)


def machine():
    return build(
        model(
            parallel(
                "p",
                state(
                    "b",
                    history("h", "b1", deep=True),
                    state("b1", after(0.7, "b2"), on("go", "b2")),
                    state("b2", state("u", on("go", "v"), activity=doing(1)), state("v", after(1.1, "b1"))),
                    on("count", actions=[add("n")]),
                ),
                state(
                    "c",
                    state("c1", when("a", "c2")),
                    state("c2", after(0.4, "c1"), on("done", "c1"), activity=doing(2)),
                ),
                on("out", "x"),
            ),
            state("x", on("back", "h"), after(5.0, "end")),
            final("end"),
            variables={"n": 0},
        )
    )


EVENTS = st.lists(st.sampled_from(["go", "count", "out", "back", "done"]), max_size=2)
INPUTS = st.lists(st.tuples(EVENTS, st.booleans(), st.sampled_from([None, None, "done"])), min_size=4, max_size=14)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(INPUTS, st.integers(0, 13))
def test_a_restored_run_has_the_same_trace(inputs, at):
    compiled = machine()
    run = compiled.start()
    other = None
    for number, (events, a, outcome) in enumerate(inputs):
        if number == at:
            other = compiled.restore(json.loads(json.dumps(run.snapshot())))
            assert other.configuration == run.configuration
            assert other.snapshot() == run.snapshot()
        time = (number + 1) * 0.3
        given_facts = facts(a=a)
        step = run.step(time, events, given_facts)
        run.act({1: outcome})
        if other is not None:
            assert other.step(time, events, given_facts) == step
            other.act({1: outcome})
            assert other.snapshot() == run.snapshot()


def test_a_snapshot_of_another_machine_is_refused():
    with pytest.raises(SnapshotError, match="is of machine other, not of m"):
        start(state("a")).machine.restore(build(model(state("a"), name="other")).start().snapshot())


@pytest.mark.parametrize(
    "change",
    [
        {"configuration": ["nowhere"]},
        {"configuration": ["b1"]},
        {"configuration": ["p", "b1"]},
        {"variables": {}},
        {"timers": [["b1", "after 99 s", 0, 1]]},
        {"timers": []},
        {"history": {"h": ["nowhere"]}},
        {"pending": 7},
    ],
)
def test_a_snapshot_that_does_not_fit_is_refused(change):
    compiled = machine()
    with pytest.raises(SnapshotError):
        compiled.restore({**compiled.start().snapshot(), **change})


def changed(*parts, **options):
    return build(model(*parts, **options))


def test_a_changed_machine_goes_on_where_the_old_one_was():
    run = start(state("a", on("go", "b")), state("b", on("count", actions=[add("n")])), variables={"n": 0})
    run.step(1.0, ["go", "count"])
    run.reload(changed(state("new"), state("a"), state("b", on("back", "new")), variables={"n": 0, "more": 4}))
    assert run.configuration == {"b"}
    assert dict(run.variables) == {"n": 1, "more": 4}
    assert run.step(2.0, ["back"]).entered == ("new",)


@pytest.mark.parametrize(
    ("parts", "reason"),
    [
        ((state("b"),), "`a` is active, and the machine has no such state"),
        ((state("a", state("inner")),), "now has states inside"),
        ((state("around", state("a")),), "`around` is no longer at the same place in the machine"),
        ((parallel("p", state("a"), state("other")),), "`other` is missing among the active ones"),
    ],
)
def test_without_its_active_states_it_is_refused_and_the_old_one_goes_on(parts, reason):
    run = start(state("a", on("go", "c")), state("c"))
    with pytest.raises(SnapshotError, match=reason):
        run.reload(changed(*parts))
    assert run.step(1.0, ["go"]).entered == ("c",)


def test_time_outs_go_on_and_new_ones_begin():
    run = start(state("a", after(2.0, "b")), state("b"))
    run.step(1.0)
    run.reload(changed(state("a", after(2.0, "b"), after(0.5, "c")), state("b"), state("c")))
    assert run.step(1.4).entered == ()
    assert run.step(1.5).entered == ("c",)
    run = start(state("a", after(2.0, "b")), state("b"))
    run.step(1.0)
    run.reload(changed(state("a", after(2.0, "b"), on("x")), state("b")))
    assert run.step(2.0).entered == ("b",)


def test_a_time_out_that_has_fired_does_not_fire_again():
    run = start(state("a", after(1.0, actions=[add("n")])), variables={"n": 0})
    run.step(1.0)
    run.reload(changed(state("a", after(1.0, actions=[add("n")])), variables={"n": 0}))
    run.step(9.0)
    assert run.variables["n"] == 1


@pytest.mark.parametrize("reverse", [True, False])
def test_a_snapshot_knows_its_time_outs_by_name(reverse):
    ways = [on("x", "c"), after(5.0, "b"), after(5.0, "c", guard=signal("a")), after(7.0, "c")]
    run = start(state("a", *ways), state("b"), state("c"))
    run.step(1.0, (), facts())
    again = changed(state("a", *ways[:: -1 if reverse else 1]), state("b"), state("c")).restore(run.snapshot())
    assert not again.step(4.9, (), facts())
    assert again.step(5.0, (), facts()).entered == ("b",)


@pytest.mark.parametrize("ways", [[], [after(4.0, "b")], [after(5.0, "b"), after(4.0, "b")]])
def test_a_snapshot_with_other_time_outs_is_refused(ways):
    run = start(state("a", after(5.0, "b")), state("b"))
    with pytest.raises(SnapshotError, match=r"time-out `after \d s`"):
        changed(state("a", *ways), state("b")).restore(run.snapshot())


def test_a_deadline_at_zero_goes_on():
    run = start(state("a", after(0.0, "b", guard=signal("a"))), state("b"))
    run.step(3.0, (), facts())
    run.reload(changed(state("a", after(0.0, "b", guard=signal("a")), on("x")), state("b")))
    assert run.step(3.0, (), facts("a")).entered == ("b",)


def moved(*inside):
    return [
        state("maze", history("h", "a"), state("a", on("go", "b")), *inside, on("out", "other")),
        state("other", on("back", "h")),
    ]


def test_a_history_that_has_moved_is_refused_or_forgotten():
    run = start(*moved(state("b")))
    run.step(1.0, ["go", "out"])
    edited = changed(*moved(), state("b"))
    with pytest.raises(SnapshotError, match="`h` remembers `b`, which it can no longer enter"):
        edited.restore(run.snapshot())
    run.reload(edited)
    run.step(2.0, ["back"])
    assert run.configuration == {"maze", "a"}


def test_states_that_now_exclude_each_other_are_refused():
    run = start(parallel("p", state("q", state("q1")), state("r", state("r1"))))
    edited = changed(state("p", state("q", state("q1")), state("r", state("r1"))))
    with pytest.raises(SnapshotError, match="exclude each other"):
        edited.restore(run.snapshot())
    with pytest.raises(SnapshotError, match="exclude each other"):
        run.reload(edited)


@pytest.mark.parametrize("value", [True, 1.5, "x", 2**63])
def test_a_variable_of_another_type_is_refused(value):
    run = start(state("a", on("go", "a")), variables={"n": 0})
    snapshot = {**run.snapshot(), "variables": {"n": value}}
    with pytest.raises(SnapshotError, match="`n` is"):
        run.machine.restore(snapshot)


def test_an_activity_that_is_over_in_the_snapshot_must_be_the_same():
    run = start(state("a", on("stuck", "b"), activity=doing(1)), state("b"))
    run.act({1: "done"})
    run.step(1.0, (), facts())
    assert run.machine.restore(run.snapshot()).act(facts()) == []
    with pytest.raises(SnapshotError, match="state `a` does `work"):
        changed(state("a", on("stuck", "b"), activity=doing(2)), state("b")).restore(run.snapshot())


def test_history_is_kept():
    parts = [
        state("a", history("h", "u"), state("u", on("go", "v")), state("v"), on("out", "x")),
        state("x", on("in", "h")),
    ]
    run = start(*parts)
    run.step(1.0, ["go", "out"])
    run.reload(changed(state("first"), *parts, initial="first"))
    assert "v" in run.step(2.0, ["in"]).entered


def test_activities_run_on_where_the_state_does_the_same():
    run = start(parallel("p", state("b", activity=doing(1)), state("c", activity=doing(2))))
    run.act(facts())
    run.reload(changed(parallel("p", state("b", activity=doing(1)), state("c", activity=doing(3)))))
    assert [one.stopped for one in Work.made] == [False, True]
    assert run.act(facts()) == [("b", 1), ("c", 3)]
    assert len(Work.made) == 3


@pytest.mark.parametrize(
    "damage", [None, [], "x", {}, {"time": "a"}, {"configuration": ["z"]}, {"history": 3}, {"sent": [[1]]}]
)
def test_what_is_no_snapshot_is_refused(damage):
    machine = build(model(state("a", on("e", "b")), state("b")))
    snapshot = machine.start().snapshot()
    damaged = {**snapshot, **damage} if isinstance(damage, dict) and damage else damage
    with pytest.raises(SnapshotError):
        machine.restore(damaged)


def test_no_time_is_refused():
    run = build(model(state("a", on("e", "b")), state("b"))).start()
    with pytest.raises(ValueError, match="a finite number of seconds"):
        run.step(float("nan"), ["e"])
    assert run.configuration == {"a"}
