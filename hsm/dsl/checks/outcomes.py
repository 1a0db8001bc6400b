"""How activities, submachines and compound states can end, and whether a transition handles it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from hsm.dsl.logic.formulas import Formula, UndecidedError, case_text, either, formula_of, models, negation
from hsm.dsl.semantics.analysis import AnalysisInput
from hsm.model.chart import On, State, StateKind
from hsm.model.codes import finding
from hsm.model.diagnostics import Diagnostic
from hsm.model.values import dataclass

_MOST_GUARDS = 40


@dataclass(frozen=True, slots=True)
class OutcomeNames:
    """The names under which an outcome can be handled.

    Attributes:
        names: by the state and by those around it.
        own: by the state alone.
    """

    names: tuple[str, ...]
    own: tuple[str, ...] = ()


def check(subject: AnalysisInput) -> Iterator[Diagnostic]:
    """Outcomes that nothing handles, or that are handled only under a condition."""
    for state in subject.own_states():
        if state.index in subject.reporting_unknown:
            continue
        if state.activity is not None and state.instance is None:
            ends = {outcome: OutcomeNames((outcome,)) for outcome in state.activity.activity.outcomes}
            yield from _handled(subject, state, ends, f"of `{state.activity.activity.name}`")
        if state.index > 0 and state.kind is StateKind.COMPOUND:
            finals = [subject.model.states[child] for child in state.children]
            names = [final.name.rpartition(".")[2] for final in finals if final.kind is StateKind.FINAL]
            yield from _handled(
                subject, state, {name: OutcomeNames((name,), ("done",)) for name in names}, f"of `{state.name}`"
            )
        if state.index > 0 and state.kind is StateKind.PARALLEL and _can_complete(subject, state):
            yield from _handled(subject, state, {"done": OutcomeNames((), ("done",))}, f"of `{state.name}`")


def _handled(
    subject: AnalysisInput, state: State, ends: Mapping[str, OutcomeNames], whose: str
) -> Iterator[Diagnostic]:
    """One diagnostic for all outcomes that nothing handles, and one for each that is handled only under a condition.

    Args:
        subject: the machine.
        state: whose outcomes they are.
        ends: how each outcome can be handled.
        whose: the activity or state that has the outcomes, in the author's words.
    """
    place = state.place if state.activity is None or state.activity.place is None else state.activity.place
    never: list[str] = []
    for outcome, end in ends.items():
        if any(name in subject.doubtful for name in (*end.names, *end.own)):
            continue
        handled = _handled_when(subject, state, end)
        if handled is False:
            never.append(outcome)
            continue
        try:
            case = next(models(negation(handled)), None)
        except UndecidedError:
            continue
        if case is not None:
            message = f"nothing handles outcome `{outcome}` {whose} when {case_text(case)}"
            yield finding("N0703", place, message, f"add `on {outcome} -> ...`")
    if never:
        listed = " and ".join(f"`{outcome}`" for outcome in never)
        message = f"nothing handles outcome{'s' * (len(never) > 1)} {listed} {whose}"
        yield finding("W0504", place, message, f"add `on {', '.join(never)} -> ...`")


def _handled_when(subject: AnalysisInput, state: State, end: OutcomeNames) -> Formula:
    """When a transition of the state or of one around it handles an outcome; skipped if there are too many."""
    model = subject.model
    handled: Formula = False
    guards = 0
    names = {*end.names, *end.own}
    while guards <= _MOST_GUARDS:
        if state.index in subject.awaiting_unknown:
            return True
        for number in state.transitions:
            transition = model.transitions[number]
            if isinstance(transition.trigger, On) and not names.isdisjoint(transition.trigger.names):
                guard = True if transition.guard is None else formula_of(transition.guard, {})
                handled, guards = either(handled, guard), guards + 1
        if state.parent < 0 or handled is True:
            return handled
        state, names = model.states[state.parent], set(end.names)
    return True


def _can_complete(subject: AnalysisInput, state: State) -> bool:
    """Whether every region of a parallel state has a final state."""
    states = subject.model.states
    regions = [states[child] for child in state.children]
    return bool(regions) and all(
        any(states[one].kind is StateKind.FINAL for one in region.children) for region in regions
    )
