"""Scenarios as text: the form of generated tests and counterexamples."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from hsm.engine.occurrences import is_adjustment
from hsm.model.chart import Call, Model
from hsm.model.expressions import Expression, SignalValue
from hsm.model.registry import Parameter
from hsm.model.rewriting import actions_of, expressions_of, parts_of
from hsm.model.types import Type
from hsm.model.unparse import value_text
from hsm.testing.scenarios.scenarios import (
    Expectation,
    ExpectationClause,
    InState,
    Performs,
    Raises,
    Scenario,
    SignalValues,
    Stimulus,
)
from hsm.testing.scenarios.script import FAULT

_WIDTH = 110


class Writer:
    """Writes scenarios about one machine."""

    def __init__(self, model: Model, expressions: Iterable[Expression] = ()) -> None:
        self._model = model
        everything = (part for one in (*expressions_of(model), *expressions) for part in parts_of(one))
        self._signals = {one.signal.name: one.signal for one in everything if isinstance(one, SignalValue)}
        self._types: dict[str, Type] = {one.name: one.type for one in model.parameters}
        own = [state.name.rpartition(".")[2] for state in model.states]
        self._short = {
            state.name: name if own.count(name) == 1 else state.name
            for state, name in zip(model.states, own, strict=True)
        }
        self._activities = {
            state.activity.activity.name: state.activity.activity
            for state in model.states
            if state.activity is not None
        }
        self._actions = {one.action.name: one.action for one in actions_of(model) if isinstance(one, Call)}

    def suite(self, scenarios: Sequence[Scenario], comment: Sequence[str] = ()) -> str:
        """The text of a file.

        Args:
            scenarios: what is in it.
            comment: what is at its top, line by line.
        """
        head = [*(f"# {one}".rstrip() for one in comment), f"test {self._model.name}"]
        return "\n".join([*head, *(line for one in scenarios for line in ("", *self.scenario(one)))]) + "\n"

    def scenario(self, scenario: Scenario) -> list[str]:
        """The lines of one scenario."""
        lines = [f"scenario {scenario.name}"]
        if scenario.covers:
            lines += _wrapped("covers", list(scenario.covers))
        given = [
            *(f"{name} = {value_text(value, self._types.get(name))}" for name, value in scenario.parameters.items()),
            *self.settings(scenario.given),
        ]
        if given:
            lines += _wrapped("given", given)
        for step in scenario.steps:
            lines += self.stimulus(step) if isinstance(step, Stimulus) else self.expectation(step)
        return lines

    def stimulus(self, step: Stimulus) -> list[str]:
        """The lines of what happens in one step."""
        happens = [f"{name} fails" if one == FAULT else f"{name} reports {one}" for name, one in step.reports.items()]
        happens += [one if is_adjustment(one) else f"event {one}" for one in step.events]
        happens += [*self.settings(step.signals), *(f"{one} fails" for one in sorted(step.failing))]
        if step.after is None:
            return _wrapped("when", happens)
        return _wrapped(f"after {step.after:.10g} s", happens, ",")

    def settings(self, settings: SignalValues) -> list[str]:
        """Signals with their values."""
        told = []
        for key, value in settings.items():
            name, arguments = (key, ()) if isinstance(key, str) else key
            declared = self._signals.get(name)
            subject = name
            if declared is not None and arguments:
                subject = f"{name}({self._arguments(declared.parameters, dict(enumerate(arguments)))})"
            if isinstance(value, bool):
                told.append(subject if value else f"not {subject}")
            else:
                told.append(f"{subject} = {value_text(value, declared.type if declared else None)}")
        return told

    def expectation(self, step: Expectation) -> list[str]:
        """The lines of what is expected."""
        lines = _wrapped("expect", [one.text for one in step.claims])
        if step.within is not None:
            lines[-1] += f" within {step.within:.10g} s"
        return lines

    def in_state(self, state: str) -> ExpectationClause:
        """The claim that a state is active."""
        return ExpectationClause(InState(state), self._short[state])

    def performs(self, name: str, arguments: Sequence[Any], *, action: bool) -> ExpectationClause:
        """The claim that an activity runs or an action was called, with all its arguments."""
        given = dict(enumerate(arguments))
        parameters = self._actions[name].parameters if action else self._activities[name].parameters
        content = Performs(name, given, action=action)
        return ExpectationClause(
            content, f"{'called' if action else 'doing'} {name}({self._arguments(parameters, given)})"
        )

    def sends(self, event: str) -> ExpectationClause:
        """The claim that the machine sent an event to other machines."""
        return ExpectationClause(Raises(event, sent=True), f"sent {event}")

    def raises(self, event: str) -> ExpectationClause:
        """The claim that the machine raised an event."""
        return ExpectationClause(Raises(event), f"raised {event}")

    def value(self, name: str, value: Any, kind: Type) -> str:
        """The text of the claim that a variable has a value."""
        if isinstance(value, bool):
            return name if value else f"not {name}"
        return f"{name} == {value_text(value, kind)}"

    def _arguments(self, parameters: Sequence[Parameter], given: Mapping[int, Any]) -> str:
        return ", ".join(f"{parameters[at].name} = {value_text(one, parameters[at].type)}" for at, one in given.items())


def _wrapped(head: str, parts: Sequence[str], joint: str = "") -> list[str]:
    """A line of parts with commas; a long one continues on the next line, indented."""
    lines = [f"    {head}{joint if parts else ''}"]
    for index, part in enumerate(parts):
        text = f" {part}{',' if index < len(parts) - 1 else ''}"
        if len(lines[-1]) + len(text) > _WIDTH and index:
            lines.append("       ")
        lines[-1] += text
    return lines
