"""One step of a remote machine for a debugger, as it was published."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from math import nan
from typing import Any

from hsm.engine.evaluation import UNSET
from hsm.model.expressions import Expression, SignalValue
from hsm.model.types import Type
from hsm.model.written import value_of
from hsm.testing.scenarios.script import Performed
from maze_machine.debug.chart import Chart
from maze_machine.debug.steps import TransitionReason


@dataclass(frozen=True, slots=True)
class HeardStep:
    """A step as it was published: one point, at its end.

    Attributes:
        chart: the machine from the local file.
        heard: the published step, of the published form.
        before: the active states before it.
    """

    chart: Chart
    heard: Mapping[str, Any]
    before: frozenset[str]

    @property
    def time(self) -> float:
        """Seconds on the robot's clock."""
        return float(self.heard["stamp"] / 1e9)

    @property
    def count(self) -> int:
        """Microsteps are not published one by one."""
        return 0

    @property
    def outcome(self) -> str | None:
        """The final state that ended the run in this step, or None."""
        return self.heard.get("outcome")

    @property
    def violations(self) -> Sequence[str]:
        """Properties of the machine that do not hold from this step on, in words."""
        return [f"property {one} is violated" for one in self.heard.get("violated", ())]

    def transitions(self, _point: int) -> tuple[int, ...]:
        """The transitions that were taken in the step."""
        return tuple(one for one in self.heard["fired"] if one < len(self.chart.model.transitions))

    def entered(self, point: int) -> Collection[str]:
        """The states that are active and were not before."""
        return set(self.states(point)) - self.before

    def states(self, _point: int) -> tuple[str, ...]:
        """The active states, in document order."""
        known = self.chart.machine.indices
        return self.chart.in_order(one for one in self.heard["states"] if one in known)

    def variables(self, _point: int) -> Mapping[str, Any]:
        """Variables and parameters by full name."""
        found: Mapping[str, Any] = self.heard["variables"]
        return found

    def signals(self) -> Mapping[str, Any]:
        """Signals are not published."""
        return {}

    def doing(self, _point: int) -> Mapping[str, str]:
        """The activities of the active states, by state."""
        return {name: one["text"] for name, one in self.heard["activities"].items()}

    def performed(self, _point: int) -> Sequence[Performed]:
        """The same with the values of their arguments; without them where an activity has not begun."""
        model, indices = self.chart.model, self.chart.machine.indices
        found: list[Performed] = []
        for name, one in self.heard["activities"].items():
            call = model.states[indices[name]].activity if name in indices else None
            if call is not None:
                texts = list(one["arguments"].values())
                values = tuple(map(_value, texts, (part.type for part in call.activity.parameters)))
                found.append(Performed(call.activity.name, values))
        return found

    def reasons(self, _point: int) -> Sequence[TransitionReason]:
        """The verdicts about the considered transitions."""
        model = self.chart.model
        reasons: list[TransitionReason] = []
        for one in self.heard["why"]:
            index = one["transition"]
            if index >= len(model.transitions):  # of another version of the machine
                continue
            transition = model.transitions[index]
            reasons.append(
                TransitionReason(
                    model.states[transition.source].name,
                    self.chart.label(index),
                    None if transition.place is None else transition.place.line,
                    one["verdict"].replace("_", " "),
                    one["reason"],
                )
            )
        return reasons

    def value(self, point: int, expression: Expression) -> Any:
        """The value of an expression of states and variables; ``UNSET`` where a signal is in it."""
        generator = self.chart.machine.generator
        variables = self.variables(point)
        active = frozenset(self.chart.machine.indices[name] for name in self.states(point))
        values = [variables.get(name) for name in generator.variables]
        try:
            return generator.evaluation({}, values, active, _unheard).value(expression)
        except (LookupError, TypeError, ArithmeticError):
            return UNSET


def _value(text: str, kind: Type) -> Any:
    """The value that a published text represents; units that cannot be written in a machine are SI units.

    Not a number, and so equal to nothing, where it represents none.
    """
    for written in (text, text.partition(" ")[0]):
        with suppress(ValueError):
            return value_of(written, kind)
    return nan


def _unheard(call: SignalValue) -> Any:
    raise LookupError(call.signal.name)
