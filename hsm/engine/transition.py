"""One step as a pure function: from a snapshot and inputs to the next snapshot, without a run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from typing import Any, Generic

from hsm.engine.compiled import CompiledChart
from hsm.engine.execution import MacrostepExecution
from hsm.engine.inputs import checked_time, shown
from hsm.engine.machine import Machine
from hsm.engine.macrostep import Macrostep
from hsm.engine.occurrences import checked_events
from hsm.engine.run_state import PendingFault
from hsm.engine.snapshots import SavedRun, from_json, to_json
from hsm.model.events import StateEvent
from hsm.model.messages import OutsideInput
from hsm.model.registry import E, F
from hsm.model.values import dataclass


@dataclass(frozen=True, slots=True)
class Inputs(Generic[F]):
    """The inputs of one step.

    Attributes:
        time: logical time of the step in seconds.
        events: events from outside, in the order in which they happened, as for ``Supervisor.step``.
        outcomes: the outcomes of activities since the previous step, by the full name of their state.
        facts: the argument of the signals and actions in this step.
    """

    time: float
    events: Sequence[OutsideInput] = ()
    outcomes: Mapping[str, str] = field(default_factory=dict)
    facts: F | None = None


def transition(
    machine: Machine[F, E], snapshot: Mapping[str, Any], inputs: Inputs[F]
) -> tuple[dict[str, Any], Macrostep]:
    """One step as a pure function: it changes nothing, and runs no activity.

    The step is the one that a restored run would do: ``machine.restore(snapshot).step(...)``. Activities are not ticked
    in between; their outcomes are inputs.

    Args:
        machine: the machine.
        snapshot: the state of a run, as from ``Supervisor.snapshot``.
        inputs: the inputs of the step.

    Returns:
        The next snapshot, in the same form, and the record of the step.

    Raises:
        MachineFault: something failed that the machine does not handle, or its transitions spin.
        SnapshotError: the snapshot does not fit the machine.
        ValueError: the time is before that of the snapshot or not finite, an event is not declared or its data differs
            from its declaration, or no running activity has such an outcome.
        TypeError: the time is not a number, the events are not a list of events, one carries a value of another type,
            or an argument does not have the type in the signature.
    """
    if not isinstance(machine, CompiledChart):
        raise TypeError(f"a transition is of a Machine, not of {shown(machine)}")
    if not isinstance(inputs, Inputs):
        raise TypeError(f"the inputs of a transition are Inputs, not {shown(inputs)}")
    if not isinstance(inputs.outcomes, Mapping):
        raise TypeError(f"outcomes are a mapping from states to outcomes, not {shown(inputs.outcomes)}")
    run = from_json(machine, snapshot)
    time = checked_time(inputs.time, run.time)
    events = checked_events(machine.model, inputs.events)
    ended = [_outcome(machine, run, name, outcome) for name, outcome in inputs.outcomes.items()]
    after, step = advance(machine, run, time, (*run.pending, *ended, *events), inputs.facts)
    over = run.finished | {one.origin for one in ended}
    return to_json(machine, replace(after, finished=over.difference(_touched(step)))), step


def advance(
    machine: CompiledChart,
    run: SavedRun,
    time: float,
    events: Sequence[StateEvent | PendingFault | OutsideInput],
    facts: object,
) -> tuple[SavedRun, Macrostep]:
    """One step in full on a run as a value; ``finished`` stays as it is."""
    execution = MacrostepExecution(machine, run.state, time, facts=facts, memo={}, hits=set())
    execution.run(events)
    return SavedRun(time, execution.state, (), run.finished), execution.macrostep()


def _outcome(machine: CompiledChart, run: SavedRun, name: str, outcome: str) -> StateEvent:
    index = machine.indices.get(name)
    if index is None or index not in run.state.configuration.activities or index in run.finished:
        raise ValueError(f"no activity runs in state `{name}` that could end with `{outcome}`")
    call = machine.model.states[index].activity
    assert call is not None, "only states with an activity are among them"
    if outcome not in call.activity.outcomes:
        known = ", ".join(call.activity.outcomes) or "none"
        raise ValueError(f"`{call.activity.name}` in state `{name}` has no outcome `{outcome}`; its outcomes: {known}")
    return StateEvent((outcome,), index, f"done.invoke.{name}")


def _touched(step: Macrostep) -> set[int]:
    """The states that were left or entered."""
    plans = [one.plan for one in step.selections if one.plan is not None]
    return {state for plan in plans for state in (*plan.exited, *plan.entered)}
