"""A machine without its robot: signals have the values that a script says, activities end when a script says so."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, replace
from enum import Enum
from functools import partial
from typing import Any, Protocol

from hsm.engine.machine import Machine
from hsm.model.chart import Action, ActivityCall, Call, Model, State
from hsm.model.expressions import Expression, SignalValue
from hsm.model.registry import ActionDeclaration, ActivityDeclaration, Outcome, SignalDeclaration
from hsm.model.rewriting import Rewriter
from hsm.model.types import Boolean, Enumeration, Integer
from hsm.model.values import dataclass

FAULT = "fault"
"""A pseudo-outcome: the activity raises an exception."""

SignalKey = tuple[str, tuple[Any, ...]]
"""A signal's name and the values of its arguments."""


class ScriptedFault(Exception):  # noqa: N818 - a fault is the language's word
    """The exception of a signal or an activity that should fail."""


@dataclass(frozen=True, slots=True)
class Performed:
    """A running activity or a called action, with its arguments."""

    name: str
    arguments: tuple[Any, ...] = ()


class ScriptedFacts(Protocol):
    """The facts of a scripted machine, which replace a robot's facts."""

    def read(self, signal: SignalDeclaration, arguments: tuple[Any, ...]) -> Any:
        """The value of a signal."""
        ...

    def call(self, action: ActionDeclaration, arguments: tuple[Any, ...]) -> None:
        """Record that an action was called."""
        ...

    def report(self, state: str) -> str | None:
        """How the activity of a state ends now: an outcome, ``FAULT``, or None where it continues."""
        ...


@dataclass(slots=True)
class Script:
    """Facts of one step, given as values.

    Attributes:
        signals: values by name, or by name and arguments, which goes first; of others the default of their type.
        reports: how the activities of some states end, by the state's full name.
        calls: the actions called so far.
        failing: names of signals that fail.
    """

    signals: Mapping[str | SignalKey, Any] = field(default_factory=dict)
    reports: Mapping[str, str] = field(default_factory=dict)
    calls: list[Performed] = field(default_factory=list)
    failing: frozenset[str] = frozenset()

    def read(self, signal: SignalDeclaration, arguments: tuple[Any, ...]) -> Any:
        """The value of a signal."""
        if signal.name in self.failing:
            raise ScriptedFault(f"signal `{signal.name}` is to fail")
        if arguments and (signal.name, arguments) in self.signals:
            return self.signals[signal.name, arguments]
        if signal.name in self.signals:
            return self.signals[signal.name]
        return default_of(signal)

    def call(self, action: ActionDeclaration, arguments: tuple[Any, ...]) -> None:
        """Record that an action was called."""
        self.calls.append(Performed(action.name, arguments))

    def report(self, state: str) -> str | None:
        """How the activity of a state ends now."""
        return self.reports.get(state)


class StandIn:
    """Replaces an activity: only records its arguments until it should end."""

    def __init__(self, state: str, activity: ActivityDeclaration, *arguments: Any) -> None:
        self._state = state
        self._performed = Performed(activity.name, arguments)

    def tick(self, facts: ScriptedFacts) -> Performed | Outcome:
        """Its arguments, or its outcome."""
        outcome = facts.report(self._state)
        if outcome == FAULT:
            raise ScriptedFault(f"activity `{self._performed.name}` is to fail")
        return self._performed if outcome is None else Outcome(outcome)


def default_of(signal: SignalDeclaration) -> Any:
    """The default value of a signal: false, zero, or the first member of its enumeration."""
    match signal.type:
        case Boolean():
            return False
        case Integer():
            return 0
        case Enumeration(members=members):
            return member_of(signal, members[0])
        case _:
            return 0.0


def member_of(signal: SignalDeclaration, name: str) -> Any:
    """A member of the enumeration that a signal gives."""
    from typing import get_type_hints  # noqa: PLC0415 - only enumerations need it

    enumeration = get_type_hints(signal.function).get("return")
    if isinstance(enumeration, type) and issubclass(enumeration, Enum):
        return enumeration(name)
    return name


def scripted(model: Model) -> Model:
    """A machine whose signals, actions and activities ask ``ScriptedFacts`` instead of a robot's facts."""
    signals: dict[str, SignalDeclaration] = {}
    actions: dict[str, ActionDeclaration] = {}

    def signal(declared: SignalDeclaration) -> SignalDeclaration:
        def read(facts: ScriptedFacts, *arguments: Any) -> Any:
            return facts.read(declared, arguments)

        return replace(declared, function=read)

    def action(declared: ActionDeclaration) -> ActionDeclaration:
        def call(facts: ScriptedFacts, *arguments: Any) -> None:
            facts.call(declared, arguments)

        return replace(declared, function=call)

    def on_expression(expression: Expression) -> Expression:
        if not isinstance(expression, SignalValue):
            return expression
        declared = expression.signal
        if declared.name not in signals:
            signals[declared.name] = signal(declared)
        return replace(expression, signal=signals[declared.name])

    def on_action(one: Action) -> Action:
        if not isinstance(one, Call):
            return one
        if one.action.name not in actions:
            actions[one.action.name] = action(one.action)
        return replace(one, action=actions[one.action.name])

    def on_activity(state: State, call: ActivityCall) -> ActivityCall:
        made = partial(StandIn, state.name, call.activity)
        return replace(call, activity=replace(call.activity, factory=made))

    return Rewriter(on_expression, on_action, on_activity).model(model)


class ScriptedMachine(Machine):
    """A machine whose signals, actions and activities ask ``ScriptedFacts``; all of its runs share what it compiles."""


def scripted_machine(machine: Machine | Model) -> ScriptedMachine:
    """The same for a machine that is ready to run; one that is scripted already stays as it is."""
    if isinstance(machine, ScriptedMachine):
        return machine
    return ScriptedMachine(scripted(machine.model if isinstance(machine, Machine) else machine))
