"""Linear arithmetic for the checks of conditions: forms, bounds on them, and whether bounds can hold together."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from fractions import Fraction

from hsm.model.expressions import Binary, Expression, Literal, Unary, VariableValue
from hsm.model.types import INTEGER, Type
from hsm.model.unparse import expression_text
from hsm.model.values import dataclass


@dataclass(frozen=True, slots=True)
class Term:
    """An unknown: a numeric signal or variable, or an expression that is not linear."""

    text: str
    type: Type


@dataclass(frozen=True, slots=True)
class Form:
    """A sum of unknowns with factors, and a constant; unknowns in the order of their names."""

    coefficients: tuple[tuple[Term, Fraction], ...]
    constant: Fraction = Fraction(0)

    @property
    def whole(self) -> bool:
        """Whether its values are whole numbers: a single whole unknown without a factor."""
        return len(self.coefficients) == 1 and self.coefficients[0] == (
            Term(self.coefficients[0][0].text, INTEGER),
            Fraction(1),
        )

    @property
    def kind(self) -> Type | None:
        """The type of its values, where it is a single unknown."""
        return self.coefficients[0][0].type if len(self.coefficients) == 1 else None

    @property
    def text(self) -> str:
        """The form as an author would write it, without its constant."""
        parts: list[str] = []
        for term, factor in self.coefficients:
            sign = "-" if factor < 0 else "+"
            size = "" if abs(factor) == 1 else f"{float(abs(factor)):.6g} * "
            parts.append(f" {sign} {size}{term.text}")
        joined = "".join(parts)
        return joined[3:] if joined.startswith(" + ") else joined[1:]

    def plus(self, other: Form) -> Form:
        """The sum of two forms."""
        total: dict[Term, Fraction] = dict(self.coefficients)
        for term, factor in other.coefficients:
            total[term] = total.get(term, Fraction(0)) + factor
        kept = sorted(((term, factor) for term, factor in total.items() if factor), key=lambda pair: pair[0].text)
        return Form(tuple(kept), self.constant + other.constant)

    def scaled(self, factor: Fraction) -> Form:
        """The form times a number."""
        if not factor:
            return Form(())
        return Form(tuple((term, factor * one) for term, one in self.coefficients), self.constant * factor)

    def minus(self, other: Form) -> Form:
        """The difference of two forms."""
        return self.plus(other.scaled(Fraction(-1)))

    def without_constant(self) -> Form:
        """The form with zero for its constant."""
        return Form(self.coefficients)


@dataclass(frozen=True, slots=True)
class LinearAtom:
    """Whether a form is less than a bound, or at most the bound."""

    form: Form
    bound: Fraction
    strict: bool

    def tightened(self) -> LinearAtom:
        """The same for whole numbers: at most the next whole bound."""
        if not self.form.whole:
            return self
        bound = math.ceil(self.bound) - 1 if self.strict else math.floor(self.bound)
        return LinearAtom(self.form, Fraction(bound), strict=False)


@dataclass(frozen=True, slots=True)
class Constraint:
    """A sum of unknowns with factors that is at most a bound, or less."""

    coefficients: Mapping[str, Fraction]
    bound: Fraction
    strict: bool


def form_of(expression: Expression, values: Mapping[str, bool | float | int]) -> Form:
    """The linear form of a number; what is not linear becomes an unknown.

    Raises:
        OverflowError: a constant is infinite.
    """
    match expression:
        case Literal(value):
            return Form((), Fraction(value))
        case VariableValue(name) if name in values:
            return Form((), Fraction(values[name]))
        case Unary("-", operand):
            return form_of(operand, values).scaled(Fraction(-1))
        case Binary("+", left, right):
            return form_of(left, values).plus(form_of(right, values))
        case Binary("-", left, right):
            return form_of(left, values).minus(form_of(right, values))
        case Binary("*", left, right):
            first, second = form_of(left, values), form_of(right, values)
            if not first.coefficients:
                return second.scaled(first.constant)
            if not second.coefficients:
                return first.scaled(second.constant)
        case Binary("/", left, right):
            divisor = form_of(right, values)
            if not divisor.coefficients and divisor.constant:
                return form_of(left, values).scaled(1 / divisor.constant)
    return Form(((Term(expression_text(expression), expression.type), Fraction(1)),))


_MOST_CONSTRAINTS = 200


def feasible(constraints: Iterable[Constraint]) -> bool:
    """Whether constraints can hold together for real numbers, by eliminating one unknown after the other.

    If that takes too many steps, the answer is that they can. Source: Fourier-Motzkin elimination.
    """
    remaining = list(constraints)
    while True:
        unknown = next((name for one in remaining for name in one.coefficients), None)
        if unknown is None:
            return all(one.bound > 0 or (one.bound == 0 and not one.strict) for one in remaining)
        above = [one for one in remaining if one.coefficients.get(unknown, 0) > 0]
        below = [one for one in remaining if one.coefficients.get(unknown, 0) < 0]
        remaining = [one for one in remaining if unknown not in one.coefficients]
        if len(remaining) + len(above) * len(below) > _MOST_CONSTRAINTS:
            return True
        remaining.extend(_combined(upper, lower, unknown) for upper in above for lower in below)


def _combined(upper: Constraint, lower: Constraint, unknown: str) -> Constraint:
    """What two constraints say together once an unknown is eliminated."""
    first, second = -lower.coefficients[unknown], upper.coefficients[unknown]
    total: dict[str, Fraction] = {}
    for constraint, factor in ((upper, first), (lower, second)):
        for name, coefficient in constraint.coefficients.items():
            total[name] = total.get(name, Fraction(0)) + factor * coefficient
    kept = {name: coefficient for name, coefficient in total.items() if coefficient}
    return Constraint(kept, first * upper.bound + second * lower.bound, upper.strict or lower.strict)
