"""From the inputs of an exploration to a readable scenario."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import field
from typing import Any

from hsm.engine.explanation import Verdict
from hsm.engine.machine import Machine
from hsm.model.expressions import Binary, Literal, Unary, VariableValue
from hsm.model.faults import MachineFault
from hsm.model.topology import HISTORY
from hsm.model.types import BOOLEAN, Type
from hsm.model.values import dataclass
from hsm.testing.scenarios.driver import TICK, Driver
from hsm.testing.scenarios.inputs import Input
from hsm.testing.scenarios.scenarios import ConditionHolds, Expectation, ExpectationClause, Scenario, Stimulus, close
from hsm.testing.scenarios.script import SignalKey
from hsm.testing.scenarios.writing import Writer


@dataclass(frozen=True, slots=True)
class Replay:
    """A run reported as a scenario.

    Attributes:
        scenario: the inputs and the expectations.
        fault: why the run could not go on, or None.
    """

    scenario: Scenario
    fault: str | None


def replay(
    name: str,
    machine: Machine,
    inputs: Sequence[Input],
    writer: Writer,
    *,
    tick: float = TICK,
    watch: Callable[[Driver], None] = lambda _: None,
    stop: Sequence[object] = (),
) -> Replay:
    """Run the machine through some inputs and record the results.

    A step that takes no time in an exploration takes a tick here; waits for a deadline end at that deadline.

    Args:
        name: title of the scenario.
        machine: the machine, scripted.
        inputs: the first one is the start.
        writer: words the claims.
        tick: seconds from one step to the next.
        watch: called after each step.
        stop: the run ends as soon as there is something in it.
    """
    given = _changes(inputs[0], {})
    steps: list[Stimulus | Expectation] = []
    fault = None
    try:
        driver = Driver(machine, None, given, tick=tick, watch=watch)
        recorder = ScenarioRecorder(machine, driver, writer, steps)
        recorder.expect()
        for one in inputs[1:]:
            if driver.outcome is not None or stop:
                break
            recorder.act(one)
    except MachineFault as error:
        fault = str(error)
    except _Diverged:
        fault = "the run has another result if each step takes a tick"
    return Replay(Scenario(name, given=given, steps=tuple(steps)), fault)


class _Diverged(Exception):  # noqa: N818 - not an error
    """The step of the exploration is not possible here: a time-out came first."""


@dataclass(slots=True)
class ScenarioRecorder:
    """Records a run as a scenario while it runs.

    Attributes:
        machine: the machine, scripted.
        driver: its run.
        writer: words the claims.
        steps: what was taken down.
        seen: the last value of each variable.
        doing: what was being done after the last step.
        about: the states that are recorded, by index; None for all.
    """

    machine: Machine
    driver: Driver
    writer: Writer
    steps: list[Stimulus | Expectation]
    seen: dict[str, Any] = field(default_factory=dict)
    doing: dict[str, Any] = field(default_factory=dict)
    about: Collection[int] | None = None

    def act(self, one: Input) -> None:
        """Execute one input, and record the expectations."""
        if any(state not in self.driver.doing for state, _ in one.reports):
            raise _Diverged
        reports = {self.subject(state): outcome for state, outcome in one.reports}
        rest = self._waiting(one)
        if rest > self.driver.tick + 1e-9:
            early = round(rest - self.driver.tick, 9)
            self.steps.append(Stimulus(early))
            self.driver.wait(early)
            self.expect()
            if self.driver.outcome is not None or not all(self.driver.running(name) for name in reports):
                raise _Diverged
        changes = _changes(one, self.driver.signals)
        plain = not (reports or one.events or changes)
        after = self.driver.tick if plain else None
        step = Stimulus(after, changes, reports, events=one.events)
        self.steps.append(step)
        self.driver.step(changes, reports, one.events)
        self.expect()

    def _waiting(self, one: Input) -> float:
        """How long this run must wait for the same deadline as the exploration."""
        if one.wait.seconds == 0:
            return self.driver.tick
        left = [item.remaining for item in self.driver.last.considered if item.verdict is Verdict.NOT_DUE]
        soonest = min((item for item in left if item is not None), default=one.wait.seconds)
        if one.wait.early:
            return round(max(soonest - self.driver.tick, self.driver.tick), 9)
        return round(soonest, 9)

    def subject(self, state: str) -> str:
        """The name of an activity that ends: its own name if only one of that name runs."""
        name = self.driver.doing[state].name
        return name if self.driver.running(name) == (state,) else state

    def expect(self) -> None:
        """Record new expectations."""
        model = self.machine.model
        claims: list[ExpectationClause] = []
        leaves = [
            state.name
            for state in model.states[1:]
            if state.name in self.driver.configuration
            and not any(model.states[child].name in self.driver.configuration for child in state.children)
            and state.kind not in HISTORY
            and (self.about is None or state.index in self.about)
        ]
        claims += map(self.writer.in_state, leaves)
        for state, performed in self.driver.doing.items():
            if self.about is not None and self.machine.indices[state] not in self.about:
                continue
            if self.doing.get(state) != performed or state in self.driver.last.entered:
                claims.append(self.writer.performs(performed.name, performed.arguments, action=False))
        self.doing = dict(self.driver.doing)
        for call in self.driver.calls:
            claim = self.writer.performs(call.name, call.arguments, action=True)
            if claim not in claims:
                claims.append(claim)
        claims += map(self.writer.raises, dict.fromkeys(self.driver.raised))
        claims += map(self.writer.sends, dict.fromkeys(self.driver.sent))
        for variable in model.variables:
            value = self.driver.variables.get(variable.name)
            known = self.seen.get(variable.name)
            if value is None or variable.constant or (known is not None and close(value, known)):
                continue
            self.seen[variable.name] = value
            text = self.writer.value(variable.name, value, variable.type)
            claims.append(ExpectationClause(ConditionHolds(_is(variable.name, value, variable.type)), text))
        self.steps.append(Expectation(tuple(claims)))


def _is(name: str, value: Any, kind: Type) -> Any:
    variable = VariableValue(name, kind)
    if kind == BOOLEAN:
        return variable if value else Unary("not", variable, BOOLEAN)
    return Binary("==", variable, Literal(value, kind), BOOLEAN)


def _changes(one: Input, known: Mapping[Any, Any]) -> dict[str | SignalKey, Any]:
    """The signals that differ from what they were, or from their default where they were never given."""
    found: dict[str | SignalKey, Any] = {}
    for (name, arguments), value in one.signals:
        key: str | SignalKey = (name, arguments) if arguments else name
        if key in known:
            if known[key] != value:
                found[key] = value
        elif not isinstance(value, bool | int | float) or value:  # false and zero are what is read anyway
            found[key] = value
    return found
