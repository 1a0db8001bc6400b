"""Parallel regions that react to the same event or condition with transitions that exclude each other."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import islice, product

from hsm.dsl.checks.flow import domain_of
from hsm.dsl.logic.formulas import Formula, UndecidedError, both, can_hold, formula_of
from hsm.dsl.semantics.analysis import AnalysisInput
from hsm.model.chart import Model, On, State, StateKind, Transition, When
from hsm.model.codes import finding
from hsm.model.diagnostics import Diagnostic, Related

_MOST_PAIRS = 2000


def check(subject: AnalysisInput) -> Iterator[Diagnostic]:
    """Transitions of two regions that can be enabled at once while one of them leaves the parallel state."""
    model = subject.model
    for state in subject.own_states():
        if state.kind is not StateKind.PARALLEL:
            continue
        regions = [_transitions(subject, model.states[child]) for child in state.children]
        rivals: dict[int, list[Transition]] = {}
        for first, second in islice(_pairs(regions), _MOST_PAIRS):
            if _collide(model, state, first, second):
                rivals.setdefault(second.index, []).append(first)
        for index, earlier in rivals.items():
            yield from _finding(subject, earlier, model.transitions[index])


def _pairs(regions: Sequence[Sequence[Transition]]) -> Iterator[tuple[Transition, Transition]]:
    """All pairs of transitions of two regions."""
    for position, later in enumerate(regions):
        for earlier in regions[:position]:
            yield from product(earlier, later)


def _finding(subject: AnalysisInput, earlier: Sequence[Transition], later: Transition) -> Iterator[Diagnostic]:
    """One diagnostic for a transition with all those of earlier regions that exclude it."""
    places = [one.place for one in earlier if one.place is not None]
    if not places or later.place is None or later.place.file != subject.file:
        return
    message = "this transition and one of an earlier region exclude each other: the earlier region's wins"
    yield finding("N0704", later.place, message, related=tuple(Related(place, "the earlier one") for place in places))


def _transitions(subject: AnalysisInput, region: State) -> list[Transition]:
    """The transitions in a region that leave or enter something."""
    model = subject.model
    return [
        model.transitions[number]
        for state in region.subtree
        for number in model.states[state].transitions
        if model.transitions[number].targets and number not in subject.uncertain
    ]


def _collide(model: Model, parallel: State, first: Transition, second: Transition) -> bool:
    """Whether the same event or condition can enable both, and one of them exits the region of the other."""
    outside = [domain_of(model, one).index <= parallel.index for one in (first, second)]
    if not any(outside):
        return False
    match first.trigger, second.trigger:
        case On(names), On(others):
            shared = set(names) & set(others) - {"done", "fault"}
            return bool(shared) and _together(_guard(first), _guard(second))
        case When(condition), When(other):
            conditions = both(formula_of(condition, {}), formula_of(other, {}))
            return _together(conditions, both(_guard(first), _guard(second)))
    return False


def _guard(transition: Transition) -> Formula:
    return True if transition.guard is None else formula_of(transition.guard, {})


def _together(first: Formula, second: Formula) -> bool:
    try:
        return can_hold(both(first, second))
    except UndecidedError:
        return True
