"""Differences in meaning of an exported machine in SCXML: each with its name, place and a suggestion.

Everything else keeps its meaning: read back, it takes the same transitions at the same stamps.
"""

from __future__ import annotations

from collections.abc import Iterator

from hsm.model.chart import (
    After,
    Defer,
    Emit,
    Every,
    Held,
    Model,
    On,
    Raise,
    Send,
    State,
    StateKind,
    Transition,
    TransitionKind,
    When,
)
from hsm.model.codes import finding
from hsm.model.diagnostics import Diagnostic
from hsm.model.expressions import Literal
from hsm.model.rewriting import actions_of

_WAITS = "SCXML sends the time-out once: a guard that is false then loses it; here it stays due until the guard holds"
_SOONER = "SCXML evaluates a condition before any event, and again between events; here it is evaluated after them"
_ORDER = "SCXML handles the inputs of one tick in order of time; here events come before time-outs"


def differences(model: Model) -> list[Diagnostic]:
    """The parts of a machine whose meaning changes in SCXML; empty if there are none."""
    return [*_transitions(model), *_names(model), *_same_tick(model), *_sent(model), *_parameters(model)]


def _transitions(model: Model) -> Iterator[Diagnostic]:
    raises = any(isinstance(one, Raise) for one in actions_of(model))
    for transition in model.transitions:
        source = model.states[transition.source]
        match transition.trigger:
            case Defer():
                reason = "SCXML has no deferred events: this one is written as a transition that drops it"
                yield _difference(transition, reason, "send the event again, or keep it in a variable")
            case On(prefix=True):
                continue  # read from SCXML
            case On(names):
                yield from _events(transition, names)
                if raises and _only_some_finals(model, source, names):
                    reason = "SCXML checks which final state is active after the machine's own events are handled"
                    yield _difference(
                        transition, reason, ("handle all final states in the same way, or `done` in their own state")
                    )
            case _:
                yield from _timing(transition)
        if _leaves_regions_only(source, transition):
            reason = "SCXML leaves a parallel state with its regions; here `->` leaves the regions alone"
            yield _difference(transition, reason, "write `=>`, which leaves the state in both")


def _timing(transition: Transition) -> Iterator[Diagnostic]:
    """Differences in the meaning of a condition or a time-out."""
    match transition.trigger:
        case When():
            yield _difference(transition, _SOONER, "send an event when the condition becomes true")
        case After(duration):
            if transition.guard is not None:
                yield _difference(transition, _WAITS, "enter the state only when the guard holds")
            if not isinstance(duration, Literal) or duration.value <= 0:
                reason = "SCXML acts on a time-out of zero in the step that enters the state; here in the next"
                yield _difference(transition, reason, "write a time-out above zero")
        case Every():
            if transition.guard is not None or transition.targets:
                yield _difference(transition, _WAITS, "remove the guard and the target from the repeated transition")
        case Held():
            reason = "SCXML cannot express how long a condition holds: only the condition is written"
            yield _difference(transition, reason, "enter a state on the condition, and wait in it")


def _events(transition: Transition, names: tuple[str, ...]) -> Iterator[Diagnostic]:
    """Differences in the meaning of a pattern or a fault."""
    if "*" in names:
        yield _difference(transition, "in SCXML `*` also matches completions and errors", "name the events")
    if "fault" in names:
        reason = "SCXML has no `fault`: an error there undoes nothing, and every state receives it"
        yield _difference(transition, reason, "write `error.execution` by hand where you mean it")


def _only_some_finals(model: Model, source: State, names: tuple[str, ...]) -> bool:
    """Whether a transition waits for some of the final states of a state, and not for all."""
    for around in model.states[max(source.index, 1) : source.last + 1]:
        finals = [model.states[one] for one in around.children if model.states[one].kind is StateKind.FINAL]
        meant = [one for one in finals if one.own_name in names]
        if 0 < len(meant) < len(finals):
            return True
    return False


def _leaves_regions_only(source: State, transition: Transition) -> bool:
    inside = bool(transition.targets) and all(source.index < one <= source.last for one in transition.targets)
    return source.kind is StateKind.PARALLEL and inside and transition.kind is TransitionKind.LOCAL


def _names(model: Model) -> Iterator[Diagnostic]:
    """Events whose names are prefixes of others: SCXML's descriptors match by their leading parts."""
    waited = {one.index: one.trigger.names for one in model.transitions if isinstance(one.trigger, On)}
    sent = {one.event for one in actions_of(model) if isinstance(one, Raise | Send)}
    known = sorted(sent.union(*waited.values(), model.events or ()))
    for index, names in waited.items():
        transition = model.transitions[index]
        for name in names:
            longer = next((one for one in known if one.startswith(f"{name}.")), None)
            if longer is not None:
                reason = f"in SCXML `{name}` also matches `{longer}`"
                yield _difference(transition, reason, "give one of them another name")


def _sent(model: Model) -> Iterator[Diagnostic]:
    """Events to other machines: SCXML sends to a session by its address."""
    for action in actions_of(model):
        if isinstance(action, Emit):
            reason = f"SCXML sends `{action.event}` to a session with an address; here every other machine receives it"
            yield finding("W0923", action.place, reason, "let the program that runs the sessions forward it")


def _parameters(model: Model) -> Iterator[Diagnostic]:
    """Parameters without a value, and those that an operator may change: a chart is given none."""
    for parameter in model.parameters:
        if parameter.required:
            reason = f"parameter `{parameter.name}` has no value: in SCXML it is undefined"
            yield finding("W0923", model.states[0].place, reason, "write a value after its type")
        if model.adjustable_named(parameter.name) is not None:
            reason = f"SCXML has no parameters that an operator may change: `{parameter.name}` keeps its value"
            yield finding("W0923", model.states[0].place, reason, "send an event that carries the value")


def _same_tick(model: Model) -> Iterator[Diagnostic]:
    """One diagnostic for a machine in which a time-out and something else could come in one tick."""
    timed = [one for one in model.transitions if isinstance(one.trigger, After | Every)]
    if timed and len(model.transitions) > 1:
        yield _difference(timed[0], _ORDER, "none is needed where the order within a tick does not matter")


def _difference(transition: Transition, reason: str, hint: str) -> Diagnostic:
    return finding("W0923", transition.place, reason, hint)
