"""Why transitions fired or did not, computed from what a step records."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from enum import Enum
from typing import Any

from hsm.engine.clock import nanoseconds, reached, seconds
from hsm.engine.configuration import Configuration, Plan
from hsm.engine.evaluation import Evaluation, SignalFault
from hsm.engine.record import NOTHING_DUE, Phase, Selection, StepRecord
from hsm.model.chart import Held, On, Transition
from hsm.model.expressions import Binary, Choice, Expression, SignalValue, Unary, VariableValue
from hsm.model.unparse import call_text, expression_text, trigger_text, value_text
from hsm.model.values import dataclass


class Verdict(Enum):
    """The verdict about a considered transition."""

    TAKEN = "taken"
    PREEMPTED = "another transition that was taken leaves the same states"
    FALSE = "its condition did not hold"
    EARLIER = "another transition came first"
    NOT_DUE = "its time had not come"
    FAILED = "its condition could not be evaluated"
    UNDONE = "one of its actions failed, and it was undone"
    ABSENT = "none of its events came"


@dataclass(frozen=True, slots=True)
class Considered:
    """A transition that a selection considered.

    Attributes:
        transition: the transition.
        trigger: the trigger of the selection: an event's name, ``always``, ``after`` or ``when``.
        verdict: its verdict.
        conditions: each condition of its guard, as text, with its value; None if it did not matter or failed.
        values: the signals and variables in the conditions that were evaluated, as text, with their values.
        remaining: for a time-out that is not due: the seconds to go.
    """

    transition: Transition
    trigger: str
    verdict: Verdict
    conditions: tuple[tuple[str, bool | None], ...] = ()
    values: tuple[tuple[str, Any], ...] = ()
    remaining: float | None = None

    @property
    def reason(self) -> str:
        """The verdict in a sentence, with the values that decided it."""
        if self.remaining is not None:
            return f"{self.verdict.value}: {self.remaining:.3g} s to go"
        if self.verdict is not Verdict.FALSE:
            return str(self.verdict.value)
        judged = (f"`{text}` was {value_text(value)}" for text, value in self.conditions if value is not None)
        named = {text for text, _ in self.conditions}
        seen = [f"{text} = {value_text(value)}" for text, value in self.values if text not in named]
        return ", ".join(judged) + (f" ({', '.join(seen)})" if seen else "")

    def __str__(self) -> str:
        where = f"{self.transition.place}: " if self.transition.place else ""
        return f"{where}{trigger_text(self.transition.trigger, self.transition.guard)}: {self.reason}"


def by_transition(considered: Iterable[Considered]) -> dict[int, Considered]:
    """The verdict on each transition in a step, by its index: that it was taken, else the first one."""
    found: dict[int, Considered] = {}
    for one in considered:
        if one.transition.index not in found or one.verdict is Verdict.TAKEN:
            found[one.transition.index] = one
    return found


def explain(record: StepRecord) -> tuple[Considered, ...]:
    """Every transition that was considered in a step, in the order of the selections.

    Args:
        record: what the step recorded.
    """
    found = [one for selection in record.selections for one in _explain_selection(selection, record.memo)]
    if record.values is not None:
        last = Selection(Phase.WHEN, record.after, record.values, NOTHING_DUE, None)
        found.extend(_explain_selection(last, record.memo))
    found.extend(_waiting(record))
    return tuple(found)


def idle(record: StepRecord, considered: Iterable[Considered]) -> Iterator[Considered]:
    """The transitions of the active states that the step did not consider, with the reason.

    They wait for events of which none came, or for a condition that does not hold, or that has fired them already.

    Args:
        record: what the step recorded.
        considered: the transitions that were considered in it.
    """
    seen = {one.transition.index for one in considered}
    configuration = record.after
    for state in sorted(configuration.active):
        for index in configuration.topology.states[state].transitions:
            transition = configuration.topology.model.transitions[index]
            if index in seen:
                continue
            if isinstance(transition.trigger, On):
                yield Considered(transition, "on", Verdict.ABSENT)
            elif isinstance(transition.trigger, Held) and record.values is not None:
                evaluation = configuration.generator.evaluation(record.memo, record.values, configuration.active, _gone)
                one = _consider(configuration, index, str(Phase.AFTER), evaluation, None, earlier=False)
                yield one if one.verdict is Verdict.FALSE else Considered(transition, one.trigger, Verdict.NOT_DUE)


def _waiting(record: StepRecord) -> Iterator[Considered]:
    for index, deadline in sorted(record.timers.items()):
        if not reached(deadline, record.time):
            transition = record.after.topology.model.transitions[index]
            remaining = seconds(deadline - nanoseconds(record.time))
            yield Considered(transition, str(Phase.AFTER), Verdict.NOT_DUE, remaining=remaining)


def _explain_selection(selection: Selection, memo: Mapping[Any, Any]) -> Iterator[Considered]:
    selector = selection.selector
    if selector is None:
        return
    configuration, plan = selection.configuration, selection.plan
    evaluation = configuration.generator.evaluation(memo, selection.values, configuration.active, _gone)
    seen: set[int] = set()
    for chain in selector.chains:
        fired = False
        for index in chain.candidates:
            if selection.trigger is Phase.AFTER and index not in selection.due:
                continue
            one = _consider(configuration, index, str(selection.trigger), evaluation, plan, earlier=fired)
            fired = fired or one.verdict in (Verdict.TAKEN, Verdict.PREEMPTED, Verdict.UNDONE)
            if index not in seen:
                seen.add(index)
                yield one


def _consider(
    configuration: Configuration,
    index: int,
    trigger: str,
    evaluation: Evaluation,
    plan: Plan | None,
    *,
    earlier: bool,
) -> Considered:
    transition = configuration.topology.model.transitions[index]
    if earlier:
        return Considered(transition, trigger, Verdict.EARLIER)
    decision = configuration.generator.decision(index)
    evaluation.asked.clear()
    try:
        held, path = decision.follow(evaluation.condition)
    except (SignalFault, ArithmeticError):
        return Considered(transition, trigger, Verdict.FAILED)
    verdict = Verdict.FALSE
    if held:
        verdict = Verdict.UNDONE if plan is None else Verdict.PREEMPTED
        if plan is not None and index in plan.transitions:
            verdict = Verdict.TAKEN
    judged = decision.values(path)
    return Considered(
        transition,
        trigger,
        verdict,
        tuple((expression_text(one), value) for one, value in zip(decision.conditions, judged, strict=True)),
        tuple(
            dict(
                pair
                for one, value in zip(decision.conditions, judged, strict=True)
                if value is not None
                for pair in _values(one, evaluation)
            ).items()
        ),
    )


def _values(expression: Expression, evaluation: Evaluation) -> Iterator[tuple[str, Any]]:
    """The signals and variables in an expression, as text, with their values."""
    match expression:
        case SignalValue(signal, arguments):
            key = evaluation.key(expression, evaluation.values)
            if key in evaluation.memo:
                yield call_text(signal.name, signal.parameters, arguments), evaluation.memo[key]
        case VariableValue(name):
            yield name, evaluation.value(expression)
        case Unary(_, operand):
            yield from _values(operand, evaluation)
        case Binary(_, left, right):
            yield from _values(left, evaluation)
            yield from _values(right, evaluation)
        case Choice(condition, then, otherwise):
            for one in (condition, then, otherwise):
                yield from _values(one, evaluation)


def _gone(call: SignalValue) -> Any:
    raise SignalFault(call, LookupError("it gave no value in this step"))
