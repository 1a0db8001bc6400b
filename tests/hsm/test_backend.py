"""The library ``transitions`` as a second engine."""

import os

import pytest
from hypothesis import event, given, settings

from hsm import MachineError, build, to_transitions
from tests.hsm.charts import (
    DONE,
    EXTERNAL,
    add,
    after,
    always,
    compare,
    doing,
    facts,
    final,
    history,
    model,
    number,
    on,
    parallel,
    raising,
    signal,
    state,
    variable,
    when,
)
from tests.hsm.random_charts import event_lists, shared_models

EXAMPLES = int(os.environ.get("MAZE_MACHINE_EXAMPLES", "100"))


@settings(max_examples=EXAMPLES, deadline=None, derandomize=True)
@given(shared_models(), event_lists())
def test_both_engines_agree(declared, events):
    machine = build(declared)
    DONE.clear()
    run = machine.start()
    begun = list(DONE)
    DONE.clear()
    backend = to_transitions(machine)
    assert begun == DONE
    assert backend.active() == run.configuration
    taken = 0
    for time, name in enumerate(events):
        DONE.clear()
        taken += bool(run.step(float(time), [name]))
        ours = list(DONE)
        DONE.clear()
        backend.trigger(name, None)
        # The notes tell the order of all exits, actions and entries.
        assert ours == DONE
        assert backend.active() == run.configuration
        assert backend.variables == dict(run.variables)
    event(f"transitions taken: {min(taken, 5)}")


def test_a_live_machine_with_guards_over_facts():
    machine = build(
        model(
            state("drive", on("tick", "turn", guard=signal("a"), actions=[add("turns")])),
            state("turn", on("done", "drive")),
            variables={"turns": 0},
        )
    )

    class Robot:
        pass

    robot = Robot()
    backend = to_transitions(machine, robot)
    robot.tick(facts())
    assert robot.state == "drive"
    robot.trigger("tick", facts("a"))
    assert robot.state == "turn"
    assert backend.variables == {"turns": 1}
    robot.done()
    assert backend.active() == {"drive"}


def test_raised_events_follow():
    machine = build(model(state("a", on("go", "b")), state("b", on("next", "c"), entry=[raising("next")]), state("c")))
    backend = to_transitions(machine)
    backend.trigger("go")
    assert backend.active() == {"c"}


def test_transitions_of_the_whole_machine_come_last():
    machine = build(model(state("a", on("go", "b")), state("b"), state("c"), on("go", "c")))
    backend = to_transitions(machine)
    backend.trigger("go")
    assert backend.active() == {"b"}
    backend.trigger("go")
    assert backend.active() == {"c"}


@pytest.mark.parametrize(
    ("reason", "parts"),
    [
        ("parallel", [parallel("p", state("b"), state("c"))]),
        ("history", [state("a", history("h", "b"), state("b"))]),
        ("completes", [state("a", state("b", on("go", "f")), final("f"))]),
        ("no event", [state("a", after(1.0, "b")), state("b")]),
        ("no event", [state("a", when("a", "b")), state("b")]),
        ("no event", [state("a", always("b")), state("b")]),
        ("activity", [state("a", activity=doing(1))]),
        ("different states", [state("a", state("b", state("c"), state("d")), on("go", "d"))]),
        ("different states", [state("a", state("b"), on("go", "b", **EXTERNAL))]),
    ],
)
def test_what_is_not_shared_is_refused(reason, parts):
    with pytest.raises(MachineError) as raised:
        to_transitions(build(model(*parts)))
    assert any(reason in one.message and one.code == "E0921" for one in raised.value.diagnostics)


def test_a_comparison_of_a_counter_guards_alike():
    guarded = on("go", "b", guard=compare(variable("n"), "<", number(2)))
    machine = build(model(state("a", guarded), state("b", on("go", "a", actions=[add("n")])), variables={"n": 0}))
    run, backend = machine.start(), to_transitions(machine)
    for time in range(8):
        run.step(float(time), ["go"])
        backend.trigger("go")
        assert backend.active() == run.configuration
    assert run.configuration == {"a"}
