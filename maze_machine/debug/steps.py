"""One step of a run for a debugger.

A step in which ``count`` microsteps were done has ``count + 1`` points: before each of them, and after the last. At
the point before a microstep its transitions are chosen and not taken yet, like the next line of a program.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from hsm import Macrostep
from hsm.engine.configuration import Configuration
from hsm.engine.evaluation import UNSET
from hsm.engine.explanation import Considered, explain
from hsm.engine.record import Phase, Selection
from hsm.model.expressions import Expression, SignalValue
from hsm.model.registry import SignalDeclaration
from hsm.model.unparse import activity_text, value_text
from hsm.testing.scenarios.script import Performed, ScriptedFault
from maze_machine.debug.chart import Chart


@dataclass(frozen=True, slots=True)
class TransitionReason:
    """The verdict about a considered transition.

    Attributes:
        state: the state whose transition it is.
        label: the transition.
        line: where it is written; None if unknown.
        verdict: its verdict, in a few words.
        reason: the same, with the values that decided it.
        values: each condition and signal that was evaluated, with its value.
    """

    state: str
    label: str
    line: int | None
    verdict: str
    reason: str
    values: tuple[tuple[str, str], ...] = ()


class Step(Protocol):
    """One step of a run; its points are numbered from 0 to ``count``."""

    @property
    def time(self) -> float:
        """Seconds on the run's clock."""
        ...

    @property
    def count(self) -> int:
        """How many microsteps were done."""
        ...

    @property
    def outcome(self) -> str | None:
        """The final state that ended the run in this step, or None."""
        ...

    @property
    def violations(self) -> Sequence[str]:
        """Properties of the machine that do not hold from this step on, in words."""
        ...

    def transitions(self, point: int) -> tuple[int, ...]:
        """The transitions that are taken next."""
        ...

    def entered(self, point: int) -> Collection[str]:
        """The states that were entered just before."""
        ...

    def states(self, point: int) -> tuple[str, ...]:
        """The active states, in document order."""
        ...

    def variables(self, point: int) -> Mapping[str, Any]:
        """Variables and parameters by full name."""
        ...

    def signals(self) -> Mapping[str, Any]:
        """The signals that are known in this step, as they are written."""
        ...

    def doing(self, point: int) -> Mapping[str, str]:
        """The activities of the active states, by state."""
        ...

    def performed(self, point: int) -> Sequence[Performed]:
        """The same with the values of their arguments; without them where an activity has not begun."""
        ...

    def reasons(self, point: int) -> Sequence[TransitionReason]:
        """The verdicts about the transitions that were considered between this point and the previous one."""
        ...

    def value(self, point: int, expression: Expression) -> Any:
        """The value of an expression; ``UNSET`` where it has none."""
        ...


class LocalStep:
    """A step of a machine that runs in this process, or has run.

    Attributes:
        chart: the machine.
        step: what it did.
        after: the variables after the step.
        outcome: the final state that ended the run, or None.
        violations: properties that do not hold from here on, in words.
        arguments: what the activities were begun with, by state.
    """

    def __init__(
        self,
        chart: Chart,
        step: Macrostep,
        after: Mapping[str, Any],
        outcome: str | None,
        *,
        arguments: Mapping[str, Sequence[Any]],
        before: Step | None = None,
        violations: Sequence[str] = (),
        read: Callable[[SignalDeclaration, tuple[Any, ...]], Any] | None = None,
    ) -> None:
        """Begin with a step that was done.

        Args: as the attributes, and
            before: the previous step.
            read: returns signals that the step itself did not use; None where they are not known.
        """
        self.arguments = arguments
        self._begun = before.arguments if isinstance(before, LocalStep) else {}
        self.chart = chart
        self.step = step
        self.after = after
        self.outcome = outcome
        self.violations = violations
        self._read = read
        self._selections: tuple[Selection, ...] = step.selections
        self._fired = [number for number, one in enumerate(self._selections) if one.plan is not None]

    @property
    def time(self) -> float:
        """Seconds on the run's clock."""
        return self.step.time

    @property
    def count(self) -> int:
        """How many microsteps were done."""
        return len(self._fired)

    def transitions(self, point: int) -> tuple[int, ...]:
        """The transitions that are taken next."""
        if point >= self.count:
            return ()
        plan = self._selections[self._fired[point]].plan
        return () if plan is None else plan.transitions

    def entered(self, point: int) -> Collection[str]:
        """The states that were entered just before."""
        plan = self._selections[self._fired[point - 1]].plan if point > 0 else None
        states = self.chart.model.states
        return () if plan is None else [states[one].name for one in plan.entered if one]

    def states(self, point: int) -> tuple[str, ...]:
        """The active states, in document order."""
        if point < self.count and self._selections[self._fired[point]].trigger is Phase.START:
            return ()
        return self.chart.in_order(self._configuration(point).names)

    def variables(self, point: int) -> Mapping[str, Any]:
        """Variables and parameters by full name."""
        if point >= self.count:
            return self.after
        names, values = self.chart.machine.generator.variables, self._selections[self._fired[point]].values
        return {name: value for name, value in zip(names, values, strict=True) if value is not None}

    def signals(self) -> Mapping[str, Any]:
        """The signals that are known in this step, as they are written."""
        found = {text: self.value(self.count, call) for text, call in self.chart.signals.items()}
        return {text: value for text, value in found.items() if value is not UNSET}

    def doing(self, point: int) -> Mapping[str, str]:
        """The activities of the active states, by state."""
        states, indices = self.chart.model.states, self.chart.machine.indices
        active = [states[indices[name]] for name in self.states(point)]
        return {state.name: activity_text(state.activity) for state in active if state.activity is not None}

    def performed(self, point: int) -> Sequence[Performed]:
        """The same with the values of their arguments; without them where an activity has not begun."""
        new = {name for one in range(1, point + 1) for name in self.entered(one)} if point < self.count else ()
        begun = self.arguments if point >= self.count else self._begun
        return [
            Performed(self._activity(name), () if name in new else tuple(begun.get(name, ())))
            for name in self.doing(point)
        ]

    def reasons(self, point: int) -> Sequence[TransitionReason]:
        """The verdicts about the transitions that were considered between this point and the previous one."""
        first = self._fired[point - 1] + 1 if point > 0 else 0
        record = self.step.record
        if point < self.count:
            looked = self._selections[first : self._fired[point] + 1]
            record = record._replace(selections=looked, values=None, timers={})
        else:
            record = record._replace(selections=self._selections[first:])
        return [self._reason(one) for one in explain(record)]

    def value(self, point: int, expression: Expression) -> Any:
        """The value of an expression; ``UNSET`` where it has none."""
        variables = self.variables(point)
        values = [variables.get(name) for name in self.chart.machine.generator.variables]
        active = frozenset(self.chart.machine.indices[name] for name in self.states(point))

        def ask(call: SignalValue) -> Any:
            if self._read is None:
                raise LookupError(call.signal.name)
            return self._read(call.signal, tuple(evaluation.value(one) for one in call.arguments))

        evaluation = self.chart.machine.generator.evaluation(self.step.record.memo, values, active, ask)
        try:
            return evaluation.value(expression)
        except (LookupError, TypeError, ArithmeticError, ScriptedFault):
            return UNSET

    def _activity(self, state: str) -> str:
        call = self.chart.model.states[self.chart.machine.indices[state]].activity
        return "" if call is None else call.activity.name

    def _configuration(self, point: int) -> Configuration:
        if point < self.count:
            return self._selections[self._fired[point]].configuration
        return self.step.record.after

    def _reason(self, one: Considered) -> TransitionReason:
        transition, model = one.transition, self.chart.model
        conditions = [(text, "not looked at" if value is None else value_text(value)) for text, value in one.conditions]
        values = [(text, self.chart.signal_text(text, value)) for text, value in one.values]
        return TransitionReason(
            model.states[transition.source].name,
            self.chart.label(transition.index),
            None if transition.place is None else transition.place.line,
            one.verdict.name.lower().replace("_", " "),
            one.reason,
            tuple(dict([*conditions, *values]).items()),
        )
