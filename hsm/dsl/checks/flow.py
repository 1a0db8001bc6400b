"""Reachability: states that nothing enters, and states that nothing leaves."""

from __future__ import annotations

from collections.abc import Iterator

from hsm.dsl.semantics.analysis import AnalysisInput
from hsm.model.chart import Model, State, StateKind, Transition, TransitionKind
from hsm.model.codes import finding
from hsm.model.diagnostics import Diagnostic


def check(subject: AnalysisInput) -> Iterator[Diagnostic]:
    """Unreachable states, and states with no way out."""
    reached = reachable(subject.model)
    if not subject.leading_anywhere:
        yield from _unreached(subject, reached)
    yield from _dead_ends(subject, reached)


def reachable(model: Model) -> list[bool]:
    """For each state, whether some sequence of transitions enters it."""
    reached = [False] * len(model.states)
    _walk(model, 0, reached)
    return reached


def _walk(model: Model, first: int, seen: list[bool]) -> list[int]:
    """Mark all states that can be entered from one; return the new ones in postorder."""
    left: list[int] = []
    seen[first] = True
    stack = [(first, _next(model, first))]
    while stack:
        index, further = stack[-1]
        for one in further:
            if not seen[one]:
                seen[one] = True
                stack.append((one, _next(model, one)))
                break
        else:
            left.append(index)
            stack.pop()
    return left


def _next(model: Model, index: int) -> Iterator[int]:
    """The states that are entered along with a state, or from it."""
    state = model.states[index]
    if state.parent >= 0:
        yield state.parent
    yield from state.children if state.kind is StateKind.PARALLEL else state.initial
    for number in state.transitions:
        yield from model.transitions[number].targets


def _unreached(subject: AnalysisInput, reached: list[bool]) -> Iterator[Diagnostic]:
    """The outermost states that nothing enters, without the states that they lead to or contain."""
    model = subject.model
    outermost = {
        state.index: state for state in subject.own_states() if not reached[state.index] and reached[state.parent]
    }
    seen, order = reached[:], list[int]()
    for index in outermost:
        if not seen[index]:
            order += _walk(model, index, seen)
    # In reverse postorder a state comes before all that it leads to, except for those that lead back to it.
    seen = reached[:]
    for index in reversed(order):
        state = outermost.get(index)
        if state is None or seen[index]:
            continue
        _walk(model, index, seen)
        hint = "add a transition to it, or remove the state"
        if state.kind is StateKind.FINAL and state.parent > 0:
            hint = f"nothing in `{model.states[state.parent].name}` has it as a target"
        yield finding("W0501", state.place, f"no transition enters state `{state.name}`", hint)


def _dead_ends(subject: AnalysisInput, reached: list[bool]) -> Iterator[Diagnostic]:
    model = subject.model
    outermost = _outermost_domains(model)
    for state in subject.own_states():
        if state.kind is not StateKind.ATOMIC or not reached[state.index] or state.index in subject.reporting_unknown:
            continue
        if not subject.uncertain.isdisjoint(state.transitions):
            continue
        if not _has_way_out(model, state, outermost):
            hint = "add a transition that leaves it, or make it `final`"
            yield finding("W0502", state.place, f"once in `{state.name}` the machine cannot leave it", hint)


def _has_way_out(model: Model, state: State, outermost: list[int]) -> bool:
    """Whether a transition of the state, of one around it or of a sibling region leaves the state."""
    current = state
    if any(set(model.transitions[number].targets) - {state.index} for number in state.transitions):
        return True
    while current.parent >= 0:
        current = model.states[current.parent]
        if current.kind is StateKind.PARALLEL and outermost[current.index] < current.index:
            return True
        for number in current.transitions:
            transition = model.transitions[number]
            if transition.targets and _leaves(model, transition, state):
                return True
    return False


def _leaves(model: Model, transition: Transition, state: State) -> bool:
    """Whether a transition of a state around ``state`` exits it, and does not just enter it again."""
    domain = domain_of(model, transition)
    return domain.index != state.index and transition.targets != (state.index,)


def domain_of(model: Model, transition: Transition) -> State:
    """The innermost compound state that a transition does not leave; its source's own, where it goes nowhere."""
    source = model.states[transition.source]
    inside = all(target in source.subtree[1:] for target in transition.targets)
    if transition.kind is TransitionKind.LOCAL and inside and source.kind is StateKind.COMPOUND:
        return source
    current = source
    while current.parent >= 0:
        current = model.states[current.parent]
        if current.kind is StateKind.COMPOUND and all(one in current.subtree[1:] for one in transition.targets):
            return current
    return current


def _outermost_domains(model: Model) -> list[int]:
    """For each state, the smallest index of a domain among the transitions in it: how far out it can be left."""
    found = [state.index for state in model.states]
    for state in reversed(model.states):
        for number in state.transitions:
            transition = model.transitions[number]
            if transition.targets:
                found[state.index] = min(found[state.index], domain_of(model, transition).index)
        if state.parent >= 0:
            found[state.parent] = min(found[state.parent], found[state.index])
    return found
