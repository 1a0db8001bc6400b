"""Conditions as formulas, and whether they can hold: exact for booleans, enumerations and linear arithmetic.

A formula is a truth value, an atom, or a combination of formulas. ``models`` lists the ways in which a formula can
hold, by trying each atom both ways in the order in which they are written and leaving out what arithmetic or an
enumeration excludes. A nonlinear term (a product of two signals, ``min``, ``max``) is an independent unknown, and a
whole number in a sum counts as a real number: in these cases the answer may be that a formula can hold although it
cannot, but never the reverse.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from fractions import Fraction
from typing import TypeAlias

from hsm.dsl.logic.linear import Constraint, Form, LinearAtom, feasible, form_of
from hsm.model.expressions import Active, Binary, Choice, Expression, Literal, SignalValue, Unary, VariableValue
from hsm.model.rewriting import parts_of
from hsm.model.types import BOOLEAN, Enumeration
from hsm.model.unparse import expression_text, shown_text
from hsm.model.values import dataclass

Values: TypeAlias = Mapping[str, bool | float | int]
"""The fixed values of parameters, by name."""


class UndecidedError(Exception):
    """A formula with too many cases to try them all."""


@dataclass(frozen=True, slots=True)
class Flag:
    """A signal, a variable or a state that is true or false."""

    text: str


@dataclass(frozen=True, slots=True)
class EnumerationValue:
    """An enumeration that has one of its values."""

    text: str
    value: str
    values: tuple[str, ...]


Atom: TypeAlias = Flag | EnumerationValue | LinearAtom


@dataclass(frozen=True, slots=True)
class Not:
    """Negation."""

    operand: Formula


@dataclass(frozen=True, slots=True)
class Both:
    """Conjunction."""

    left: Formula
    right: Formula


@dataclass(frozen=True, slots=True)
class Either:
    """Disjunction."""

    left: Formula
    right: Formula


Formula: TypeAlias = bool | Flag | EnumerationValue | LinearAtom | Not | Both | Either
Assignment: TypeAlias = dict[Atom, bool]

_COMPARISONS = frozenset(("==", "!=", "<", "<=", ">", ">="))
_MOST_CASES = 3000
_MOST_ATOMS = 60
_DEEPEST_COMPARISON = 5


def negation(formula: Formula) -> Formula:
    """The formula that holds where ``formula`` does not."""
    if isinstance(formula, bool):
        return not formula
    return formula.operand if isinstance(formula, Not) else Not(formula)


def both(left: Formula, right: Formula) -> Formula:
    """The formula that holds where both do."""
    if left is False or right is False:
        return False
    if left is True:
        return right
    return left if right is True else Both(left, right)


def either(left: Formula, right: Formula) -> Formula:
    """The formula that holds where one of them does."""
    if left is True or right is True:
        return True
    if left is False:
        return right
    return left if right is False else Either(left, right)


def formula_of(expression: Expression, values: Values) -> Formula:
    """The formula of a condition.

    Args:
        expression: a typed expression that is true or false.
        values: parameters with fixed values.
    """
    match expression:
        case Binary(operator, Choice() as choice, right) if operator in _COMPARISONS and _plain(choice):
            return _of_choice(choice, lambda one: Binary(operator, one, right, BOOLEAN), values)
        case Binary(operator, left, Choice() as choice) if operator in _COMPARISONS and _plain(choice):
            return _of_choice(choice, lambda one: Binary(operator, left, one, BOOLEAN), values)
        case Literal(value):
            return bool(value)
        case VariableValue(name):
            known = values.get(name)
            return Flag(name) if known is None else bool(known)
        case SignalValue() | Active():
            return Flag(expression_text(expression))
        case Unary(operand=operand):
            return negation(formula_of(operand, values))
        case Binary("and", left, right):
            return both(formula_of(left, values), formula_of(right, values))
        case Binary("or", left, right):
            return either(formula_of(left, values), formula_of(right, values))
        case Binary("==", left, right):
            return _equality(left, right, values)
        case Binary("!=", left, right):
            return negation(_equality(left, right, values))
        case Binary(operator, left, right):
            return _ordering(operator, left, right, values)
        case Choice():
            raise AssertionError("a choice is not a condition")


def _of_choice(choice: Choice, compare: Callable[[Expression], Expression], values: Values) -> Formula:
    """A comparison with a conditional value, by cases."""
    condition = formula_of(choice.condition, values)
    chosen, other = formula_of(compare(choice.then), values), formula_of(compare(choice.otherwise), values)
    return either(both(condition, chosen), both(negation(condition), other))


def _plain(choice: Choice) -> bool:
    """Whether the condition of a choice contains no choice itself: it occurs twice in the formula."""
    return not any(isinstance(one, Choice) for one in parts_of(choice.condition))


def _equality(left: Expression, right: Expression, values: Values) -> Formula:
    if left.type == BOOLEAN:
        if max(_comparisons(left), _comparisons(right)) > _DEEPEST_COMPARISON:
            return Flag(f"({expression_text(left)}) == ({expression_text(right)})")
        first, second = formula_of(left, values), formula_of(right, values)
        return either(both(first, second), both(negation(first), negation(second)))
    if not isinstance(left.type, Enumeration):
        return both(_ordering("<=", left, right, values), _ordering(">=", left, right, values))
    if isinstance(left, Literal):
        left, right = right, left
    if isinstance(left, Literal) and isinstance(right, Literal):
        return bool(left.value == right.value)
    if isinstance(right, Literal) and isinstance(left.type, Enumeration):
        return EnumerationValue(expression_text(left), str(right.value), left.type.members)
    return Flag(f"{expression_text(left)} == {expression_text(right)}")


def _comparisons(expression: Expression) -> int:
    """How deep comparisons of conditions are nested; each doubles the formula."""
    match expression:
        case Unary(operand=operand):
            return _comparisons(operand)
        case Binary(operator, left, right):
            own = operator in ("==", "!=") and left.type == BOOLEAN
            return own + max(_comparisons(left), _comparisons(right))
        case _:
            return 0


def _ordering(operator: str, left: Expression, right: Expression, values: Values) -> Formula:
    if operator in (">", ">="):
        return _ordering({">": "<", ">=": "<="}[operator], right, left, values)
    if isinstance(left, Unary) and left.operator == "abs":
        inner, kind = left.operand, left.type
        below = _ordering(operator, inner, right, values)
        return both(below, _ordering(operator, Unary("-", inner, kind), right, values))
    if isinstance(right, Unary) and right.operator == "abs":
        inner, kind = right.operand, right.type
        above = _ordering(operator, left, inner, values)
        return either(above, _ordering(operator, left, Unary("-", inner, kind), values))
    try:
        return _below(form_of(left, values).minus(form_of(right, values)), strict=operator == "<")
    except OverflowError:
        return Flag(f"{expression_text(left)} {operator} {expression_text(right)}")


def _below(form: Form, *, strict: bool) -> Formula:
    """Whether a linear form is below zero."""
    if not form.coefficients:
        return form.constant < 0 or (not strict and form.constant == 0)
    lead = form.coefficients[0][1]
    normal = form.scaled(1 / lead)
    bound = -normal.constant
    atom = LinearAtom(normal.without_constant(), bound, strict=strict if lead > 0 else not strict).tightened()
    return atom if lead > 0 else Not(atom)


def models(formula: Formula) -> Iterator[Assignment]:
    """The ways in which a formula can hold, each as its relevant atoms and their truth values; no two overlap.

    Raises:
        UndecidedError: there are too many cases.
    """
    cases = 0
    stack: list[tuple[Formula, Assignment]] = [(formula, {})]
    while stack:
        rest, assigned = stack.pop()
        if rest is True:
            yield assigned
            continue
        atom = _first_atom(rest)
        if atom is None:
            continue
        cases += 1
        if cases > _MOST_CASES or len(assigned) > _MOST_ATOMS:
            raise UndecidedError
        for truth in (False, True):
            extended = {**assigned, atom: truth}
            if _possible(extended, atom):
                stack.append((_given(rest, atom, truth), extended))


def can_hold(formula: Formula) -> bool:
    """Whether there is a way in which a formula holds.

    Raises:
        UndecidedError: there are too many cases.
    """
    return next(models(formula), None) is not None


def terms_of(formula: Formula) -> frozenset[str]:
    """The signals, variables and states that a formula is about."""
    match formula:
        case bool():
            return frozenset()
        case Flag(text) | EnumerationValue(text):
            return frozenset((text,))
        case LinearAtom(form):
            return frozenset(term.text for term, _ in form.coefficients)
        case Not(operand):
            return terms_of(operand)
        case Both(left, right) | Either(left, right):
            return terms_of(left) | terms_of(right)


def case_text(case: Assignment) -> str:
    """A way in which a formula holds, in the author's words."""
    parts: dict[str, None] = {}
    kinds = _kinds(case)
    bounds: dict[Form, tuple[list[LinearAtom], list[LinearAtom]]] = {}
    for atom, truth in case.items():
        match atom:
            case Flag(text):
                parts[text if truth else f"not {text}"] = None
            case EnumerationValue(text):
                parts.update(dict.fromkeys(kinds[text]))
            case LinearAtom(form):
                if form not in bounds:
                    bounds[form] = ([], [])
                bounds[form][truth].append(atom)
    for form, (lower, upper) in bounds.items():
        parts.update(dict.fromkeys(_range_texts(form, lower, upper)))
    return " and ".join(parts) or "always"


def _kinds(case: Assignment) -> dict[str, list[str]]:
    """What is known about each enumeration: its value, or the values that are excluded."""
    known: dict[str, list[str]] = {}
    excluded: dict[str, set[str]] = {}
    for atom, truth in case.items():
        if isinstance(atom, EnumerationValue):
            excluded.setdefault(atom.text, set()).update(set(atom.values) - {atom.value} if truth else {atom.value})
            left = [value for value in atom.values if value not in excluded[atom.text]]
            others = [f"{atom.text} != {value}" for value in atom.values if value not in left]
            known[atom.text] = [f"{atom.text} == {left[0]}"] if len(left) == 1 else others
    return known


def _range_texts(form: Form, lower: list[LinearAtom], upper: list[LinearAtom]) -> Iterator[str]:
    """What remains of a form between its tightest bounds."""
    low = max(lower, key=lambda atom: (atom.bound, not atom.strict), default=None)
    high = min(upper, key=lambda atom: (atom.bound, not atom.strict), default=None)
    kind = form.kind
    if low is not None and high is not None:
        least = low.bound + 1 if form.whole else low.bound
        if least == high.bound:
            yield f"{form.text} == {_bound_text(least, form)}"
            return
    if low is not None:
        above = ">=" if low.strict else ">"
        yield f"{form.text} {above} {shown_text(_number(low.bound, form), kind)}"
    if high is not None:
        below = "<" if high.strict else "<="
        yield f"{form.text} {below} {shown_text(_number(high.bound, form), kind)}"


def _bound_text(bound: Fraction, form: Form) -> str:
    return shown_text(_number(bound, form), form.kind)


def _number(bound: Fraction, form: Form) -> int | float:
    return int(bound) if form.whole and bound.denominator == 1 else float(bound)


def _first_atom(formula: Formula) -> Atom | None:
    while True:
        match formula:
            case bool():
                return None
            case Not(operand):
                formula = operand
            case Both(left) | Either(left):
                formula = left
            case _:
                return formula


def _given(formula: Formula, atom: Atom, truth: bool) -> Formula:  # noqa: FBT001
    """The formula once an atom is known."""
    match formula:
        case bool():
            return formula
        case Not(operand):
            return negation(_given(operand, atom, truth))
        case Both(left, right):
            return both(_given(left, atom, truth), _given(right, atom, truth))
        case Either(left, right):
            return either(_given(left, atom, truth), _given(right, atom, truth))
        case _:
            return truth if formula == atom else formula


def _possible(assigned: Assignment, newest: Atom) -> bool:
    """Whether atoms can have these truth values together; without the newest they can."""
    match newest:
        case Flag():
            return True
        case EnumerationValue(text, _, values):
            same = {
                atom.value: truth
                for atom, truth in assigned.items()
                if isinstance(atom, EnumerationValue) and atom.text == text
            }
            return sum(same.values()) <= 1 and (len(same) < len(values) or any(same.values()))
        case LinearAtom(form):
            linear = [atom for atom in assigned if isinstance(atom, LinearAtom)]
            if all(len(atom.form.coefficients) == 1 for atom in linear):
                linear = [atom for atom in linear if atom.form == form]
            return feasible(_constraint(atom, assigned[atom]) for atom in linear)


def _constraint(atom: LinearAtom, truth: bool) -> Constraint:  # noqa: FBT001
    coefficients = {term.text: factor for term, factor in atom.form.coefficients}
    if truth:
        return Constraint(coefficients, atom.bound, atom.strict)
    if atom.form.whole:
        return Constraint({text: -factor for text, factor in coefficients.items()}, -atom.bound - 1, strict=False)
    return Constraint({text: -factor for text, factor in coefficients.items()}, -atom.bound, not atom.strict)
