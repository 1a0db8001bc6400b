"""Drives a scripted machine, step by step, with a manual clock."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from enum import StrEnum
from typing import Any

from hsm.engine.evaluation import UNSET
from hsm.engine.machine import Machine
from hsm.engine.macrostep import Macrostep
from hsm.model.chart import Model, Raise, Send
from hsm.model.expressions import Expression, SignalValue
from hsm.testing.scenarios.scenarios import Stimulus
from hsm.testing.scenarios.script import Performed, Script, ScriptedFault, scripted_machine

TICK = 0.1
"""The default time from one step to the next, in seconds."""


class Driver:
    """A run of a machine without its robot.

    Attributes:
        machine: the machine with substitutes for its signals, actions and activities.
        supervisor: its run.
        tick: seconds from one step to the next.
        last: the record of the last step.
        doing: the activities of the active states with their arguments, by the state's full name.
        calls: the actions called in the last ``step`` or ``wait``.
        raised: the events that the machine raised in it.
        sent: the events that it sent to other machines in it.
        script: the values of the signals in the last step.
    """

    def __init__(
        self,
        machine: Machine | Model,
        parameters: Mapping[str, Any] | None = None,
        signals: Mapping[Any, Any] | None = None,
        *,
        tick: float = TICK,
        watch: Callable[[Driver], None] = lambda _: None,
    ) -> None:
        self.machine = scripted_machine(machine)
        self.tick = tick
        self._watch = watch
        self._signals: dict[Any, Any] = dict(signals or {})
        self._failing: frozenset[str] = frozenset()
        self.script = script = self._script()
        self.supervisor = self.machine.start(parameters, facts=script)
        self.doing: dict[str, Performed] = {}
        self.calls: list[Performed] = []
        self.raised: list[str] = []
        self.sent: list[str] = []
        self.last = self.supervisor.step(0.0, (), script)
        self._took(script)

    @property
    def time(self) -> float:
        """Seconds since the start."""
        return self.supervisor.time

    @property
    def configuration(self) -> frozenset[str]:
        """Full names of the active states."""
        return self.supervisor.configuration

    @property
    def variables(self) -> Mapping[str, Any]:
        """Variables and parameters by full name."""
        return self.supervisor.variables

    @property
    def outcome(self) -> str | None:
        """The final state that ended the run, or None."""
        return self.supervisor.outcome

    @property
    def signals(self) -> Mapping[Any, Any]:
        """The signals that have been given a value."""
        return self._signals

    def give(self, signals: Mapping[Any, Any]) -> None:
        """Set signals, by name or by name and arguments; they keep their values until they are set again."""
        self._signals.update(signals)

    def assign(self, variable: str, value: Any) -> None:
        """Set a variable or a parameter, for interactive use; no machine or scenario can do this.

        Raises:
            SnapshotError: the run cannot be changed.
        """
        saved = self.supervisor.snapshot()
        saved["variables"][variable] = value.value if isinstance(value, StrEnum) else value
        self.supervisor = self.machine.restore(saved)

    def fail(self, signals: frozenset[str]) -> None:
        """Make these signals fail from now on, and all others not."""
        self._failing = signals

    def step(
        self,
        signals: Mapping[Any, Any] | None = None,
        reports: Mapping[str, str] | None = None,
        events: Sequence[str] = (),
        *,
        after: float | None = None,
    ) -> Macrostep:
        """Execute one step.

        Args:
            signals: signals that change.
            reports: outcomes of activities, by the full name of their state or by their own name; the machine receives
                them in this step.
            events: events from outside.
            after: seconds since the last step; by default one tick.

        Raises:
            LookupError: an outcome is given for an activity that does not run.
        """
        if reports:
            self._report(reports)
        self.give(signals or {})
        script = self._script()
        self.last = self.supervisor.step(self.time + (self.tick if after is None else after), events, script)
        self._took(script)
        return self.last

    def wait(
        self,
        duration: float,
        signals: Mapping[Any, Any] | None = None,
        reports: Mapping[str, str] | None = None,
        events: Sequence[str] = (),
    ) -> Macrostep:
        """Let time pass, tick by tick, without a change; then execute one step with the changes, as in ``step``."""
        end = self.time + duration
        ticks = math.ceil(duration / self.tick - 1e-6) if self.tick > 0 else 1
        begin, calls, raised, sent = self.time, list[Performed](), list[str](), list[str]()
        for count in range(1, ticks):
            if self.outcome is not None:
                break
            self.step(after=begin + count * self.tick - self.time)
            calls += self.calls
            raised += self.raised
            sent += self.sent
        if self.outcome is None:
            self.step(signals, reports, events, after=max(0.0, end - self.time))
        self.calls[:0] = calls
        self.raised[:0] = raised
        self.sent[:0] = sent
        return self.last

    def perform(self, stimulus: Stimulus) -> None:
        """Execute one step of a scenario, after its wait if it has one; errors as in ``step``."""
        self.fail(stimulus.failing)
        if stimulus.after is None:
            self.step(stimulus.signals, stimulus.reports, stimulus.events)
        else:
            self.wait(stimulus.after, stimulus.signals, stimulus.reports, stimulus.events)

    def running(self, name: str) -> tuple[str, ...]:
        """The active states that have this name, or whose running activity has it."""
        if name in self.doing:
            return (name,)
        return tuple(state for state, performed in self.doing.items() if performed.name == name)

    def stimulated(self, reports: Mapping[str, str]) -> Script:
        """The inputs of a step in which activities end like this, by the full names of their states; nothing runs."""
        script = self._script()
        script.reports = reports
        return script

    def microsteps(self) -> list[tuple[Macrostep, Mapping[str, Any]]]:
        """The last step up to each of its microsteps, with the variables after it."""
        fired = [one for one in self.last.selections if one.plan is not None]
        names = self.machine.generator.variables
        between = [
            {name: value for name, value in zip(names, one.values, strict=True) if value is not None}
            for one in fired[1:]
        ]
        after = [*between, dict(self.variables)] if fired else []
        return [(self.last.begun(count), values) for count, values in enumerate(after, 1)]

    def _report(self, reports: Mapping[str, str]) -> None:
        named: dict[str, str] = {}
        for name, outcome in reports.items():
            states = self.running(name)
            if not states:
                known = ", ".join(f"`{one.name}`" for one in self.doing.values()) or "nothing"
                raise LookupError(f"`{name}` does not run; what runs: {known}")
            named.update(dict.fromkeys(states, outcome))
        self.supervisor.act(self.stimulated(named))

    def _script(self) -> Script:
        return Script(dict(self._signals), failing=self._failing)

    def _took(self, script: Script) -> None:
        effects = () if self.outcome is not None else self.supervisor.act(script)
        self.doing = {state: effect for state, effect in effects if isinstance(effect, Performed)}
        self.calls = script.calls
        self.raised = [one.event for one in self.last.actions if isinstance(one, Raise | Send)]
        self.sent = [str(one) for one in self.last.sent]
        self.script = script
        self._watch(self)

    def value(self, expression: Expression) -> Any:
        """The current value of an expression, with the signals of the last step; ``UNSET`` if it has none."""
        script, supervisor = self.script, self.supervisor

        def ask(call: SignalValue) -> Any:
            return script.read(call.signal, tuple(evaluation.value(one) for one in call.arguments))

        active = frozenset(self.machine.indices[name] for name in self.configuration)
        values = [supervisor.variables.get(name) for name in self.machine.generator.variables]
        evaluation = self.machine.generator.evaluation({}, values, active, ask)
        try:
            return evaluation.value(expression)
        except (TypeError, ArithmeticError, ScriptedFault):
            return UNSET
