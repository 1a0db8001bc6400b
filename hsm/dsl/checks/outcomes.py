"""How activities, submachines and compound states can end, and whether something is done about it."""

from __future__ import annotations

from collections.abc import Iterator

from hsm.codes import finding
from hsm.diagnostics import Diagnostic
from hsm.dsl.logic import Formula, UndecidedError, case_text, either, formula_of, models, negation
from hsm.dsl.subject import Subject
from hsm.model import On, State, StateKind

_MOST_GUARDS = 40


def check(subject: Subject) -> Iterator[Diagnostic]:
    """Outcomes that nothing handles, or that are handled only under a condition."""
    for state in subject.own_states():
        if state.index in subject.opaque:
            continue
        if state.activity is not None and state.instance is None:
            for outcome in state.activity.activity.outcomes:
                what = f"outcome `{outcome}` of `{state.activity.activity.name}`"
                yield from _handled(subject, state, (outcome,), what)
        if state.index > 0 and state.kind is StateKind.COMPOUND:
            for child in state.children:
                final = subject.model.states[child]
                if final.kind is StateKind.FINAL:
                    name = final.name.rpartition(".")[2]
                    yield from _handled(subject, state, (name, "done"), f"outcome `{name}` of `{state.name}`")
        if state.index > 0 and state.kind is StateKind.PARALLEL and _can_complete(subject, state):
            yield from _handled(subject, state, ("done",), f"the completion of `{state.name}`")


def _handled(subject: Subject, state: State, names: tuple[str, ...], what: str) -> Iterator[Diagnostic]:
    if not subject.doubtful.isdisjoint(names):
        return
    handled = _handled_when(subject, state, names)
    place = state.place if state.activity is None or state.activity.place is None else state.activity.place
    if handled is False:
        yield finding("W0504", place, f"nothing handles {what}", f"add `on {names[0]} -> ...`")
        return
    try:
        case = next(models(negation(handled)), None)
    except UndecidedError:
        return
    if case is not None:
        yield finding("N0703", place, f"nothing handles {what} when {case_text(case)}", f"add `on {names[0]} -> ...`")


def _handled_when(subject: Subject, state: State, names: tuple[str, ...]) -> Formula:
    """When a transition of the state or of one around it is on one of the names; with very many it is not looked at."""
    model = subject.model
    handled: Formula = False
    guards = 0
    while guards <= _MOST_GUARDS:
        for number in state.transitions:
            transition = model.transitions[number]
            if isinstance(transition.trigger, On) and not set(names).isdisjoint(transition.trigger.names):
                guard = True if transition.guard is None else formula_of(transition.guard, {})
                handled, guards = either(handled, guard), guards + 1
        if state.parent < 0 or handled is True:
            return handled
        state = model.states[state.parent]
    return True


def _can_complete(subject: Subject, state: State) -> bool:
    """Whether every region of a parallel state has a final state."""
    states = subject.model.states
    regions = [states[child] for child in state.children]
    return all(any(states[one].kind is StateKind.FINAL for one in region.children) for region in regions)
