"""Symbolic evaluation of a machine's expressions, if not all values are known."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from math import inf

from hsm.model.expressions import Active, Binary, Choice, Expression, Literal, SignalValue, Unary, VariableValue
from hsm.model.types import BOOLEAN, Boolean, Quantity, Type
from hsm.model.values import dataclass
from hsm.testing.proofs.diagrams import FALSE
from hsm.testing.proofs.values import (
    DEAD,
    NO,
    UNKNOWN,
    YES,
    Arithmetic,
    Derived,
    Exact,
    OneOf,
    Symbols,
    Truth,
    Undecided,
    Value,
)

COMPARISONS = frozenset(("==", "!=", "<", "<=", ">", ">="))
_MIRRORED = {"==": "==", "!=": "!=", "<": ">", "<=": ">=", ">": "<", ">=": "<="}


@dataclass(slots=True)
class Evaluator:
    """Evaluates expressions at one moment within a step.

    Attributes:
        symbols: represent unknown values.
        slots: where each variable is.
        states: index of each state by its name.
        values: the variables.
        active: the active states.
        compared: receives each symbol that is compared with a known value.
    """

    symbols: Symbols
    slots: Mapping[str, int]
    states: Mapping[str, int]
    values: Sequence[Value] = ()
    active: Collection[int] = frozenset()
    compared: Callable[[Derived, Exact], None] = lambda _left, _right: None

    def at(self, values: Sequence[Value], active: Collection[int]) -> Evaluator:
        """The same at another moment."""
        return Evaluator(self.symbols, self.slots, self.states, values, active, self.compared)

    def truth(self, expression: Expression) -> Truth:
        """Where a condition is true and where it is false."""
        return self.symbols.truth_of(self.value(expression))

    def value(self, expression: Expression) -> Value:
        """The value of an expression.

        Raises:
            Undecided: it has a feature that proofs do not support.
        """
        match expression:
            case Literal(value):
                return Exact.of(value)
            case VariableValue(name):
                value = self.values[self.slots[name]]
                if value is DEAD:  # a fault of ``liveness``, which may not become a false proof
                    raise Undecided(f"`{name}` is read where it has no value")
                return value
            case SignalValue():
                arguments = tuple(map(self.value, expression.arguments))
                return Derived(self.symbols.number("signal", (expression.signal.name, arguments), expression.type))
            case Active(state):
                return Exact.of(self.states[state] in self.active)
            case Unary("not", operand):
                return self.symbols.negated(self.truth(operand))
            case Unary(operator, operand):
                return Arithmetic(self.symbols).unary(operator, self.value(operand), expression.type)
            case Binary("and", left, right):
                first = self.truth(left)
                return first if first.true == 0 else self.symbols.both(first, self.truth(right))
            case Binary("or", left, right):
                first = self.truth(left)
                return first if first.false == 0 else self.symbols.either(first, self.truth(right))
            case Binary(operator, left, right) if operator in COMPARISONS:
                return self._compared(operator, self.value(left), self.value(right), left)
            case Binary(operator, left, right):
                return Arithmetic(self.symbols).binary(operator, self.value(left), self.value(right), expression.type)
            case Choice(condition, then, otherwise):
                return self._chosen(self.truth(condition), then, otherwise)
        raise Undecided(f"an expression that proofs do not support ({expression.place})")

    def _chosen(self, condition: Truth, then: Expression, otherwise: Expression) -> Value:
        """A conditional value; only the chosen branch is evaluated."""
        if condition.true == FALSE:
            return self.value(otherwise) if condition.false != FALSE else UNKNOWN
        if condition == YES:
            return self.value(then)
        return OneOf(condition, self.value(then), self.value(otherwise))

    def _compared(self, operator: str, left: Value, right: Value, first: Expression) -> Value:
        if UNKNOWN in (left, right):
            return UNKNOWN
        if isinstance(left, Truth) or isinstance(right, Truth) or isinstance(first.type, Boolean):
            return self._same(operator, self.symbols.truth_of(left), self.symbols.truth_of(right))
        match left, right:
            case OneOf(condition, then, otherwise), _:
                ways = (self.symbols.truth_of(self._compared(operator, one, right, first)) for one in (then, otherwise))
                return self.symbols.chosen(condition, *ways)
            case _, OneOf(condition, then, otherwise):
                ways = (self.symbols.truth_of(self._compared(operator, left, one, first)) for one in (then, otherwise))
                return self.symbols.chosen(condition, *ways)
            case Exact(), Exact():
                return self._both_known(operator, left, right)
            case Derived(), Exact():
                self.compared(left, right)
                return self.symbols.compared(operator, left, right)
            case Exact(), Derived():
                self.compared(right, left)
                return self.symbols.compared(_MIRRORED[operator], right, left)
            case Derived(), Derived() if left == right:
                return self._itself(operator, left, first.type)
        number = self.symbols.number("arithmetic", (operator, left, right), BOOLEAN)
        held = self.symbols.between(number, 1, 1)
        return Truth(held, self.symbols.diagrams.complement(held))

    def _itself(self, operator: str, value: Derived, kind: Type) -> Truth:
        """A value compared with itself: it is equal, unless it is not a number."""
        equal = self.symbols.compared(">=", value, Exact.of(-inf)) if isinstance(kind, Quantity) else YES
        if operator in ("<", ">"):
            return NO
        return self.symbols.negated(equal) if operator == "!=" else equal

    def _both_known(self, operator: str, left: Exact, right: Exact) -> Value:
        result = Arithmetic(self.symbols).binary(operator, left, right, BOOLEAN)
        if None in (left.value, right.value) and operator in ("==", "!="):
            return Exact.of((left.value == right.value) == (operator == "=="))
        return result

    def _same(self, operator: str, left: Truth, right: Truth) -> Truth:
        """Two conditions compared with one another."""
        symbols = self.symbols
        equal = symbols.either(symbols.both(left, right), symbols.both(symbols.negated(left), symbols.negated(right)))
        if operator == "==":
            return equal
        if operator == "!=":
            return symbols.negated(equal)
        raise Undecided("an order of two conditions")
