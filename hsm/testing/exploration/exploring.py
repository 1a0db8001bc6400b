"""All runs of a machine up to a bound: signals, outcomes, events and waiting times are free.

A step takes no time here, only waiting does: from each moment the machine is stepped immediately, one tick before the
next deadline, and at the deadline. A signal gets a value when a guard first uses it, so only relevant values are tried.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import field
from functools import partial
from itertools import islice, product
from math import prod
from typing import Any

from hsm.engine.clock import nanoseconds, seconds
from hsm.engine.configuration import Plan
from hsm.engine.coverage import guards_of
from hsm.engine.evaluation import Evaluation
from hsm.engine.execution import MacrostepExecution
from hsm.engine.inputs import settled
from hsm.engine.machine import Machine
from hsm.engine.occurrences import checked_events, event_text
from hsm.engine.record import Selection
from hsm.engine.run_state import PendingFault, RunState, fault_event
from hsm.model.chart import Assign, Emit, Model, On, State, StateKind, Transition
from hsm.model.events import StateEvent
from hsm.model.expressions import Binary, EventValue, Expression, SignalValue, VariableValue
from hsm.model.faults import MachineFault
from hsm.model.messages import Occurrence
from hsm.model.registry import ActionDeclaration, SignalDeclaration
from hsm.model.rewriting import actions_of, expressions_of, parts_of, rewrite_expression
from hsm.model.values import dataclass
from hsm.testing.exploration.domains import Domains
from hsm.testing.scenarios.driver import TICK
from hsm.testing.scenarios.inputs import NO_WAIT, Input, Wait
from hsm.testing.scenarios.script import FAULT, ScriptedFault, SignalKey

_DIGITS = 6
_MOST_DATA = 64
"""At most this many combinations of an event's data are tried."""


def _coarse(nanoseconds: int) -> float:
    """Time to go in seconds, without the digits in which sums of waiting times differ."""
    return round(seconds(nanoseconds), _DIGITS)


def _carried(message: object) -> tuple[Any, ...]:
    return tuple(message.data.items()) if isinstance(message, Occurrence) else ()


@dataclass(frozen=True, slots=True)
class ExploredMoment:
    """The state of a run between two steps.

    Attributes:
        state: the configuration, variables, time-outs, history.
        time: seconds since the start.
        over: states whose activity has ended, by index.
        signals: the last known value of each signal; they only influence what is tried first.
    """

    state: RunState
    time: float
    over: frozenset[int]
    signals: Mapping[SignalKey, Any]

    def key(self) -> tuple[Any, ...]:
        """The key of this moment; moments with equal keys have the same future."""
        state, now = self.state, nanoseconds(self.time)
        return (
            state.configuration.leaves,
            tuple(round(one, _DIGITS) if isinstance(one, float) else one for one in state.values),
            tuple(sorted((index, _coarse(due - now)) for index, due in state.timers.items())),
            tuple((_coarse(due - now), send.event, _carried(send.message)) for due, send in state.sent),
            tuple(sorted(state.history.items())),
            state.acted,
            tuple((str(one), _carried(one)) for one in state.deferred),
            self.over,
        )


@dataclass(frozen=True, slots=True)
class ExploredStep:
    """One step from a moment to another.

    Attributes:
        input: what happened.
        target: where it led.
        selections: the selections of the step.
        paths: the paths through guards that were seen, by transition.
        fault: why the step failed; the target is then the source.
    """

    input: Input
    target: ExploredMoment
    selections: tuple[Selection, ...]
    paths: Mapping[int, frozenset[int]]
    fault: str | None = None

    @property
    def plans(self) -> Iterator[Plan]:
        """The microsteps, in order."""
        return (one.plan for one in self.selections if one.plan is not None)

    @property
    def transitions(self) -> Iterator[int]:
        """The transitions taken, by index."""
        return (index for plan in self.plans for index in plan.transitions)

    @property
    def entered(self) -> Iterator[int]:
        """The states entered, by index."""
        return (index for plan in self.plans for index in plan.entered)

    @property
    def exited(self) -> Iterator[int]:
        """The states left, by index."""
        return (index for plan in self.plans for index in plan.exited)

    @property
    def restored(self) -> Iterator[tuple[int, bool]]:
        """The history states entered, each with whether it remembered something."""
        return (one for plan in self.plans for one in plan.restored)


class AskingRegions:
    """Which region of a parallel machine uses a signal: in one step only the signals of one region change.

    Simultaneous changes in two regions are left out; they are found as successive steps. Uses while no region is active
    do not count.

    Args:
        machine: whose regions they are: those of its outermost parallel state.
        only: the one region in which anything happens but time-outs, by number; None for all.
    """

    def __init__(self, machine: Machine, only: int | None = None) -> None:
        model = machine.model
        outer = next((state for state in model.states if state.kind is StateKind.PARALLEL), None)
        self._regions = [model.states[child] for child in outer.children] if outer is not None else []
        self.only = None if only is None else self._regions[only].index
        asked: dict[str, set[int]] = {}
        for transition in model.transitions:
            if outer is not None and _apart(model.states[transition.source], outer):
                continue
            region = self.of_state(transition.source)
            for condition in machine.generator.decision(transition.index).conditions:
                for part in parts_of(condition):
                    if isinstance(part, SignalValue):
                        asked.setdefault(part.signal.name, set()).add(region)
        self._of_signal = {name: regions.pop() for name, regions in asked.items() if len(regions) == 1}

    def __len__(self) -> int:
        return len(self._regions)

    def of_state(self, state: int) -> int:
        """The region that a state lies in, by index; -1 for none."""
        return next((one.index for one in self._regions if state in one.subtree), -1)

    def of_signal(self, name: str) -> int:
        """The only region that uses a signal; -1 for none or several."""
        return self._of_signal.get(name, -1)


def _apart(state: State, other: State) -> bool:
    """Whether neither of two states contains the other: such a pair is active only in an outermost parallel state."""
    return state.last < other.index or other.last < state.index


_NONE = -2
"""A region number that means: no signal changes."""


@dataclass(slots=True)
class _Choices:
    """The facts of one attempt at a step: values that were chosen before, and new ones.

    Attributes:
        explorer: provides the values worth trying.
        known: the last values of the signals.
        chosen: the values in this step.
        region: the one region whose signals change; -1 for any.
        opened: further attempts to make.
        execution: the step.
    """

    explorer: Explorer
    known: Mapping[SignalKey, Any]
    chosen: dict[SignalKey, Any]
    region: int
    opened: list[tuple[dict[SignalKey, Any], int]] = field(default_factory=list)
    execution: MacrostepExecution | None = None

    def read(self, signal: SignalDeclaration, arguments: tuple[Any, ...]) -> Any:
        """The value of a signal: as chosen before, or the first one worth trying."""
        key = (signal.name, arguments)
        if key not in self.chosen:
            others = self.explorer.values(signal, key, self)
            first = self.known.get(key, others[0])
            own = self.explorer.region_of(signal)
            if self.region == -1 or own in (-1, self.region):
                region = own if self.region == -1 else self.region
                self.opened += [({**self.chosen, key: one}, region) for one in others if one != first]
            self.chosen[key] = first
        value = self.chosen[key]
        if value is FAULT:
            raise ScriptedFault(f"signal `{signal.name}` is to fail")
        return value

    def call(self, action: ActionDeclaration, arguments: tuple[Any, ...]) -> None:
        """Does nothing: actions are irrelevant here."""

    def report(self, state: str) -> str | None:
        """Nothing: outcomes reach the step as events."""


class Explorer:
    """Computes the possible steps from a moment.

    Args:
        machine: the machine, scripted.
        parameters: its parameters, in SI units.
        tick: seconds before a deadline at which the machine is also stepped.
        regions: leaves out steps with changes in more than one region; by default no step is left out.

    Attributes:
        machine: as given.
        parameters: the values of all its parameters, in their order.
        all_data: whether every combination of an event's data that is worth trying was tried.
    """

    def __init__(
        self,
        machine: Machine,
        parameters: Mapping[str, Any] | None = None,
        *,
        tick: float = TICK,
        regions: AskingRegions | None = None,
    ) -> None:
        self.machine = machine
        self._tick = tick
        self._domains = Domains([*expressions_of(machine.model), *_by_way_of_variables(machine.model)])
        unknown = {one.name: None for one in machine.model.parameters if one.required}
        self.parameters = tuple(settled(machine.model, {**unknown, **(parameters or {})}).values())
        self._heard = _events(machine)
        self._regions = regions
        self._tried: dict[tuple[Any, ...], list[Any]] = {}
        self.all_data = True

    # Where runs begin and continue.

    def start(self) -> list[ExploredStep]:
        """All first steps: entering the machine and its first step at the same time."""
        plan = self.machine.planner.start()
        state = RunState(plan.target, self.machine.generator.first_values(self.parameters), {}, (), {}, None)
        before = ExploredMoment(state, 0.0, frozenset(), {})

        def attempt(choices: _Choices, hits: set[tuple[int, int]]) -> tuple[RunState, list[Selection]]:
            execution = choices.execution = MacrostepExecution(
                self.machine, state, 0.0, facts=choices, memo={}, hits=hits
            )
            execution.start(plan)
            if execution.state.outcome is not None:
                return execution.state, execution.selections
            first = MacrostepExecution(self.machine, execution.state, 0.0, facts=choices, memo={}, hits=hits)
            choices.execution = first
            first.run(())
            return first.state, [*execution.selections, *first.selections]

        return list(self._edges(before, Input(), attempt, -1))

    def successors(self, moment: ExploredMoment) -> Iterator[ExploredStep]:
        """All steps from a moment; none where the machine has ended."""
        if moment.state.outcome is not None:
            return
        for wait, reports, events in self._inputs(moment):
            region = -1
            if self._regions is not None:
                changing = {self._regions.of_state(self.machine.indices[state]) for state, _ in reports}
                region = _NONE if wait.early else next(iter(changing), -1)
                if self._regions.only is not None and region != _NONE:
                    if region not in (-1, self._regions.only):
                        continue
                    region = self._regions.only
            yield from self._steps(moment, Input(wait, reports, events), region)

    def continued(self, moment: ExploredMoment, given: Input) -> Iterator[ExploredStep]:
        """All steps from a moment with a given input; the other signals are free."""
        return self._steps(moment, given, -1)

    def _steps(self, moment: ExploredMoment, given: Input, region: int) -> Iterator[ExploredStep]:
        pending = [self._outcome(state, outcome) for state, outcome in given.reports]
        over = moment.over | {self.machine.indices[state] for state, _ in given.reports}
        time = moment.time + given.wait.seconds
        before = ExploredMoment(moment.state, time, over, moment.signals)

        def attempt(choices: _Choices, hits: set[tuple[int, int]]) -> tuple[RunState, list[Selection]]:
            execution = MacrostepExecution(self.machine, moment.state, time, facts=choices, memo={}, hits=hits)
            choices.execution = execution
            execution.run((*pending, *checked_events(self.machine.model, given.events)))
            return execution.state, execution.selections

        return self._edges(before, given, attempt, region)

    def _edges(
        self,
        before: ExploredMoment,
        given: Input,
        attempt: Callable[[_Choices, set[tuple[int, int]]], tuple[RunState, list[Selection]]],
        region: int,
    ) -> Iterator[ExploredStep]:
        """One step for each combination of the signals that are used."""
        open_choices: list[tuple[dict[SignalKey, Any], int]] = [(dict(given.signals), region)]
        while open_choices:
            choices = _Choices(self, before.signals, *open_choices.pop())
            hits: set[tuple[int, int]] = set()
            selections: list[Selection] = []
            state, fault = before.state, None
            try:
                state, selections = attempt(choices, hits)
            except MachineFault as error:
                fault = str(error)
            plans = [one.plan for one in selections if one.plan is not None]
            over = before.over.difference(*((*plan.exited, *plan.entered) for plan in plans))
            open_choices += reversed(choices.opened)
            signals = tuple(choices.chosen.items())
            target = ExploredMoment(state, before.time, over, {**before.signals, **choices.chosen})
            taken = Input(given.wait, given.reports, given.events, signals)
            yield ExploredStep(taken, target, tuple(selections), guards_of(hits), fault)

    # What may happen.

    def _inputs(self, moment: ExploredMoment) -> Iterator[tuple[Wait, tuple[tuple[str, str], ...], tuple[str, ...]]]:
        running = [one for one in moment.state.configuration.activities if one not in moment.over]
        endings: list[list[tuple[str, str] | None]] = [[None, *self._endings(moment, state)] for state in running]
        together = [tuple(one for one in chosen if one is not None) for chosen in product(*endings)]
        events = self._events_heard(moment)
        for wait in self._waits(moment):
            if wait.early and self._regions is not None:
                yield wait, (), ()
                continue
            for reports in sorted(together, key=len):
                if self._regions is None or len(reports) < 2:
                    yield wait, reports, ()
            for event in events:
                yield wait, (), (event,)

    def _endings(self, moment: ExploredMoment, state: int) -> Iterator[tuple[str, str]]:
        """The possible outcomes of a state's activity; a failure only if the machine handles it."""
        declared = self.machine.model.states[state]
        assert declared.activity is not None, "only states with an activity have outcomes"
        for outcome in declared.activity.activity.outcomes:
            yield declared.name, outcome
        if moment.state.configuration.on(fault_event(state)) is not None:
            yield declared.name, FAULT

    def _waits(self, moment: ExploredMoment) -> list[Wait]:
        """At once, a tick before the next deadline, at the next deadline; a tick later where an event is on its way."""
        deadlines = [seconds(due) for due in (*moment.state.timers.values(), *(due for due, _ in moment.state.sent))]
        ahead = [due - moment.time for due in deadlines if due > moment.time + 1e-9]
        if not ahead:
            return [NO_WAIT]
        soonest = min(ahead)
        if soonest > self._tick and any(due <= nanoseconds(moment.time) for due, _ in moment.state.sent):
            return [NO_WAIT, Wait(self._tick)]
        before = round(soonest - self._tick, 9)
        early = [Wait(before, early=True)] if before > 0 else []
        return [NO_WAIT, *early, Wait(round(soonest, 9))]

    def _events_heard(self, moment: ExploredMoment) -> list[str]:
        active = moment.state.configuration.active
        found: dict[str, None] = {}
        for state in sorted(active):
            for index in self.machine.model.states[state].transitions:
                found.update(dict.fromkeys(self._heard.get(index, ())))
        return [text for name in found for text in self._with_data(name, moment.state)]

    def _with_data(self, event: str, state: RunState) -> Iterator[str]:
        """An event with all data values worth trying."""
        model = self.machine.model
        declared = model.data_of(event)
        if declared is None:
            yield event
            return
        tried: list[list[Any]] = []
        for one in declared.fields:
            name = declared.variable(one)
            tried.append(self._domains.carried(name, one, partial(self._difference, state, name)))
        self.all_data = self.all_data and prod(map(len, tried)) <= _MOST_DATA
        for values in islice(product(*tried), _MOST_DATA):
            given = {one.name: value for one, value in zip(declared.fields, values, strict=True)}
            yield event_text(model, Occurrence(event, given))

    def _difference(self, state: RunState, name: str, comparison: Binary, value: float) -> float | None:
        """Left side minus right side of a comparison when an event carries a value."""
        values = state.values[:]
        values[self.machine.generator.variables[name]] = value

        def ask(_: SignalValue) -> Any:
            raise KeyError

        evaluation = self.machine.generator.evaluation({}, values, state.configuration.active, ask)
        try:
            return float(evaluation.value(comparison.left) - evaluation.value(comparison.right))
        except (KeyError, TypeError, ArithmeticError):
            return None

    def _outcome(self, state: str, outcome: str) -> StateEvent | PendingFault:
        index = self.machine.indices[state]
        if outcome == FAULT:
            call = self.machine.model.states[index].activity
            name = call.activity.name if call is not None else state
            error = ScriptedFault(f"activity `{name}` is to fail")
            return PendingFault(fault_event(index), str(error), call.place if call is not None else None, error)
        return StateEvent((outcome,), index, f"done.invoke.{state}")

    def region_of(self, signal: SignalDeclaration) -> int:
        """The region that uses a signal; -1 if that does not matter."""
        return self._regions.of_signal(signal.name) if self._regions is not None else -1

    def values(self, signal: SignalDeclaration, key: SignalKey, choices: _Choices) -> list[Any]:
        """The values to try for a signal, with the current variables and other signals."""
        execution = choices.execution
        assert execution is not None, "signals are used only in a step"
        state = execution.state
        variables, signals = self._domains.depends(signal)
        slots = self.machine.generator.variables
        others = tuple((one, value) for one, value in choices.chosen.items() if one[0] in signals)
        situation = (key, tuple(state.values[slots[name]] for name in sorted(variables)), others)
        if situation not in self._tried:
            self._tried[situation] = self._worth_trying(signal, key, state, choices)
        return self._tried[situation]

    def _worth_trying(self, signal: SignalDeclaration, key: SignalKey, state: RunState, choices: _Choices) -> list[Any]:
        def residue(comparison: Binary, value: float) -> float | None:
            def ask(call: SignalValue) -> Any:
                asked = (call.signal.name, tuple(evaluation.value(one) for one in call.arguments))
                if asked == key:
                    return value
                return choices.chosen[asked]

            evaluation: Evaluation = self.machine.generator.evaluation(
                {}, state.values, state.configuration.active, ask
            )
            try:
                return float(evaluation.value(comparison.left) - evaluation.value(comparison.right))
            except (KeyError, TypeError, ArithmeticError):
                return None

        return self._domains.values(signal, residue)


def _by_way_of_variables(model: Model) -> Iterator[Expression]:
    """Conditions on variables that receive event data, as conditions on the data."""
    given = [one for one in actions_of(model) if isinstance(one, Assign) and isinstance(one.value, EventValue)]
    for one in {(assigned.variable, assigned.value): assigned for assigned in given}.values():
        variable, value = one.variable, one.value

        def put(part: Expression, variable: str = variable, value: Expression = value) -> Expression:
            return value if isinstance(part, VariableValue) and part.name == variable else part

        yield from (rewrite_expression(condition, put) for condition in expressions_of(model))


def _events(machine: Machine) -> dict[int, tuple[str, ...]]:
    """The events from outside that each transition waits for.

    What is declared may come from outside although the machine raises it, too; not what one member sends to another.
    Where nothing is declared, the outcomes and completions of the machine's own states are left out.
    """
    model = machine.model
    own = {name for one in actions_of(model) if isinstance(one, Emit) for name in one.receivers}
    if model.events is None:
        own |= {"done", "fault"}
        for state in model.states:
            if state.activity is not None:
                own.update(state.activity.activity.outcomes)
            own.update(model.states[child].own_name for child in state.children)

    def names(transition: Transition) -> tuple[str, ...]:
        if not isinstance(transition.trigger, On) or transition.trigger.prefix:
            return ()
        named = transition.trigger.names
        known = sorted(model.events or ())
        patterns = [one.removesuffix("*") for one in named if one.endswith("*")]
        named = (*named, *(one for one in known if any(map(one.startswith, patterns))))
        return tuple(
            one
            for one in dict.fromkeys(named)
            if "*" not in one and one not in own and (one in known or model.events is None)
        )

    return {one.index: names(one) for one in model.transitions if names(one)}
