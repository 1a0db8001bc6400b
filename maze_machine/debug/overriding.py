"""Signals of a simulated robot that a person has set: they keep their values, whatever the robot senses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

from hsm import Machine
from hsm.model.expressions import Expression, SignalValue
from hsm.model.registry import SignalDeclaration
from hsm.model.rewriting import Rewriter
from hsm.testing.scenarios.script import SignalKey


@dataclass(slots=True)
class Overrides:
    """Values by a signal's name, or by its name and arguments, which goes first.

    Attributes:
        values: what was set.
    """

    values: dict[str | SignalKey, Any] = field(default_factory=dict)

    def machine(self, machine: Machine[Any, Any]) -> Machine[Any, Any]:
        """The same machine with signals that check these values first."""
        known: dict[str, SignalDeclaration] = {}

        def on_expression(expression: Expression) -> Expression:
            if not isinstance(expression, SignalValue):
                return expression
            declared = expression.signal
            if declared.name not in known:
                known[declared.name] = replace(declared, function=self._asking(declared))
            return replace(expression, signal=known[declared.name])

        return Machine(Rewriter(on_expression).model(machine.model))

    def _asking(self, declared: SignalDeclaration) -> Callable[..., Any]:
        def ask(facts: Any, *arguments: Any) -> Any:
            for key in ((declared.name, arguments), declared.name):
                if key in self.values:
                    return self.values[key]
            return declared.function(facts, *arguments)

        return ask
