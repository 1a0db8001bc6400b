"""Mutation operators for conditions, times, events, activities and initial states."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

from hsm.model.chart import ActivityCall, After, Defer, Model, On, State, StateKind, Transition, Variable
from hsm.model.diagnostics import Place
from hsm.model.expressions import Binary, Choice, EventValue, Expression, Literal, Unary
from hsm.model.rewriting import Rewriter
from hsm.model.topology import HISTORY
from hsm.model.types import BOOLEAN, Enumeration, Quantity
from hsm.model.unparse import expression_text
from hsm.model.values import dataclass
from hsm.testing.coverage.items import transition_text

_BOUNDARIES = {"<": "<=", "<=": "<", ">": ">=", ">=": ">"}
_COMPARISONS = {"<": ">", "<=": ">=", ">": "<", ">=": "<=", "==": "!=", "!=": "=="}
_LOGICAL = {"and": "or", "or": "and"}
_DEGREE = math.pi / 180


@dataclass(frozen=True, slots=True)
class Mutant:
    """A machine with one mistake.

    Attributes:
        kind: what kind of mistake.
        text: what was changed.
        place: where.
        model: the machine with the mistake.
        state: index of the state that it is in; 0 where it is in none.
        transitions: indices of the transitions that it is in; none where it may show without a look at them.
    """

    kind: str
    text: str
    place: Place | None
    model: Model
    state: int = 0
    transitions: tuple[int, ...] = ()


def in_expressions(model: Model) -> Iterator[Mutant]:
    """Another comparison, with or without its boundary; ``and`` for ``or``; a number in a smaller unit."""
    for node, (state, transitions) in written_parts(model).items():
        for kind, changed in (*_changes(node), *_other_parts(model, node)):
            text = f"{expression_text(node)} to {expression_text(changed)}"

            def change(one: Expression, node: Expression = node, changed: Expression = changed) -> Expression:
                return changed if one == node else one

            yield Mutant(kind, text, node.place, Rewriter(change).model(model), state, transitions)


def _changes(node: Expression) -> Iterator[tuple[str, Expression]]:
    match node:
        case Binary(operator) if operator in _COMPARISONS:
            yield "comparison", replace(node, operator=_COMPARISONS[operator])
            if operator in _BOUNDARIES:
                yield "boundary", replace(node, operator=_BOUNDARIES[operator])
        case Binary(operator) if operator in _LOGICAL and node.type == BOOLEAN:
            yield "logical operator", replace(node, operator=_LOGICAL[operator])
        case Choice(_, then, otherwise) if then.type == otherwise.type:
            yield "swapped choice", replace(node, then=otherwise, otherwise=then)
        case Literal(value, Quantity() as kind) if value and (kind.length or kind.time or kind.angle):
            factor = 0.01 if kind.length else 0.001 if kind.time and not kind.angle else _DEGREE
            yield "wrong unit", replace(node, value=value * factor)


def _other_parts(model: Model, node: Expression) -> Iterator[tuple[str, Expression]]:
    """Another part of what the event carries, of the same type."""
    if isinstance(node, EventValue):
        for declared in model.event_data:
            names = [declared.variable(one) for one in declared.fields if one.type == node.type]
            if node.name in names and len(names) > 1:
                yield "other part of an event", replace(node, name=names[names.index(node.name) - 1])


def written_parts(model: Model, variables: Iterable[Variable] = ()) -> dict[Expression, tuple[int, tuple[int, ...]]]:
    """All parts of expressions with a place, each with the state and the transition that it belongs to.

    Args:
        model: the machine.
        variables: those whose initial values belong to it as well.
    """
    found: dict[Expression, tuple[int, tuple[int, ...]]] = {}
    owner: tuple[int, tuple[int, ...]] = (0, ())

    def collect(one: Expression) -> Expression:
        if one.place is not None:
            found.setdefault(one, owner)
        return one

    collector = Rewriter(collect)
    for state in model.states:
        owner = (state.index, ())
        collector.state(state)
    for transition in model.transitions:
        owner = (transition.source, (transition.index,))
        collector.transition(transition)
    for variable in variables:
        owner = (variable.scope, ())
        collector.expression(variable.initial)
    return found


def in_transitions(model: Model) -> Iterator[Mutant]:
    """A guard left out, another event of the same state, a time-out of twice its duration."""
    for one in model.transitions:
        for kind, changed in _transition_changes(model, one):
            transitions = list(model.transitions)
            transitions[one.index] = changed
            mutated = replace(model, transitions=tuple(transitions))
            # A transition that hears other events may be taken where it was never looked at.
            only = () if changed.trigger != one.trigger and isinstance(changed.trigger, On) else (one.index,)
            yield Mutant(kind, transition_text(model, one), one.place, mutated, one.source, only)


def _transition_changes(model: Model, transition: Transition) -> Iterator[tuple[str, Transition]]:
    if transition.guard is not None:
        yield "dropped guard", replace(transition, guard=None)
    match transition.trigger:
        case Defer():
            yield "dropped defer", replace(transition, trigger=On(()))
        case On(names):
            listed = [model.transitions[index].trigger for index in model.states[transition.source].transitions]
            others = [one.names for one in listed if isinstance(one, On) and one.names != names]
            if others:
                yield "swapped event", replace(transition, trigger=replace(transition.trigger, names=others[0]))
        case After(duration):
            doubled = Binary("*", duration, Literal(2.0, Quantity()), duration.type)
            yield "doubled time-out", replace(transition, trigger=After(doubled))


def in_states(model: Model) -> Iterator[Mutant]:
    """An activity left out, replaced or with another argument, another initial state, the other kind of history."""
    calls = [state.activity for state in model.states if state.activity is not None]
    for state in model.states[1:]:
        for kind, text, changed in (*_state_changes(model, state), *_other_activity(state, calls)):
            states = list(model.states)
            states[changed.index] = changed
            yield Mutant(kind, text, changed.place, replace(model, states=tuple(states)), changed.index)


def _state_changes(model: Model, state: State) -> Iterator[tuple[str, str, State]]:
    if state.activity is not None:
        yield "dropped activity", f"{state.name}: {state.activity.activity.name}", replace(state, activity=None)
        for number, argument in enumerate(state.activity.arguments):
            other = _other_argument(argument)
            if other is not None:
                text = f"{state.name}: {expression_text(argument)} to {expression_text(other)}"
                call = _with_argument(state.activity, number, other)
                yield "wrong argument", text, replace(state, activity=call)
    if state.kind is StateKind.COMPOUND and len(state.initial) == 1:
        others = [one for one in state.children if one not in state.initial and model.states[one].kind not in HISTORY]
        if others:
            text = f"{state.name}: {model.states[others[0]].name}"
            yield "wrong initial state", text, replace(state, initial=(others[0],))
    if state.kind in HISTORY:
        deep = state.kind is StateKind.SHALLOW_HISTORY
        kind = StateKind.DEEP_HISTORY if deep else StateKind.SHALLOW_HISTORY
        yield "history kind", f"{state.name}: {kind.value}", replace(state, kind=kind)


def _other_activity(state: State, calls: Sequence[ActivityCall]) -> Iterator[tuple[str, str, State]]:
    """The activity of the next state that has another one."""
    if state.activity is None:
        return
    own = state.activity.activity.name
    at = next(number for number, one in enumerate(calls) if one is state.activity)
    other = next((one for one in (*calls[at:], *calls[:at]) if one.activity.name != own), None)
    if other is not None:
        text = f"{state.name}: {own} to {other.activity.name}"
        yield "wrong activity", text, replace(state, activity=other)


def _other_argument(argument: Expression) -> Expression | None:
    match argument:
        case Literal(value, Enumeration(members=members)):
            other = next((one for one in members if one != value), None)
            return None if other is None else replace(argument, value=type(value)(other))
        case Literal(value, Quantity()) if value:
            return Unary("-", argument, argument.type)
    return None


def _with_argument(call: ActivityCall, number: int, argument: Expression) -> ActivityCall:
    arguments = (*call.arguments[:number], argument, *call.arguments[number + 1 :])
    return replace(call, arguments=arguments)
