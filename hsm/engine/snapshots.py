"""A run as JSON: saved, restored, and transferred to a machine whose file has changed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from enum import StrEnum
from typing import Any

from hsm.engine.clock import nanoseconds
from hsm.engine.compiled import CompiledChart
from hsm.engine.configuration import Configuration
from hsm.engine.limits import duration, within_limits
from hsm.engine.occurrences import checked_events, event_text, name_of
from hsm.engine.run_state import PendingFault, RunState
from hsm.engine.stores import message_json, message_of, store_json, store_of
from hsm.model.chart import Held, Send, Timed
from hsm.model.events import StateEvent
from hsm.model.expressions import Expression, Literal
from hsm.model.messages import Adjustment, Occurrence, ScxmlEvent, Store
from hsm.model.types import Boolean, Enumeration, Integer, Quantity, Type
from hsm.model.unparse import activity_text, expression_text, trigger_text
from hsm.model.values import dataclass


class SnapshotError(ValueError):
    """A snapshot that does not fit the machine; the message says why."""


@dataclass(frozen=True, slots=True)
class SavedRun:
    """The contents of a snapshot, in terms of a machine.

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
    """A run as JSON values: everything in it is identified by name, nothing by position.

    A time-out is identified by its state and its text, and has a deadline in nanoseconds, or none if it has acted
    already.
    """
    if run.state.sessions:
        raise SnapshotError(f"a run with an active invoked chart cannot be saved ({machine.name})")
    state, names = run.state, [one.name for one in machine.model.states]
    events = [(one.event, one.reason) if isinstance(one, PendingFault) else (one, None) for one in run.pending]
    store = state.store or machine.model.store
    try:
        data = {} if store is None else {"data": store_json(machine, store)}
        sent = [[due, _sent_text(machine, one), one.delay, one.label, *_carried(one)] for due, one in state.sent]
    except ValueError as error:
        raise SnapshotError(f"the data of the chart {machine.name}: {error}") from error
    return {
        "machine": machine.name,
        "time": run.time,
        "configuration": [names[leaf] for leaf in state.configuration.leaves],
        "outcome": state.outcome,
        "variables": {
            name: value.value if isinstance(value, StrEnum) else value
            for name, value in zip(machine.generator.own_variables, state.values, strict=False)
        },
        "timers": [[*key, state.timers.get(index)] for key, index in _time_outs(machine, state.configuration).items()],
        "acted": [list(key) for key, index in _time_outs(machine, state.configuration).items() if index in state.acted],
        "sent": sent,
        "deferred": [event_text(machine.model, one) for one in state.deferred],
        "history": {names[index]: [names[one] for one in states] for index, states in sorted(state.history.items())},
        "pending": [[list(one.names), names[one.origin], one.standard, reason] for one, reason in events],
        "finished": [[names[index], _activity(machine, index)] for index in sorted(run.finished)],
        **data,
    }


def from_json(machine: CompiledChart, snapshot: Mapping[str, Any]) -> SavedRun:
    """The run that ``to_json`` wrote.

    Raises:
        SnapshotError: it was taken from another machine, or the machine has changed since.
    """
    if not isinstance(snapshot, Mapping):
        raise SnapshotError(f"this is not a snapshot of a run: {snapshot!r:.60}")
    if snapshot.get("machine") != machine.name:
        raise SnapshotError(f"the snapshot is of machine {snapshot.get('machine')}, not of {machine.name}")
    try:
        leaves = _leaves(machine, snapshot["configuration"])
        given = snapshot["variables"]
        unknown = sorted(given.keys() ^ set(machine.generator.own_variables))
        if unknown:
            raise SnapshotError(f"the machine and the snapshot do not have the same variables: `{unknown[0]}`")
        own = [_typed(machine, name, given[name]) for name in machine.generator.own_variables]
        values = machine.generator.first_values(own)
        configuration = machine.configuration(leaves)
        timers = _restored_timers(machine, configuration, snapshot["timers"])
        history = dict(_restored_history(machine, name, states) for name, states in snapshot["history"].items())
        sent = tuple((int(due), _sent(machine, *one)) for due, *one in snapshot["sent"])
        keys = _time_outs(machine, configuration)
        acted = frozenset(keys[state, text, number] for state, text, number in snapshot["acted"])
        deferred = _deferred(machine, snapshot.get("deferred", ()))
        outcome = snapshot["outcome"]
        store = None if machine.model.store is None else store_of(machine, snapshot["data"])
        state = RunState(configuration, values, timers, sent, history, outcome, acted, store, deferred)
        pending = tuple(_pending(machine, *one) for one in snapshot["pending"])
        finished = frozenset(_finished(machine, name, activity) for name, activity in snapshot["finished"])
        return SavedRun(float(snapshot["time"]), state, pending, finished)
    except SnapshotError:
        raise
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        raise SnapshotError(f"this is not a snapshot of a run: {error!r}") from error


def carry_over(old: CompiledChart, run: SavedRun, new: CompiledChart, parameters: Sequence[Any]) -> SavedRun:
    """Transfer a run to a changed machine in which every active state still exists.

    Variables keep their values where name and type are the same. Time-outs continue where the state still has the same
    one, or one of the same duration; others of active states start now. History is kept where the remembered states
    still lie where it may lead.

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
        raise SnapshotError(f"state `{gone[0]}` is no longer at the same place in the machine")
    kept = _kept_values(old, run, new)
    values = new.generator.first_values(parameters)
    for name, slot in new.generator.variables.items():
        if name in kept:
            values[slot] = kept[name]
    for variable in new.model.variables:
        slot = new.generator.variables[variable.name]
        if variable.name not in kept and variable.scope in configuration.active:
            values[slot] = _value(new, variable.initial, values)
    timers = _kept_timers(old, run, new, values)
    again = _time_outs(new, configuration)
    keys = _time_outs(old, run.state.configuration)
    acted = frozenset(again[key] for key, index in keys.items() if index in run.state.acted and key in again)
    known = new.indices
    history = {}
    for index, states in run.state.history.items():
        if names[index] in known and all(names[one] in known for one in states):
            remembered = tuple(known[names[one]] for one in states)
            if new.topology.recalls(known[names[index]], remembered):
                history[known[names[index]]] = remembered
    sent = tuple(
        (due, _sent(new, _sent_text(old, one), one.delay, one.label, *_carried(one))) for due, one in run.state.sent
    )
    deferred = _deferred(new, [event_text(old.model, one) for one in run.state.deferred])
    outcome, store = run.state.outcome, _kept_store(old, run, new)
    state = RunState(configuration, values, timers, sent, history, outcome, acted, store, deferred)
    pending = tuple(_moved(one, known[names[_origin(one)]]) for one in run.pending if names[_origin(one)] in known)
    finished = frozenset(known[names[one]] for one in run.finished if names[one] in known)
    return SavedRun(run.time, state, pending, finished)


def _sent_text(machine: CompiledChart, send: Send) -> str:
    """An event on its way, with what it carries, as a text."""
    return event_text(machine.model, send.message) if isinstance(send.message, Occurrence) else send.event


def _carried(send: Send) -> list[dict[str, Any]]:
    """What an event of a chart with data carries on its way, and where it goes; nothing for any other."""
    message = send.message
    return [{"message": message_json(message), "target": send.target}] if isinstance(message, ScxmlEvent) else []


def _kept_store(old: CompiledChart, run: SavedRun, new: CompiledChart) -> Store | None:
    """The data of a chart that has changed: it keeps its values where the chart has the same data."""
    if new.model.store is None or run.state.store is None:
        return None
    if run.state.sessions:
        raise SnapshotError(f"a run with an active invoked chart cannot be transferred ({old.name})")
    try:
        return store_of(new, store_json(old, run.state.store))
    except (KeyError, ValueError) as error:
        raise SnapshotError(f"the data does not fit the changed chart: {error}") from error


def _sent(
    machine: CompiledChart, event: str, delay: float, label: str | None, carried: Mapping[str, Any] | None = None
) -> Send:
    """The event on its way that a text represents; of a chart with data also what it carries."""
    if machine.model.events is None:
        if carried is None:
            return Send(event, delay, label)
        return Send(event, delay, label, message=message_of(carried["message"]), target=carried["target"])
    try:
        (found,) = checked_events(machine.model, (event,))
    except (TypeError, ValueError) as error:
        raise SnapshotError(f"the pending event `{event}`: {error}") from error
    return Send(name_of(event), delay, label, message=found if isinstance(found, Occurrence) else None)


def _deferred(machine: CompiledChart, events: Sequence[str]) -> tuple[str | Occurrence, ...]:
    try:
        found = checked_events(machine.model, events)
        if any(isinstance(one, Adjustment) for one in found):
            raise ValueError("an adjustment cannot be deferred")
        return tuple(one for one in found if not isinstance(one, Adjustment))
    except (TypeError, ValueError) as error:
        raise SnapshotError(f"an event is deferred in the snapshot: {error}") from error


def _leaves(machine: CompiledChart, names: Sequence[str]) -> tuple[int, ...]:
    leaves = []
    for name in names:
        index = machine.indices.get(name, 0)
        if index == 0:
            raise SnapshotError(f"state `{name}` is active, and the machine has no such state")
        if not machine.topology.atomic(index):
            raise SnapshotError(f"state `{name}` is active alone, and now has states inside it")
        leaves.append(index)
    rivals = machine.topology.rivals(leaves)
    if rivals is not None:
        first, second = (machine.model.states[one].name for one in rivals)
        raise SnapshotError(f"states `{first}` and `{second}` are active, and now exclude each other")
    complete = machine.planner.completed(leaves)
    if sorted(leaves) != list(complete):
        missing = next(iter(sorted(set(complete) ^ set(leaves))))
        raise SnapshotError(f"state `{machine.model.states[missing].name}` is missing among the active ones")
    return complete


def _index(machine: CompiledChart, name: str) -> int:
    if name not in machine.indices:
        raise SnapshotError(f"the machine has no state `{name}`")
    return machine.indices[name]


def _typed(machine: CompiledChart, name: str, value: Any) -> Any:
    """A value of its variable's type; one of an enumeration comes back as the member."""
    kinds = {one.name: one.type for one in machine.model.parameters}
    kinds |= {one.name: one.type for one in machine.model.variables}
    if value is None:
        return None  # of an instance that was not entered yet
    if not _fits(value, kinds[name]):
        raise SnapshotError(f"`{name}` is {value!r:.40} in the snapshot, and a {kinds[name]} in the machine")
    member = _first_value(machine, name)
    return type(member)(value) if isinstance(member, StrEnum) else value


def _fits(value: Any, kind: Type) -> bool:
    match kind:
        case Boolean():
            return isinstance(value, bool)
        case Integer():
            return isinstance(value, int) and not isinstance(value, bool) and within_limits(value, kind)
        case Quantity():
            return isinstance(value, int | float) and not isinstance(value, bool) and within_limits(value, kind)
        case Enumeration(members=members):
            return value in members


def _first_value(machine: CompiledChart, name: str) -> Any:
    """What a parameter or a variable begins with, where that is written down."""
    for parameter in machine.model.parameters:
        if parameter.name == name:
            return parameter.default
    initial = next(one.initial for one in machine.model.variables if one.name == name)
    return initial.value if isinstance(initial, Literal) else None


_Key = tuple[str, str, int]
"""What names a time-out: its state, its text with its guard, and which of such in that state it is."""


def _time_outs(machine: CompiledChart, configuration: Configuration) -> dict[_Key, int]:
    """The time-outs of all active states, by their names."""
    model = machine.model
    found: dict[_Key, int] = {}
    for state in sorted(configuration.active):
        for index in model.states[state].transitions:
            transition = model.transitions[index]
            if isinstance(transition.trigger, Timed):
                name, text = model.states[state].name, trigger_text(transition.trigger, transition.guard)
                number = sum(key[:2] == (name, text) for key in found)
                found[name, text, number] = index
    return found


def _restored_timers(
    machine: CompiledChart, configuration: Configuration, saved: Sequence[tuple[str, str, int, int | None]]
) -> dict[int, int]:
    """The deadlines of the time-outs; each of the snapshot must be one of the machine, and the other way round."""
    known = _time_outs(machine, configuration)
    given = {(state, text, number): due for state, text, number, due in saved}
    for state, text, _ in sorted(given.keys() - known.keys()):
        raise SnapshotError(f"state `{state}` has no time-out `{text}`, which runs in the snapshot")
    for state, text, _ in sorted(known.keys() - given.keys()):
        raise SnapshotError(f"state `{state}` has a time-out `{text}` that is missing in the snapshot")
    return {known[key]: int(due) for key, due in given.items() if due is not None}


def _restored_history(machine: CompiledChart, name: str, states: Sequence[str]) -> tuple[int, tuple[int, ...]]:
    index, remembered = _index(machine, name), tuple(_index(machine, one) for one in states)
    if not machine.topology.recalls(index, remembered):
        raise SnapshotError(
            f"`{name}` remembers {' and '.join(f'`{one}`' for one in states)}, which it can no longer enter"
        )
    return index, remembered


def _activity(machine: CompiledChart, index: int) -> str:
    call = machine.model.states[index].activity
    return "" if call is None else activity_text(call)


def _finished(machine: CompiledChart, name: str, activity: str) -> int:
    index = _index(machine, name)
    if _activity(machine, index) != activity:
        raise SnapshotError(f"state `{name}` does `{_activity(machine, index)}` now, and `{activity}` in the snapshot")
    return index


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
    """Deadlines of the time-outs that are the same as before, else of the same duration; of others, from now on."""
    before = _time_outs(old, run.state.configuration)
    after = _time_outs(new, new.configuration(tuple(new.indices[name] for name in _leaf_names(old, run))))
    same = {index: before.pop(key) for key, index in after.items() if key in before}
    lengths: dict[tuple[str, str], list[int]] = {}
    for (state, _, _), index in before.items():
        lengths.setdefault((state, _duration_text(old, index)), []).append(index)
    timers: dict[int, int] = {}
    for (state, _, _), index in after.items():
        candidates = [same[index]] if index in same else lengths.get((state, _duration_text(new, index)), [])
        if not candidates and isinstance(new.model.transitions[index].trigger, Held):
            continue  # it begins when its condition holds
        if not candidates:
            timers[index] = nanoseconds(run.time) + duration(_value(new, _duration(new, index), values))
        elif (due := run.state.timers.get(candidates.pop(0))) is not None:
            timers[index] = due
    return timers


def _leaf_names(machine: CompiledChart, run: SavedRun) -> list[str]:
    return [machine.model.states[leaf].name for leaf in run.state.configuration.leaves]


def _duration(machine: CompiledChart, index: int) -> Expression:
    trigger = machine.model.transitions[index].trigger
    assert isinstance(trigger, Timed), "only time-outs have a duration"
    return trigger.duration


def _duration_text(machine: CompiledChart, index: int) -> str:
    return expression_text(_duration(machine, index))


def _value(machine: CompiledChart, expression: Expression, values: Sequence[Any]) -> Any:
    return machine.generator.test(expression)(None, {}, values, frozenset())
