"""Symbolic values within a step: a known value, or an expression over a symbol.

A symbol represents the value of a signal in this step, for a variable of which only a region is known, or for the
result of arithmetic that is not followed. A value that follows from one symbol by a chain of operations with constants
is piecewise monotone in it, in floats as in real numbers; so the place where it crosses a constant is found by
bisection over the floats, with the operations of the engine.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Iterator, Sequence
from typing import Any

from hsm.engine.evaluation import BINARY, UNARY
from hsm.model.types import Enumeration, Integer, Type
from hsm.model.values import dataclass
from hsm.testing.proofs.diagrams import FALSE, TRUE, Diagram, Diagrams
from hsm.testing.proofs.ordinals import NOT_A_NUMBER, domain, held, value_at


@dataclass(frozen=True, slots=True)
class Exact:
    """A value that is known; None where a variable has none yet.

    Attributes:
        value: the value.
        kind: its class, so that 1, 1.0 and true are three values.
    """

    value: Any
    kind: type

    @staticmethod
    def of(value: Any) -> Exact:
        """A known value; every NaN is the same, and so are the two zeros."""
        if isinstance(value, float):
            value = math.nan if math.isnan(value) else value + 0.0
        return Exact(value, type(value))


@dataclass(frozen=True, slots=True)
class Region:
    """Between two steps: a variable somewhere between two ordinals, both included."""

    least: int
    most: int


@dataclass(frozen=True, slots=True)
class ConstantOperation:
    """One operation with a constant.

    Attributes:
        operator: of the language.
        constant: the other operand; 1 and 1.0 give different results. None for an operation with one operand.
        left: whether the constant is the left operand.
    """

    operator: str
    constant: Exact | None = None
    left: bool = False

    def apply(self, value: Any) -> Any:
        """The result, as the engine has it."""
        if self.constant is None:
            return UNARY[self.operator](value)
        other = self.constant.value
        return BINARY[self.operator](*((other, value) if self.left else (value, other)))


@dataclass(frozen=True, slots=True)
class Derived:
    """A value computed from one symbol.

    Attributes:
        symbol: its number.
        steps: the operations, the first one first; none for the symbol itself.
    """

    symbol: int
    steps: tuple[ConstantOperation, ...] = ()

    def apply(self, value: Any) -> Any:
        """The value for a value of the symbol."""
        for step in self.steps:
            value = step.apply(value)
        return value


@dataclass(frozen=True, slots=True)
class Truth:
    """A condition: where it is true and where it is false; elsewhere it cannot be evaluated."""

    true: Diagram
    false: Diagram


@dataclass(frozen=True, slots=True)
class OneOf:
    """One of two values, by a condition.

    Attributes:
        condition: where it is the first, and where the second.
        then: the first.
        otherwise: the second.
    """

    condition: Truth
    then: Value
    otherwise: Value

    @property
    def depth(self) -> int:
        """How many conditions decide, one after the other."""
        return 1 + max(one.depth if isinstance(one, OneOf) else 0 for one in (self.then, self.otherwise))


Value = Exact | Derived | Truth | OneOf

UNKNOWN = Truth(FALSE, FALSE)
"""A value that cannot be evaluated."""

NOTHING = Exact.of(None)
"""The value of a variable that has none yet."""


class _NotReadAgain:
    """The class of the value of a variable that is not read again."""


DEAD = Exact(None, _NotReadAgain)
"""The value of a variable that is not read again."""

YES = Truth(TRUE, FALSE)
NO = Truth(FALSE, TRUE)

_MONOTONE = {"+", "-", "*", "/", "min", "max"}


@dataclass(frozen=True, slots=True)
class Symbol:
    """What a symbol represents.

    Attributes:
        key: a signal with its arguments, a variable, the data of an event, or arithmetic; equal keys are one symbol.
        type: of its values.
        what: ``signal``, ``variable``, ``event`` (what one from outside carries) or ``arithmetic``.
    """

    key: Hashable
    type: Type
    what: str


class Symbols:
    """The symbols of a machine, and the sets of their values.

    Args:
        not_a_number: whether signals may be NaN.
    """

    def __init__(self, *, not_a_number: bool = True) -> None:
        self.diagrams = Diagrams()
        self._symbols: list[Symbol] = []
        self._numbers: dict[tuple[str, Hashable], int] = {}
        self._not_a_number = not_a_number
        self._inner: dict[int, frozenset[int]] = {}
        self._ranges: dict[tuple[Derived, str, Exact], Truth] = {}

    def __getitem__(self, number: int) -> Symbol:
        return self._symbols[number]

    def number(self, what: str, key: Hashable, kind: Type) -> int:
        """The number of a symbol."""
        found = self._numbers.get((what, key))
        if found is None:
            found = self._numbers[what, key] = len(self._symbols)
            self._symbols.append(Symbol(key, kind, what))
        return found

    def followed_roughly(self) -> list[str]:
        """The arithmetic whose results are abstracted, in words."""
        found: dict[str, None] = {}
        for symbol in self._symbols:
            if symbol.what == "arithmetic" and isinstance(symbol.key, tuple):
                found.update(dict.fromkeys([f"`{symbol.key[0]}` of {' and '.join(self._mentioned(symbol.key[1:]))}"]))
        return list(found)

    def within(self, number: int) -> frozenset[int]:
        """A symbol with all symbols inside it: in arithmetic, and in the arguments of a signal."""
        found = self._inner.get(number)
        if found is None:
            found = self._inner[number] = frozenset((number, *self._symbols_in(self._symbols[number].key)))
        return found

    def nested(self, number: int) -> int:
        """How many operations on several symbols a symbol represents."""
        return sum(self._symbols[one].what == "arithmetic" for one in self.within(number))

    def used(self, values: Sequence[Value]) -> frozenset[int]:
        """All symbols that some values depend on."""
        return frozenset(self._symbols_in(tuple(values)))

    def _symbols_in(self, key: object) -> Iterator[int]:
        match key:
            case Derived(number):
                yield from self.within(number)
            case Truth(true, false):
                for one in self.diagrams.symbols(true) | self.diagrams.symbols(false):
                    yield from self.within(one)
            case OneOf(condition, then, otherwise):
                yield from self._symbols_in((condition, then, otherwise))
            case tuple():
                for one in key:
                    yield from self._symbols_in(one)

    def _mentioned(self, key: object) -> list[str]:
        """The signals and variables in the key of a symbol, by name."""
        match key:
            case Derived(number):
                inner = self._symbols[number]
                if inner.what == "arithmetic":
                    return self._mentioned(inner.key)
                return [str(inner.key[0] if isinstance(inner.key, tuple) else inner.key)]
            case tuple():
                return list(dict.fromkeys(name for one in key for name in self._mentioned(one)))
        return []

    def domain(self, number: int) -> tuple[int, int]:
        """The least and the greatest ordinal of a symbol."""
        symbol = self._symbols[number]
        if symbol.what in ("variable", "event") or (symbol.what == "signal" and isinstance(symbol.type, Integer)):
            return held(symbol.type)
        return domain(symbol.type, not_a_number=self._not_a_number or symbol.what != "signal")

    def between(self, number: int, least: int, most: int) -> Diagram:
        """Where a symbol is between two ordinals, both included."""
        first, last = self.domain(number)
        if most < least or least > last or most < first:
            return FALSE
        found = TRUE if most >= last else self.diagrams.below(number, most + 1)
        if least > first:
            found = self.diagrams.without(found, self.diagrams.below(number, least))
        return found

    def truth_of(self, value: Value) -> Truth:
        """A value as a condition, as Python has it."""
        match value:
            case Truth():
                return value
            case Exact(content):
                return YES if content else NO
            case Derived():
                return self.compared("!=", value, Exact.of(0))
            case OneOf(condition, then, otherwise):
                return self.chosen(condition, self.truth_of(then), self.truth_of(otherwise))

    def chosen(self, condition: Truth, then: Truth, otherwise: Truth) -> Truth:
        """One of two conditions, by a third."""
        return Truth(
            self.where(condition, then.true, otherwise.true), self.where(condition, then.false, otherwise.false)
        )

    def where(self, condition: Truth, then: Diagram, otherwise: Diagram) -> Diagram:
        """One set where a condition is true, and another where it is false."""
        both = self.diagrams.both
        return self.diagrams.either(both(condition.true, then), both(condition.false, otherwise))

    def negated(self, truth: Truth) -> Truth:
        """``not``."""
        return Truth(truth.false, truth.true)

    def both(self, one: Truth, other: Truth) -> Truth:
        """``and``: the second is not evaluated where the first is false."""
        both, either = self.diagrams.both, self.diagrams.either
        return Truth(both(one.true, other.true), either(one.false, both(one.true, other.false)))

    def either(self, one: Truth, other: Truth) -> Truth:
        """``or``: the second is not evaluated where the first is true."""
        return self.negated(self.both(self.negated(one), self.negated(other)))

    def compared(self, operator: str, left: Derived, right: Exact) -> Truth:
        """Where a comparison with a known value holds."""
        key = (left, operator, right)
        found = self._ranges.get(key)
        if found is None:
            found = self._ranges[key] = self._compared(operator, left, right.value)
        return found

    def _compared(self, operator: str, left: Derived, constant: Any) -> Truth:
        kind = self._symbols[left.symbol].type
        if constant is None:
            return {"==": NO, "!=": YES}.get(operator, UNKNOWN)
        if isinstance(kind, Enumeration):
            return self._member(operator, left.symbol, kind, constant)
        if isinstance(constant, float) and math.isnan(constant):
            return YES if operator == "!=" else NO
        compare = BINARY[operator]
        numbers = TRUE
        least, most = self.domain(left.symbol)
        if most == NOT_A_NUMBER:
            most -= 1
            numbers = self.between(left.symbol, least, most)
        found = FALSE

        def holds(at: int) -> bool:
            return bool(compare(left.apply(value_at(at, kind)), constant))

        def less(at: int) -> bool:
            return bool(left.apply(value_at(at, kind)) < constant)

        for low, high in self._pieces(left, least, most, kind):
            parted = operator in ("==", "!=")
            for begin, end in _holding(holds, low, high, _turn(less, low, high) if parted else high + 1):
                found = self.diagrams.either(found, self.between(left.symbol, begin, end))
        if numbers != TRUE and compare(left.apply(math.nan), constant):
            found = self.diagrams.either(found, self.diagrams.complement(numbers))
        return Truth(found, self.diagrams.complement(found))

    def _member(self, operator: str, symbol: int, kind: Enumeration, member: Any) -> Truth:
        if str(member) not in kind.members:
            return YES if operator == "!=" else NO
        at = kind.members.index(str(member))
        found = self.between(symbol, at, at)
        truth = Truth(found, self.diagrams.complement(found))
        return truth if operator == "==" else self.negated(truth)

    def _pieces(self, value: Derived, least: int, most: int, kind: Type) -> list[tuple[int, int]]:
        """Intervals in which a value is monotone in its symbol: parted where the operand of an ``abs`` changes sign."""
        pieces = [(least, most)]
        for count, step in enumerate(value.steps):
            if step.operator == "abs":
                inner = Derived(value.symbol, value.steps[:count])
                parted = []
                for low, high in pieces:
                    cut = self._sign_change(inner, low, high, kind)
                    parted += [(low, cut - 1), (cut, high)] if low < cut <= high else [(low, high)]
                pieces = parted
        return pieces

    def _sign_change(self, value: Derived, low: int, high: int, kind: Type) -> int:
        return _turn(lambda at: bool(value.apply(value_at(at, kind)) < 0), low, high)


def _turn(holds: Callable[[int], bool], low: int, high: int) -> int:
    """The first place from which on a monotone condition is not what it is at the lower end."""
    first = holds(low)
    if holds(high) == first:
        return high + 1
    while low + 1 < high:
        middle = (low + high) // 2
        if holds(middle) == first:
            low = middle
        else:
            high = middle
    return high


def _holding(holds: Callable[[int], bool], low: int, high: int, cut: int) -> list[tuple[int, int]]:
    """Where a condition holds in an interval, which is monotone below ``cut`` and from there on."""
    found = []
    for begin, end in [(low, cut - 1), (cut, high)] if low < cut <= high else [(low, high)]:
        turn = _turn(holds, begin, end)
        if holds(begin):
            found.append((begin, turn - 1))
        if turn <= end and holds(turn):
            found.append((turn, end))
    return found


class Arithmetic:
    """Operations on values of which not all are known."""

    def __init__(self, symbols: Symbols) -> None:
        self._symbols = symbols

    def unary(self, operator: str, operand: Value, kind: Type) -> Value:
        """``-x`` or ``abs(x)``."""
        match operand:
            case Exact(value):
                return UNKNOWN if value is None else Exact.of(UNARY[operator](value))
            case Derived(symbol, steps):
                return Derived(symbol, (*steps, ConstantOperation(operator)))
            case Truth():
                return operand
            case OneOf(condition, then, otherwise):
                return OneOf(condition, self.unary(operator, then, kind), self.unary(operator, otherwise, kind))

    def binary(self, operator: str, left: Value, right: Value, kind: Type) -> Value:
        """The result of an operation on two numbers."""
        if UNKNOWN in (left, right):
            return UNKNOWN
        match left, right:
            case OneOf(condition, then, otherwise), _:
                first, second = (self.binary(operator, one, right, kind) for one in (then, otherwise))
                return OneOf(condition, first, second)
            case _, OneOf(condition, then, otherwise):
                first, second = (self.binary(operator, left, one, kind) for one in (then, otherwise))
                return OneOf(condition, first, second)
            case Exact(first), Exact(second):
                try:
                    return Exact.of(BINARY[operator](first, second))
                except (TypeError, ArithmeticError):
                    return UNKNOWN
            case (Exact(None), _) | (_, Exact(None)):
                return UNKNOWN
            case Derived(), Exact(constant) if self._follows(operator, constant, left=False):
                return Derived(left.symbol, (*left.steps, ConstantOperation(operator, right)))
            case Exact(constant), Derived() if self._follows(operator, constant, left=True):
                return Derived(right.symbol, (*right.steps, ConstantOperation(operator, left, left=True)))
        if operator == "/" and isinstance(right, Exact) and not right.value:
            return UNKNOWN
        if operator == "/" and not isinstance(right, Exact):
            raise Undecided("a division whose divisor is not a constant")
        return self._fresh(operator, (left, right), kind)

    def _follows(self, operator: str, constant: Any, *, left: bool) -> bool:
        """Whether an operation with a constant is monotone."""
        if not isinstance(constant, int | float) or not math.isfinite(constant):
            return False
        return operator in _MONOTONE and bool(constant or operator not in "*/") and not (operator == "/" and left)

    def _fresh(self, operator: str, operands: tuple[Value, ...], kind: Type) -> Derived:
        return Derived(self._symbols.number("arithmetic", (operator, operands), kind))


class Undecided(Exception):  # noqa: N818 - an answer, not an error
    """A feature that proofs do not support; the message names it."""


class NoRun(Exception):  # noqa: N818 - an answer, not an error
    """Assumptions that no run keeps to, so that every property would hold."""
