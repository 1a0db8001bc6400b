"""What a debugger sees of one step of a machine that runs elsewhere: what was published of it."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from hsm.engine.evaluation import UNSET
from hsm.model.expressions import Expression, SignalValue
from maze_machine.debug.chart import Chart
from maze_machine.debug.steps import Reason
from maze_machine.drive.trace import transition_text


@dataclass(frozen=True, slots=True)
class HeardStep:
    """A step as it was published: one point, at its end.

    Attributes:
        chart: the machine, as its file is here.
        heard: what was published.
        before: the active states before it.
        why: gives what became of a state's transitions; only of the newest step is that known.
    """

    chart: Chart
    heard: Mapping[str, Any]
    before: frozenset[str]
    why: Callable[[str], Sequence[Reason]]

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
        taken, machine = set(_texts(self.heard.get("taken"))), self.chart.machine
        return tuple(one.index for one in self.chart.model.transitions if transition_text(machine, one) in taken)

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
        """What the active states do, by state."""
        found = self.heard.get("doing")
        return {name: str(text) for name, text in found.items()} if isinstance(found, dict) else {}

    def reasons(self, point: int) -> Sequence[Reason]:
        """What became of the transitions of the active states."""
        return [reason for state in self.states(point) for reason in self.why(state)]

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
    return [one for one in found if isinstance(one, str)] if isinstance(found, list) else []
