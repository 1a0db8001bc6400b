"""Expressions evaluated one node at a time: to explain a step afterwards, and to continue after a signal failed.

The engine runs generated code; this evaluator is slower and has the same order of evaluation.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import field
from typing import Any

from hsm.model.expressions import (
    Active,
    Binary,
    Choice,
    Computed,
    Expression,
    Literal,
    SignalValue,
    Unary,
    VariableValue,
)
from hsm.model.types import BOOLEAN
from hsm.model.values import dataclass

UNSET: Any = object()
"""Represents a signal that was not evaluated yet."""

UNARY: dict[str, Callable[[Any], Any]] = {"not": operator.not_, "-": operator.neg, "abs": abs}
BINARY: dict[str, Callable[[Any, Any], Any]] = {
    "==": operator.eq,
    "!=": operator.ne,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
    "min": min,
    "max": max,
}


class SignalFault(Exception):  # noqa: N818 - a fault is the language's word
    """A signal that failed in this step; the original exception is the ``__cause__``."""

    def __init__(self, call: SignalValue, error: BaseException) -> None:
        self.call = call
        self.__cause__ = error
        super().__init__(f"signal `{call.signal.name}` failed: {error!r}")


@dataclass(slots=True)
class Evaluation:
    """The values that expressions use at one moment within a step.

    Attributes:
        values: the variables.
        slots: where each variable is in ``values``.
        active: indices of the active states.
        states: index of each state by its name.
        memo: the signals evaluated in this step, by key.
        key: gives the key of a call.
        ask: evaluates a signal that is not in ``memo``; raises ``SignalFault``.
    """

    values: Sequence[Any]
    slots: Mapping[str, int]
    active: Collection[int]
    states: Mapping[str, int]
    memo: Mapping[Any, Any]
    key: Callable[[SignalValue, Sequence[Any]], Any]
    ask: Callable[[SignalValue], Any]
    asked: dict[Any, SignalValue] = field(default_factory=dict)

    def condition(self, expression: Expression) -> Any:
        """The value of a condition; like the generated code, fetches its signals first."""
        for call in eager_signals(expression):
            self.value(call)
        return self.value(expression)

    def value(self, expression: Expression) -> Any:
        """The value of an expression."""
        match expression:
            case Literal(value):
                return value
            case VariableValue(name):
                return self.values[self.slots[name]]
            case Computed():
                return expression.compute(self.memo, self.active)
            case SignalValue():
                key = self.key(expression, self.values)
                self.asked[key] = expression
                value = self.memo.get(key, UNSET)
                return self.ask(expression) if value is UNSET else value
            case Active(state):
                return self.states[state] in self.active
            case Unary(name, operand):
                return UNARY[name](self.value(operand))
            case Binary("and", left, right):
                return self.value(left) and self.value(right)
            case Binary("or", left, right):
                return self.value(left) or self.value(right)
            case Binary(name, left, right):
                return BINARY[name](self.value(left), self.value(right))
            case Choice(condition, then, otherwise):
                return self.value(then) if self.value(condition) else self.value(otherwise)


def eager_signals(expression: Expression) -> Iterator[SignalValue]:
    """The signals that are evaluated whenever the expression is: all but those that ``and``, ``or``, a choice skip."""
    match expression:
        case Computed():
            return
        case SignalValue():
            yield expression
        case Unary(_, operand):
            yield from eager_signals(operand)
        case Binary("and" | "or", left, _) if expression.type == BOOLEAN:
            yield from eager_signals(left)
        case Binary(_, left, right):
            yield from eager_signals(left)
            yield from eager_signals(right)
        case Choice(condition):
            yield from eager_signals(condition)


def all_signals(expression: Expression) -> Iterator[SignalValue]:
    """All signals in an expression."""
    match expression:
        case Computed():
            return
        case SignalValue():
            yield expression
        case Unary(_, operand):
            yield from all_signals(operand)
        case Binary(_, left, right):
            yield from all_signals(left)
            yield from all_signals(right)
        case Choice(condition, then, otherwise):
            for one in (condition, then, otherwise):
                yield from all_signals(one)
