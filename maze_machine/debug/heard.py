"""One step of a remote machine for a debugger, as it was published."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from hsm.engine.evaluation import UNSET
from hsm.model.expressions import Expression, SignalValue
from maze_machine.debug.chart import Chart
from maze_machine.debug.steps import TransitionReason


@dataclass(frozen=True, slots=True)
class HeardStep:
    """A step as it was published: one point, at its end.

    Attributes:
        chart: the machine from the local file.
        heard: the published step.
        before: the active states before it.
    """

    chart: Chart
    heard: Mapping[str, Any]
    before: frozenset[str]

    @property
    def time(self) -> float:
        """Seconds on the robot's clock."""
        stamp = self.heard.get("stamp", 0)
        return stamp / 1e9 if isinstance(stamp, int) else 0.0

    @property
    def count(self) -> int:
        """Microsteps are not published one by one."""
        return 0

    @property
    def outcome(self) -> str | None:
        """The final state that ended the run in this step, or None."""
        found = self.heard.get("outcome")
        return None if found is None else str(found)

    @property
    def violations(self) -> Sequence[str]:
        """Properties of the machine that do not hold from this step on, in words."""
        return [f"property {one} is violated" for one in _texts(self.heard.get("violated"))]

    def transitions(self, _point: int) -> tuple[int, ...]:
        """The transitions that were taken in the step."""
        fired, count = self.heard.get("fired"), len(self.chart.model.transitions)
        return (
            tuple(one for one in fired if isinstance(one, int) and 0 <= one < count) if isinstance(fired, list) else ()
        )

    def entered(self, point: int) -> Collection[str]:
        """The states that are active and were not before."""
        return set(self.states(point)) - self.before

    def states(self, _point: int) -> tuple[str, ...]:
        """The active states, in document order."""
        known = self.chart.machine.indices
        return self.chart.in_order(one for one in _texts(self.heard.get("states")) if one in known)

    def variables(self, _point: int) -> Mapping[str, Any]:
        """Variables and parameters by full name."""
        found = self.heard.get("variables")
        return found if isinstance(found, dict) else {}

    def signals(self) -> Mapping[str, Any]:
        """Signals are not published."""
        return {}

    def doing(self, _point: int) -> Mapping[str, str]:
        """The activities of the active states, by state."""
        found = self.heard.get("activities")
        known = found.items() if isinstance(found, dict) else ()
        return {name: str(one.get("text")) for name, one in known if isinstance(one, dict)}

    def reasons(self, _point: int) -> Sequence[TransitionReason]:
        """The verdicts about the considered transitions."""
        found, model = self.heard.get("why"), self.chart.model
        reasons: list[TransitionReason] = []
        for one in _listed(found):
            index = one.get("transition") if isinstance(one, dict) else None
            if not isinstance(index, int) or not 0 <= index < len(model.transitions):
                continue
            transition = model.transitions[index]
            reasons.append(
                TransitionReason(
                    model.states[transition.source].name,
                    self.chart.label(index),
                    None if transition.place is None else transition.place.line,
                    str(one.get("verdict")).replace("_", " "),
                    str(one.get("reason")),
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


def _unheard(call: SignalValue) -> Any:
    raise LookupError(call.signal.name)


def _texts(found: object) -> list[str]:
    return [one for one in _listed(found) if isinstance(one, str)]


def _listed(found: object) -> list[Any]:
    return found if isinstance(found, list) else []
