"""A machine, and the record of one step, as JSON values, for programs that show, record or send a run.

One value per step serves all of them. It is computed from the engine's record; each part on first use, possibly later
and in another thread.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from enum import Enum
from functools import cached_property
from math import isinf
from pathlib import Path
from typing import Any

from hsm.engine.compiled import CompiledChart
from hsm.engine.evaluation import all_signals
from hsm.engine.explanation import Considered
from hsm.engine.macrostep import Macrostep
from hsm.engine.monitoring import Violation
from hsm.engine.occurrences import sent_text
from hsm.model.chart import Model, State, StateKind, Transition
from hsm.model.diagnostics import Place
from hsm.model.events import StateEvent
from hsm.model.expressions import SignalValue
from hsm.model.rewriting import expressions_of
from hsm.model.topology import HISTORY
from hsm.model.unparse import action_text, activity_text, call_text, trigger_text, value_text
from hsm.model.values import dataclass


@dataclass(frozen=True)
class StepReport:
    """The report of one step of a run.

    Attributes:
        machine: the machine.
        step: the engine's record of the step.
        outcome: the final state that ended the run; None while it runs.
        variables: variables and parameters after the step, by their full names.
        arguments: what the running activities were begun with, by the full names of their states.
        violations: properties and assumptions that do not hold from this step on.
    """

    machine: CompiledChart
    step: Macrostep
    outcome: str | None = None
    variables: Mapping[str, Any] = field(default_factory=dict)
    arguments: Mapping[str, Sequence[Any]] = field(default_factory=dict)
    violations: tuple[Violation, ...] = ()

    @cached_property
    def states(self) -> tuple[str, ...]:
        """Full names of all active states, in document order."""
        return tuple(sorted(self.step.configuration, key=self.machine.indices.__getitem__))

    @cached_property
    def transitions(self) -> tuple[Transition, ...]:
        """The transitions taken, in order."""
        return self.step.transitions

    @cached_property
    def taken(self) -> tuple[str, ...]:
        """The transitions taken, in words: source, targets and line."""
        return tuple(transition_text(self.machine.model, one) for one in self.transitions)

    @cached_property
    def verdicts(self) -> tuple[Considered, ...]:
        """Each transition that was considered or that an active state has, with its verdict and the reason."""
        return self.step.verdicts

    @cached_property
    def outcomes(self) -> tuple[tuple[str, str], ...]:
        """The outcomes and completions that the step received: the state and the outcome."""
        heard = (one.trigger for one in self.step.selections)
        names = self.machine.model.states
        return tuple((names[one.origin].name, str(one)) for one in heard if isinstance(one, StateEvent))

    @cached_property
    def regions(self) -> dict[str, str]:
        """The innermost active state of each region: a child of a parallel state, or the whole machine."""
        model = self.machine.model
        regions: dict[str, str] = {}
        for name in self.states:
            state = above = model.states[self.machine.indices[name]]
            while above.parent >= 0 and model.states[above.parent].kind is not StateKind.PARALLEL:
                above = model.states[above.parent]
            if not state.children:
                regions[model.name if above.parent < 0 else above.name] = name
        return regions

    @cached_property
    def activities(self) -> dict[str, dict[str, Any]]:
        """The activities of the active states: as written, and with the values of their arguments."""
        found: dict[str, dict[str, Any]] = {}
        for name in self.states:
            call = self.machine.model.states[self.machine.indices[name]].activity
            if call is not None:
                values = self.arguments.get(name, ())
                named = {
                    one.name: value_text(value, one.type)
                    for one, value in zip(call.activity.parameters, values, strict=False)
                }
                found[name] = {"text": activity_text(call), "arguments": named}
        return found

    @cached_property
    def why(self) -> list[dict[str, Any]]:
        """The verdict about each of these transitions: its index, the verdict, and the reason with its values."""
        return [
            {"transition": one.transition.index, "verdict": one.verdict.name.lower(), "reason": one.reason}
            for one in self.verdicts
        ]

    @cached_property
    def values(self) -> dict[str, Any]:
        """Variables and parameters as JSON values."""
        return {name: json_value(value) for name, value in self.variables.items()}

    @property
    def sent(self) -> tuple[str, ...]:
        """The events that were sent to other machines, as texts with what they carry, in order."""
        return tuple(sent_text(self.machine.model, one) for one in self.step.sent)

    @property
    def violated(self) -> list[str]:
        """Names of the properties that do not hold from this step on."""
        return [one.property.name for one in self.violations if not one.assumed]

    @property
    def broken(self) -> list[str]:
        """Names of the assumptions that do not hold from this step on."""
        return [one.property.name for one in self.violations if one.assumed]


def transition_text(model: Model, transition: Transition) -> str:
    """A transition in a few words: source, targets and line."""
    targets = ", ".join(model.states[target].name for target in transition.targets)
    arrow = f" -> {targets}" if targets else ""
    place = f" (line {transition.place.line})" if transition.place else ""
    return f"{model.states[transition.source].name}{arrow}{place}"


def signals_of(model: Model) -> dict[str, SignalValue]:
    """The signals that a machine asks for, each as it is written."""
    found: dict[str, SignalValue] = {}
    for expression in expressions_of(model):
        for call in all_signals(expression):
            found.setdefault(call_text(call.signal.name, call.signal.parameters, call.arguments), call)
    return found


def json_value(value: Any) -> Any:
    """A value of the language for JSON: a member of an enumeration is its name."""
    return str(value.value) if isinstance(value, Enum) else value


def model_json(model: Model, parameters: Mapping[str, Any]) -> dict[str, Any]:
    """The constant part of a run: states with their kinds and parents, transitions, events, parameters.

    Args:
        model: the machine.
        parameters: the values of its parameters, in SI units.

    Returns:
        JSON values; ``adjustable`` holds the bounds of each parameter that an operator may change. Transitions are in
        the order of their indices. Files go by their names, without folders.
    """
    types = {one.name: one.type for one in model.parameters} | {one.name: one.type for one in model.variables}
    return {
        "machine": model.name,
        "parameters": {name: json_value(value) for name, value in parameters.items()},
        "types": {name: str(kind) for name, kind in types.items()},
        "adjustable": {
            one.parameter: [None if isinf(bound) else bound for bound in (one.least, one.most)]
            for one in model.adjustable
        },
        "events": None if model.events is None else sorted(model.events),
        "event_data": {one.event: {part.name: str(part.type) for part in one.fields} for one in model.event_data},
        "states": [_state(model, state) for state in model.states[1:] if state.kind not in HISTORY],
        "transitions": [_transition(model, one) for one in model.transitions],
        "properties": {one.name: one.text for one in model.properties},
        "assumptions": {one.name: one.text for one in model.assumptions},
    }


def _state(model: Model, state: State) -> dict[str, Any]:
    return {
        "index": state.index,
        "name": state.name,
        "kind": state.kind.value,
        "parent": None if state.parent in (None, 0) else model.states[state.parent].name,
        "instance": state.instance,
        "activity": None if state.activity is None else activity_text(state.activity),
        **_place(state.place),
    }


def _transition(model: Model, one: Transition) -> dict[str, Any]:
    return {
        "source": model.states[one.source].name,
        "targets": [model.states[target].name for target in one.targets],
        "trigger": trigger_text(one.trigger, one.guard),
        "actions": [action_text(action) for action in one.actions],
        **_place(one.place),
    }


def _place(place: Place | None) -> dict[str, Any]:
    return {"file": None, "line": None} if place is None else {"file": Path(place.file).name, "line": place.line}
