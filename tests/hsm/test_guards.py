"""Guards: laziness, precedence, explanations, coverage; generated code and evaluation agree."""

import os

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hsm import build
from hsm.engine.decisions import decision_of
from hsm.engine.explanation import Verdict
from hsm.model.expressions import Binary, Literal, SignalValue, Unary
from hsm.model.types import BOOLEAN, NUMBER
from tests.hsm.charts import (
    ASKED,
    EXTERNAL,
    active,
    add,
    both,
    compare,
    either,
    facts,
    model,
    no,
    number,
    on,
    parallel,
    put,
    signal,
    start,
    state,
    variable,
    when,
)

EXAMPLES = int(os.environ.get("MAZE_MACHINE_EXAMPLES", "150"))
SIGNALS = "abcdefgh"


def test_signals_are_asked_once_in_a_step_and_only_where_they_matter():
    run = start(
        state("i", when(both(signal("a"), signal("b")), "j"), when(both(signal("a"), signal("c")), "k")),
        state("j"),
        state("k"),
        on("go", "j", guard=signal("d")),
    )
    run.step(1.0, (), facts())
    assert ASKED == ["a"]
    run.step(2.0, (), facts("a"))
    assert ASKED == ["a", "a", "b", "c"]


def test_signals_stay_the_same_over_all_microsteps_of_a_step():
    run = start(state("i", when("a", "j")), state("j", when(both(signal("a"), signal("b")), "k")), state("k"))
    run.step(1.0, (), facts("a"))
    assert ASKED == ["a", "b"]


def test_signals_of_states_that_are_not_active_are_not_asked():
    run = start(state("i", on("go", "j")), state("j", when("a", "i")))
    run.step(1.0, (), facts())
    assert ASKED == []


def test_a_signal_with_arguments_is_asked_once_for_each_of_them():
    near, far = signal("within", number(0.5)), signal("within", number(2.0))
    run = start(state("i", when(both(far, near), "j"), when(both(far, no(near)), "k")), state("j"), state("k"))
    assert run.step(1.0, (), {"x": 1.0}).entered == ("k",)
    assert ASKED == [("within", 2.0), ("within", 0.5)]


def test_a_signal_whose_argument_changes_within_a_step_is_asked_again():
    run = start(
        state("i", when(signal("within", variable("n")), "j"), on("more", actions=[add("n")])),
        state("j"),
        variables={"n": 0},
    )
    assert not run.step(1.0, (), {"x": 1.5})
    assert run.step(2.0, ["more", "more"], {"x": 1.5}).entered == ("j",)


def test_why_says_what_each_condition_was():
    guard = both(signal("a"), either(signal("b"), compare(signal("x"), "<", number(0.5))))
    run = start(state("i", when(guard, "j")), state("j"))
    (one,) = run.step(1.0, (), facts("a", x=0.75)).why("i")
    assert one.verdict is Verdict.FALSE
    assert one.conditions == (("a", True), ("b", False), ("x < 0.5", False))
    assert ("x", 0.75) in one.values
    assert one.reason == "`a` was true, `b` was false, `x < 0.5` was false (x = 0.75)"
    (one,) = run.step(2.0, (), facts(x=0.75)).why("i")
    assert one.conditions == (("a", False), ("b", None), ("x < 0.5", None))


def test_why_is_true_of_its_step_whatever_comes_later():
    guard = compare(variable("n"), ">", number(1))
    run = start(state("i", on("count", actions=[add("n")]), on("go", "j", guard=guard)), state("j"), variables={"n": 0})
    step = run.step(1.0, ["go", "count", "count"])
    run.step(2.0, ["go"])
    (one,) = [one for one in step.why("i") if one.trigger == "go"]
    assert one.conditions == (("n > 1", False),)
    assert one.values == (("n", 0),)


def test_why_tells_what_came_first():
    run = start(state("i", when("a", "j"), when("b", "k")), state("j"), state("k"))
    verdicts = [one.verdict for one in run.step(1.0, (), facts("a", "b")).why("i")]
    assert verdicts == [Verdict.TAKEN, Verdict.EARLIER]


def test_why_tells_a_signal_that_failed():
    run = start(state("i", when("a", "j"), on("fault", actions=[add("n")])), state("j"), variables={"n": 0})
    step = run.step(1.0, (), facts(a=OSError()))
    assert [one.verdict for one in step.considered if one.trigger == "when"] == [Verdict.FAILED]


@st.composite
def guards(draw):
    """Boolean expressions over signals, constants, comparisons, a counter and what is active."""
    leaves = st.one_of(
        st.builds(signal, st.sampled_from(SIGNALS)),
        st.builds(lambda value: Literal(value, BOOLEAN), st.booleans()),
        st.builds(active, st.sampled_from(["i", "j"])),
        st.builds(
            lambda name, operator, limit: compare(signal(name), operator, number(limit)),
            st.sampled_from("xyz"),
            st.sampled_from(["<", "<=", ">", ">=", "==", "!="]),
            st.sampled_from([0.0, 0.5, 1.0]),
        ),
        st.builds(
            lambda name, other, limit: compare(Binary("max", signal(name), signal(other), NUMBER), "<", number(limit)),
            st.sampled_from("xyz"),
            st.sampled_from("xyz"),
            st.sampled_from([0.5, 1.0]),
        ),
        st.builds(lambda limit: compare(variable("n"), "<", number(limit)), st.integers(0, 2)),
    )
    return draw(
        st.recursive(
            leaves,
            lambda inner: st.one_of(
                st.builds(lambda one: Unary("not", one, BOOLEAN), inner),
                st.builds(lambda o, a, b: Binary(o, a, b, BOOLEAN), st.sampled_from(["and", "or", "=="]), inner, inner),
            ),
            max_leaves=10,
        )
    )


def value(expression, given):
    """What an expression means, said once more as simply as possible."""
    match expression:
        case Literal(constant):
            return constant
        case SignalValue(declared):
            return given[declared.name]
        case Unary("not", operand):
            return not value(operand, given)
        case Binary("and", left, right):
            return value(left, given) and value(right, given)
        case Binary("or", left, right):
            return value(left, given) or value(right, given)
        case Binary("max", left, right):
            return max(value(left, given), value(right, given))
        case Binary(operator, left, right):
            one, other = value(left, given), value(right, given)
            return {
                "<": one < other,
                "<=": one <= other,
                ">": one > other,
                ">=": one >= other,
                "==": one == other,
                "!=": one != other,
            }[operator]
        case _:
            return given[getattr(expression, "name", None) or expression.state]


@settings(max_examples=EXAMPLES, deadline=None, derandomize=True)
@given(
    guards(),
    guards(),
    st.lists(st.booleans(), min_size=8, max_size=8),
    st.tuples(*[st.sampled_from([0.0, 0.5, 2.0])] * 3),
)
def test_the_generated_code_means_what_the_guards_say(first, second, bits, numbers):
    given_facts = facts(**dict(zip(SIGNALS, bits, strict=True)), **dict(zip("xyz", numbers, strict=True)))
    meant = {**given_facts, "i": True, "j": False, "n": 1}
    machine = build(model(state("i", when(first, "j"), when(second, "k")), state("j"), state("k"), variables={"n": 1}))
    run = machine.start()
    step = run.step(1.0, (), given_facts)
    expected = "j" if value(first, meant) else "k" if value(second, meant) else "i"
    assert run.configuration == {expected}
    assert len(ASKED) == len(set(ASKED))
    ASKED.clear()
    # What was marked for coverage is what an explanation finds, and both lead to the outcome that was taken.
    guards_seen = run.coverage.guards
    for index, guard in enumerate((first, second)):
        decision = decision_of(machine.model.transitions[index])
        if index in guards_seen:
            (path,) = guards_seen[index]
            assert decision.outcome(path) == bool(value(guard, meant))
            explained = next(one for one in step.considered if one.transition.index == index)
            assert tuple(held for _, held in explained.conditions) == decision.values(path)
        else:
            assert not decision.conditions or (index == 1 and expected == "j")


@pytest.mark.parametrize("many", [3, 12])
def test_paths_of_guards_small_and_large(many):
    clauses = [either(signal(SIGNALS[n % 8]), compare(signal("x"), ">", number(float(n)))) for n in range(many)]
    run = start(state("i", when(both(*clauses), "j")), state("j"))
    run.step(1.0, (), facts(x=0.5))
    run.step(2.0, (), facts(x=100.0))
    decision = run.machine.generator.decision(0)
    outcomes = sorted(decision.outcome(path) for path in run.coverage.guards[0])
    assert outcomes == [False, True]
    assert decision.count == sum(2**n for n in range(many)) + 2**many


def test_a_long_chain_of_conditions():
    clauses = [compare(signal("x"), ">", number(float(n))) for n in range(3000)]
    run = start(state("i", when(both(*clauses), "j")), state("j"))
    assert not run.step(1.0, (), facts(x=10.0))
    assert run.step(2.0, (), facts(x=1e9))


def test_coverage_counts_states_transitions_and_merges():
    parts = (state("a", on("go", "b")), parallel("b", state("c"), state("d"), on("back", "a", **EXTERNAL)))
    machine = build(model(*parts))
    one, other = machine.start(), machine.start()
    one.step(1.0, ["go", "back", "go"])
    other.step(1.0, ["go"])
    total = one.coverage.merge(other.coverage)
    names = {machine.model.states[index].name: count for index, count in total.states.items()}
    assert names == {"m": 2, "a": 3, "b": 3, "c": 3, "d": 3}
    assert total.transitions == {0: 3, 1: 1}
    assert type(total).from_json(total.to_json()) == total


def test_assigned_values_do_not_change_what_was_seen():
    run = start(state("a", on("go", "b", actions=[put("n", 3)])), state("b"), variables={"n": 0})
    before = run.variables
    run.step(1.0, ["go"])
    assert before["n"] == 0
    assert run.variables["n"] == 3
