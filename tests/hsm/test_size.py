"""Machines far larger than anybody writes: no deep recursion, nothing that grows faster than the machine."""

import pytest

from hsm import MachineError, build, to_transitions
from hsm.interchange import scxml
from hsm.interchange.diagrams import DiagramError, render
from tests.hsm.charts import facts, model, on, state, when

DEPTH = 10_000


def tower(depth):
    text = "".join(f'<state id="s{level}"><transition event="e{level}" target="s{level}"/>' for level in range(depth))
    return scxml.read_text(f"<scxml>{text}{'</state>' * depth}</scxml>")


def test_a_very_deep_machine_runs():
    run = build(tower(DEPTH)).start()
    assert len(run.configuration) == DEPTH
    step = run.step(1.0, ["e0"])
    assert len(step.exited) == len(step.entered) == DEPTH
    assert run.step(2.0, [f"e{DEPTH - 1}"]).entered == (f"s{DEPTH - 1}",)
    assert run.machine.restore(run.snapshot()).configuration == run.configuration
    assert len(run.coverage.states) == DEPTH + 1


def test_what_is_too_deep_for_others_is_refused():
    machine = build(tower(100))
    with pytest.raises(MachineError, match="nested more than"):
        to_transitions(machine)
    with pytest.raises(DiagramError, match="nested 100 deep"):
        render(machine, "mmd")


def test_a_wide_machine_works_out_only_what_it_meets():
    states = [state(f"s{n}", when("a" if n % 2 else "b", f"s{(n + 1) % 2000}")) for n in range(2000)]
    machine = build(model(*states))
    run = machine.start()
    run.step(1.0, (), facts("b"))
    run.step(2.0, (), facts("a"))
    assert run.configuration == {"s2"}
    assert len(machine._configurations) == 3


def test_what_is_kept_is_bounded():
    run = build(model(state("a", on("*", prefix=True)))).start()
    for number in range(10_000):
        run.step(float(number), [f"event.{number}"])
    (configuration,) = run.machine._configurations.values()
    assert len(configuration.events) <= 4096
