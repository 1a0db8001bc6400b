"""The decision procedure against trying everything out."""

import itertools
import operator

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hsm.dsl import parse_model
from hsm.dsl.logic.formulas import UndecidedError, can_hold, case_text, formula_of, models, negation
from hsm.model.expressions import Binary, Literal, Unary, VariableValue
from tests.dsl.library import Junction, make_library

LIBRARY = make_library()
HEAD = (
    "machine m\nvar p : bool = false\nvar q : bool = false\nvar k : Junction = corner\n"
    "var n : int = 0\nvar i : int = 0\nvar x : number = 0\nstate a\n    when {} -> a\n"
)
FLAGS = st.sampled_from(["p", "q", "true", "false", "p == q", "p != q"])
KINDS = st.builds("k {} {}".format, st.sampled_from(["==", "!="]), st.sampled_from([one.value for one in Junction]))
ORDER = st.sampled_from(["<", "<=", ">", ">=", "==", "!="])
SMALL = st.integers(-3, 3)
WHOLE = st.builds("{} {} {}".format, st.sampled_from(["n", "2 * n", "n - 1", "-n", "abs(n)", "1 - n"]), ORDER, SMALL)
SUMS = st.builds("n {} i {} {}".format, st.sampled_from(["+", "-", "+ 2 *"]), ORDER, SMALL)
HALVES = st.builds("x {} {}".format, ORDER, st.sampled_from(["0", "0.5", "1", "-1.5"]))


def conditions(leaves):
    return st.recursive(
        leaves,
        lambda inner: st.one_of(
            st.builds("not ({})".format, inner),
            st.builds("({}) and ({})".format, inner, inner),
            st.builds("({}) or ({})".format, inner, inner),
        ),
        max_leaves=6,
    )


def condition_of(text):
    return parse_model(HEAD.format(text), LIBRARY).transitions[0].trigger.condition


OPERATORS = {
    **{"==": operator.eq, "!=": operator.ne, "<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge},
    **{"+": operator.add, "-": operator.sub, "*": operator.mul},
    **{"and": lambda left, right: left and right, "or": lambda left, right: left or right},
}


def value(expression, world):
    match expression:
        case Literal(found):
            return found
        case VariableValue(name):
            return world[name]
        case Unary("not", operand):
            return not value(operand, world)
        case Unary("abs", operand):
            return abs(value(operand, world))
        case Unary(_, operand):
            return -value(operand, world)
        case Binary(name, left, right):
            return OPERATORS[name](value(left, world), value(right, world))


def worlds(numbers=(0,), others=(0,), reals=(0.0,)):
    flags = (False, True)
    for p, q, k, n, i, x in itertools.product(flags, flags, Junction, numbers, others, reals):
        yield {"p": p, "q": q, "k": k, "n": n, "i": i, "x": x}


quick = settings(max_examples=150, deadline=None, derandomize=True)


@quick
@given(conditions(st.one_of(FLAGS, KINDS, WHOLE)))
def test_booleans_enumerations_and_a_whole_number_are_decided_exactly(text):
    condition = condition_of(text)
    formula = formula_of(condition, {})
    holding = [world for world in worlds(numbers=range(-8, 9)) if value(condition, world)]
    assert can_hold(formula) == bool(holding)
    assert can_hold(negation(formula)) == (len(holding) < 2 * 2 * len(Junction) * 17)


@quick
@given(conditions(st.one_of(FLAGS, HALVES)))
def test_a_real_number_is_decided_exactly(text):
    condition = condition_of(text)
    reals = [-2.0, -1.5, -1.25, -0.25, 0.0, 0.25, 0.5, 0.75, 1.0, 2.0]
    assert can_hold(formula_of(condition, {})) == any(value(condition, world) for world in worlds(reals=reals))


@quick
@given(conditions(st.one_of(SUMS, WHOLE)))
def test_what_holds_for_sums_is_never_said_not_to(text):
    condition = condition_of(text)
    if any(value(condition, world) for world in worlds(numbers=range(-6, 7), others=range(-6, 7)) if world["p"]):
        assert can_hold(formula_of(condition, {}))


@quick
@given(conditions(st.one_of(FLAGS, KINDS)))
def test_the_cases_are_disjoint_and_complete(text):
    condition = condition_of(text)
    cases = [case_text(case) for case in models(formula_of(condition, {}))]
    conditions_of_cases = [condition_of("true" if case == "always" else case) for case in cases]
    for world in worlds():
        assert sum(bool(value(one, world)) for one in conditions_of_cases) == bool(value(condition, world))


def test_a_formula_with_too_many_cases_is_not_decided():
    with pytest.raises(UndecidedError):
        list(models(formula_of(condition_of(" or ".join(f"n == {one}" for one in range(200))), {})))


def test_comparisons_of_comparisons_do_not_explode():
    parity = "p"
    for number in range(60):
        parity = f"({parity} != {'pq'[number % 2]})"
    assert can_hold(formula_of(condition_of(parity), {}))
