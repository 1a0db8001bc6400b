"""A run as JSON: saved, restored, and carried over to a machine whose file has changed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any

from hsm.engine.clock import nanoseconds
from hsm.engine.compiled import CompiledChart
from hsm.engine.execution import PendingFault, RunState
from hsm.engine.limits import duration
from hsm.model.chart import After, Send, Transition
from hsm.model.events import StateEvent
from hsm.model.expressions import Expression, Literal
from hsm.model.unparse import expression_text


class SnapshotError(ValueError):
    """A snapshot that does not fit the machine; the message says why."""


@dataclass(frozen=True, slots=True)
class SavedRun:
    """What a snapshot holds, in terms of a machine.

    Attributes:
        time: logical time of the last step in seconds.
        state: configuration, variables, time-outs, history.
        pending: outcomes and faults of activities that the next step will see.
        finished: states whose activity is over.
    """

    time: float
    state: RunState
    pending: tuple[StateEvent | PendingFault, ...]
    finished: frozenset[int]


def to_json(machine: CompiledChart, run: SavedRun) -> dict[str, Any]:
    """A run in a form that JSON can carry; states and variables stand by their names."""
    state, names = run.state, [one.name for one in machine.model.states]
    events = [(one.event, one.reason) if isinstance(one, PendingFault) else (one, None) for one in run.pending]
    return {
        "machine": machine.name,
        "time": run.time,
        "configuration": [names[leaf] for leaf in state.configuration.leaves],
        "outcome": state.outcome,
        "variables": {
            name: value.value if isinstance(value, StrEnum) else value
            for name, value in zip(machine.generator.variables, state.values, strict=True)
        },
        "timers": [[*_timer_name(machine, index), deadline] for index, deadline in sorted(state.timers.items())],
        "sent": [[due, send.event, send.delay, send.label] for due, send in state.sent],
        "history": {names[index]: [names[one] for one in states] for index, states in sorted(state.history.items())},
        "pending": [[list(one.names), names[one.origin], one.standard, reason] for one, reason in events],
        "finished": [names[index] for index in sorted(run.finished)],
    }


def from_json(machine: CompiledChart, snapshot: Mapping[str, Any]) -> SavedRun:
    """The run that ``to_json`` wrote.

    Raises:
        SnapshotError: it was taken from another machine, or the machine has changed since.
    """
    if not isinstance(snapshot, Mapping):
        raise SnapshotError(f"this is no snapshot of a run: {snapshot!r:.60}")
    if snapshot.get("machine") != machine.name:
        raise SnapshotError(f"the snapshot is of machine {snapshot.get('machine')}, not of {machine.name}")
    try:
        leaves = _leaves(machine, snapshot["configuration"])
        given = snapshot["variables"]
        unknown = sorted(given.keys() ^ machine.generator.variables.keys())
        if unknown:
            raise SnapshotError(f"the machine and the snapshot do not have the same variables: `{unknown[0]}`")
        values = [_typed(machine, name, given[name]) for name in machine.generator.variables]
        timers = {_timer(machine, source, number): int(due) for source, number, due in snapshot["timers"]}
        history = {
            _index(machine, name): tuple(_index(machine, one) for one in states)
            for name, states in snapshot["history"].items()
        }
        sent = tuple((int(due), Send(event, delay, label)) for due, event, delay, label in snapshot["sent"])
        state = RunState(machine.configuration(leaves), values, timers, sent, history, snapshot["outcome"])
        pending = tuple(_pending(machine, *one) for one in snapshot["pending"])
        finished = frozenset(_index(machine, name) for name in snapshot["finished"])
        return SavedRun(float(snapshot["time"]), state, pending, finished)
    except SnapshotError:
        raise
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        raise SnapshotError(f"this is no snapshot of a run: {error!r}") from error


def carry_over(old: CompiledChart, run: SavedRun, new: CompiledChart, parameters: Sequence[Any]) -> SavedRun:
    """A run of one machine as a run of a changed one, where every active state still exists.

    Variables keep their values where name and type are the same. Time-outs go on where the state still has the same
    one; others of active states start now. History is kept of states that still exist.

    Args:
        old: the machine that runs.
        run: where it is.
        new: the changed machine.
        parameters: the values of its parameters.

    Raises:
        SnapshotError: an active state is gone or is no longer of the same kind, with the reason.
    """
    names = [state.name for state in old.model.states]
    leaves = _leaves(new, [names[leaf] for leaf in run.state.configuration.leaves])
    configuration = new.configuration(leaves)
    gone = sorted(run.state.configuration.names ^ configuration.names)
    if gone:
        raise SnapshotError(f"state `{gone[0]}` does not stand where it stood")
    kept = _kept_values(old, run, new)
    values: list[Any] = [*parameters, *(None for _ in new.model.variables)]
    for name, slot in new.generator.variables.items():
        if name in kept:
            values[slot] = kept[name]
    for variable in new.model.variables:
        slot = new.generator.variables[variable.name]
        if variable.name not in kept and variable.scope in configuration.active:
            values[slot] = _value(new, variable.initial, values)
    timers = _kept_timers(old, run, new, values)
    known = new.indices
    history = {
        known[names[index]]: tuple(known[names[one]] for one in states)
        for index, states in run.state.history.items()
        if names[index] in known and all(names[one] in known for one in states)
    }
    state = RunState(configuration, values, timers, run.state.sent, history, run.state.outcome)
    pending = tuple(_moved(one, known[names[_origin(one)]]) for one in run.pending if names[_origin(one)] in known)
    finished = frozenset(known[names[one]] for one in run.finished if names[one] in known)
    return SavedRun(run.time, state, pending, finished)


def _leaves(machine: CompiledChart, names: Sequence[str]) -> tuple[int, ...]:
    leaves = []
    for name in names:
        index = machine.indices.get(name, 0)
        if index == 0:
            raise SnapshotError(f"state `{name}` is active, and the machine has no such state")
        if not machine.topology.atomic(index):
            raise SnapshotError(f"state `{name}` is active alone, and now has states inside it")
        leaves.append(index)
    complete = machine.planner.completed(leaves)
    if sorted(leaves) != list(complete):
        missing = next(iter(sorted(set(complete) ^ set(leaves))))
        raise SnapshotError(f"state `{machine.model.states[missing].name}` is missing beside the active ones")
    return complete


def _index(machine: CompiledChart, name: str) -> int:
    if name not in machine.indices:
        raise SnapshotError(f"the machine has no state `{name}`")
    return machine.indices[name]


def _typed(machine: CompiledChart, name: str, value: Any) -> Any:
    """A value of an enumeration comes back as the member; everything else is itself."""
    defaults: list[Any] = [one.default for one in machine.model.parameters if one.name == name]
    defaults += [
        one.initial.value for one in machine.model.variables if one.name == name and isinstance(one.initial, Literal)
    ]
    if isinstance(value, str) and defaults and isinstance(defaults[0], StrEnum):
        return type(defaults[0])(value)
    return value


def _timer_name(machine: CompiledChart, index: int) -> tuple[str, int]:
    source = machine.model.states[machine.model.transitions[index].source]
    return source.name, source.transitions.index(index)


def _timer(machine: CompiledChart, source: str, number: int) -> int:
    transitions = machine.model.states[_index(machine, source)].transitions
    if number >= len(transitions):
        raise SnapshotError(f"state `{source}` has no time-out at position {number}")
    return transitions[number]


def _pending(
    machine: CompiledChart, names: Sequence[str], origin: str, standard: str, reason: str | None
) -> StateEvent | PendingFault:
    event = StateEvent(tuple(names), _index(machine, origin), standard)
    if reason is None:
        return event
    return PendingFault(event, reason, machine.model.states[event.origin].place, RuntimeError(reason))


def _origin(entry: StateEvent | PendingFault) -> int:
    return entry.event.origin if isinstance(entry, PendingFault) else entry.origin


def _moved(entry: StateEvent | PendingFault, origin: int) -> StateEvent | PendingFault:
    if isinstance(entry, PendingFault):
        return replace(entry, event=replace(entry.event, origin=origin))
    return replace(entry, origin=origin)


def _kept_values(old: CompiledChart, run: SavedRun, new: CompiledChart) -> dict[str, Any]:
    types = {one.name: one.type for one in new.model.variables}
    return {
        one.name: value
        for one in old.model.variables
        if (value := run.state.values[old.generator.variables[one.name]]) is not None
        and types.get(one.name) == one.type
    }


def _kept_timers(old: CompiledChart, run: SavedRun, new: CompiledChart, values: Sequence[Any]) -> dict[int, int]:
    running = {_timer_text(old, old.model.transitions[index]): due for index, due in run.state.timers.items()}
    fired = {
        _timer_text(old, one)
        for one in old.model.transitions
        if isinstance(one.trigger, After) and one.source in run.state.configuration.active
    } - running.keys()
    timers = {}
    names = {*run.state.configuration.names, new.model.states[0].name}
    for transition in new.model.transitions:
        active = new.model.states[transition.source].name in names
        text = _timer_text(new, transition)
        if not isinstance(transition.trigger, After) or not active or text in fired:
            continue
        if text in running:
            timers[transition.index] = running[text]
        else:
            length = duration(_value(new, transition.trigger.duration, values))
            timers[transition.index] = nanoseconds(run.time) + length
    return timers


def _timer_text(machine: CompiledChart, transition: Transition) -> tuple[str, str, int]:
    """What makes two time-outs the same: their state, their duration, and which of such they are."""
    source = machine.model.states[transition.source]
    own = [machine.model.transitions[index] for index in source.transitions]
    same = [one for one in own if isinstance(one.trigger, After) and _duration(one) == _duration(transition)]
    return source.name, _duration(transition), same.index(transition) if transition in same else 0


def _duration(transition: Transition) -> str:
    return expression_text(transition.trigger.duration) if isinstance(transition.trigger, After) else ""


def _value(machine: CompiledChart, expression: Expression, values: Sequence[Any]) -> Any:
    return machine.generator.arguments((expression,))(None, {}, values, frozenset())[0]
