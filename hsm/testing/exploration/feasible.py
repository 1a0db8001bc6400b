"""Paths through a guard that are logically impossible."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import reduce

from hsm.dsl.logic.formulas import Formula, UndecidedError, both, can_hold, formula_of, negation
from hsm.model.chart import Always, Model, On, Transition, When
from hsm.model.expressions import Binary, Expression
from hsm.model.types import BOOLEAN

CONTRADICTION = "its own conditions contradict each other"
TAKEN_BEFORE = "earlier lines of the same state rule it out"


def ruled_out(model: Model, transition: Transition, found: Iterable[tuple[Expression, bool]]) -> str | None:
    """Why conditions of a guard cannot have certain values; None if they can.

    Args:
        model: the machine.
        transition: whose guard it is.
        found: conditions of the guard, each with its value.
    """
    own: Formula = True
    for condition, held in found:
        formula = formula_of(condition, {})
        own = both(own, formula if held else negation(formula))
    if not _may_hold(own):
        return CONTRADICTION
    # A line is evaluated only after the lines above it with the same trigger were false, with the same signals and
    # variables, since nothing happens in between.
    earlier = [negation(formula_of(one, {})) for one in _asked_before(model, transition)]
    return None if _may_hold(reduce(both, earlier, own)) else TAKEN_BEFORE


def guard_of(transition: Transition) -> Expression | None:
    """The condition of a transition besides its event or time-out; None if there is none."""
    condition = [transition.trigger.condition] if isinstance(transition.trigger, When) else []
    needed = [*condition, *([transition.guard] if transition.guard is not None else [])]
    return reduce(lambda left, right: Binary("and", left, right, BOOLEAN), needed) if needed else None


def _asked_before(model: Model, transition: Transition) -> Iterator[Expression]:
    """The guards of the transitions that come before one and would be taken instead."""
    for index in model.states[transition.source].transitions:
        if index == transition.index:
            return
        guard = guard_of(model.transitions[index])
        if guard is not None and _same_trigger(transition, model.transitions[index]):
            yield guard


def _same_trigger(transition: Transition, other: Transition) -> bool:
    """Whether whatever triggers a transition triggers the other one, too."""
    match transition.trigger, other.trigger:
        case (When(), When()) | (Always(), Always()):
            return True
        case On() as one, On() as before:
            return set(one.names) <= set(before.names) and one.prefix == before.prefix
        case _:
            return False


def _may_hold(formula: Formula) -> bool:
    try:
        return can_hold(formula)
    except UndecidedError:
        return True
