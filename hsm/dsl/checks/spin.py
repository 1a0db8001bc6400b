"""Loops of ``when`` transitions that could repeat within one tick, because nothing on the way changes a condition."""

from __future__ import annotations

from collections.abc import Iterator, Set

from hsm.dsl.logic.formulas import (
    Formula,
    UndecidedError,
    both,
    can_hold,
    case_text,
    formula_of,
    models,
    negation,
    terms_of,
)
from hsm.dsl.semantics.analysis import AnalysisInput
from hsm.model.chart import Assign, Model, State, StateKind, Transition, When
from hsm.model.codes import finding
from hsm.model.diagnostics import Diagnostic, Related
from hsm.model.values import dataclass

_LONGEST_LOOP = 8
_MOST_STEPS = 2000
_MOST_TRANSITIONS = 40


@dataclass(frozen=True, slots=True)
class LoopStep:
    """A step from one atomic state to another within a tick: a transition and the condition under which it fires."""

    transition: Transition
    condition: Formula
    target: int


def check(subject: AnalysisInput) -> Iterator[Diagnostic]:
    """One diagnostic for each loop, at its first transition."""
    model = subject.model
    atomic = (state for state in model.states if state.kind is StateKind.ATOMIC)
    steps = {state.index: _steps(model, state, subject.uncertain) for state in atomic}
    steps = _on_loops(steps)
    told: set[frozenset[int]] = set()
    for start in steps:
        for loop, case in _loops(steps, start):
            places = [one.transition.place for one in loop if one.transition.place is not None]
            key = frozenset(one.transition.index for one in loop)
            if key in told or not places or places[0].file != subject.file:
                continue
            told.add(key)
            message = f"these transitions can repeat without end within one tick when {case}"
            related = tuple(Related(place, "then this one") for place in places[1:])
            yield finding("W0505", places[0], message, "change the conditions so that they exclude each other", related)


def _steps(model: Model, state: State, uncertain: Set[int]) -> list[LoopStep]:
    """The ``when`` transitions that can fire in an atomic state: its own first, then those of the states around it."""
    found: list[LoopStep] = []
    blocked: Formula = True
    current = state
    while len(found) <= _MOST_TRANSITIONS:
        for number in current.transitions[:_MOST_TRANSITIONS]:
            transition = model.transitions[number]
            if not isinstance(transition.trigger, When) or number in uncertain:
                continue
            condition = formula_of(transition.trigger.condition, {})
            if transition.guard is not None:
                condition = both(condition, formula_of(transition.guard, {}))
            for leaf in _leaves(model, transition, state):
                found.append(LoopStep(transition, both(condition, blocked), leaf))
            blocked = both(blocked, negation(condition))
        if current.parent < 0:
            break
        current = model.states[current.parent]
    return found


def _leaves(model: Model, transition: Transition, state: State) -> list[int]:
    """The atomic states that a transition leads to, as far as that does not depend on what was before."""
    if not transition.targets:
        return [state.index]
    found: list[int] = []
    pending, seen = list(transition.targets), set[int]()
    while pending:
        target = model.states[pending.pop()]
        if target.index in seen:
            continue  # an initial state that leads back to itself, which is an error of its own
        seen.add(target.index)
        if target.kind is StateKind.ATOMIC:
            found.append(target.index)
        elif target.kind in (StateKind.COMPOUND, StateKind.SHALLOW_HISTORY, StateKind.DEEP_HISTORY):
            pending.extend(target.initial)
        elif target.kind is StateKind.PARALLEL:
            pending.extend(target.children)
    return found


def _on_loops(steps: dict[int, list[LoopStep]]) -> dict[int, list[LoopStep]]:
    """Only the states on cycles: those with no step in or no step out are removed repeatedly."""
    while True:
        entered = {step.target for found in steps.values() for step in found}
        kept = {
            state: [step for step in found if step.target in steps]
            for state, found in steps.items()
            if found and state in entered
        }
        if kept == steps:
            return kept
        steps = kept


def _ways_back(steps: dict[int, list[LoopStep]], start: int) -> dict[int, int]:
    """The least number of steps from each later state back to a state, within the longest loop."""
    sources: dict[int, list[int]] = {}
    found, front = {start}, [start]
    for _ in range(_LONGEST_LOOP):
        reached: list[int] = []
        for state in front:
            for step in steps[state]:
                if step.target >= start:
                    sources.setdefault(step.target, []).append(state)
                    if step.target not in found:
                        found.add(step.target)
                        reached.append(step.target)
        front = reached
    far = {start: 0}
    front = [start]
    while front:
        state = front.pop(0)
        for source in sources.get(state, ()):
            if source not in far:
                far[source] = far[state] + 1
                front.append(source)
    return far


def _loops(steps: dict[int, list[LoopStep]], start: int) -> Iterator[tuple[list[LoopStep], str]]:
    """Loops through a state and states after it, with a case in which they repeat."""
    far = _ways_back(steps, start)
    pending: list[tuple[int, list[LoopStep], Formula]] = [(start, [], True)]
    tried = 0
    while pending and tried < _MOST_STEPS:
        state, path, condition = pending.pop()
        for step in steps[state]:
            tried += 1
            if len(path) + far.get(step.target, _LONGEST_LOOP) >= _LONGEST_LOOP:
                continue
            longer, combined = [*path, step], both(condition, step.condition)
            try:
                if not can_hold(combined):
                    continue
                if step.target == start:
                    if not _changes(longer, combined):
                        yield longer, case_text(next(models(combined)))
                elif all(step.target != one.target for one in path):
                    pending.append((step.target, longer, combined))
            except UndecidedError:
                continue


def _changes(loop: list[LoopStep], condition: Formula) -> bool:
    """Whether an action in the loop sets a variable that the conditions use."""
    terms = " ".join(terms_of(condition))
    return any(
        isinstance(action, Assign) and action.variable in terms for step in loop for action in step.transition.actions
    )
