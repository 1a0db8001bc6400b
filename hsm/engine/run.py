"""One run of a machine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import inf
from types import MappingProxyType
from typing import Any, Generic

from hsm.engine.compiled import CompiledChart
from hsm.engine.coverage import Collector, Coverage
from hsm.engine.execution import MacrostepExecution
from hsm.engine.inputs import checked_time, parameter_values
from hsm.engine.looks import Interrupted, SlowPath
from hsm.engine.macrostep import Macrostep
from hsm.engine.occurrences import checked_events
from hsm.engine.run_state import PendingFault, RunState, fault_event
from hsm.engine.snapshots import SavedRun, carry_over, to_json
from hsm.model.chart import ActivityCall
from hsm.model.events import StateEvent
from hsm.model.messages import OutsideInput
from hsm.model.registry import Activity, E, F, Outcome, stop_activity
from hsm.model.unparse import activity_text

_FINISHED: Any = object()


def _same(one: ActivityCall | None, other: ActivityCall | None) -> bool:
    """Whether two states do the same, wherever that is written."""
    return one is not None and other is not None and activity_text(one) == activity_text(other)


class Supervisor(Generic[F, E]):
    """A running machine: its configuration, variables, time-outs, history and activities.

    Made by ``Machine.start`` or ``Machine.restore``.

    Attributes:
        machine: the chart that is run.
        initial: the macrostep that entered the initial configuration; None for a run that was restored.
    """

    def __init__(self, machine: CompiledChart, run: SavedRun) -> None:
        self.machine = machine
        self.initial: Macrostep | None = None
        self._running: dict[int, Activity[F, E]] = {}
        self._arguments: Mapping[str, Sequence[Any]] = MappingProxyType({})
        self._resume(machine, run)

    @classmethod
    def begin(cls, machine: CompiledChart, parameters: Sequence[Any], facts: F | None, time: float) -> Supervisor[F, E]:
        """Enter the initial configuration; see ``Machine.start``."""
        plan = machine.planner.start()
        values = machine.generator.first_values(parameters)
        nowhere = RunState(plan.target, values, {}, (), {}, None)
        supervisor = cls(machine, SavedRun(time, nowhere, (), frozenset()))
        memo: dict[Any, Any] = {}
        execution = MacrostepExecution(machine, nowhere, time, facts=facts, memo=memo, hits=supervisor._hits)
        execution.start(plan)
        supervisor.initial = supervisor._adopt(execution, time)
        return supervisor

    def _resume(self, machine: CompiledChart, run: SavedRun) -> None:
        """Continue from where a run is."""
        self.machine = machine
        self._time = run.time
        self._state = run.state
        self._pending = list(run.pending)
        self._running.update((state, _FINISHED) for state in run.finished)
        self._collector = Collector()
        self._hits = self._collector.hits
        self._leaves = self._collector.leaves
        self._named: tuple[Sequence[Any], Mapping[str, Any]] | None = None
        self._set_wake()

    # The public state of a run.

    @property
    def time(self) -> float:
        """The logical time of the last step in seconds."""
        return self._time

    @property
    def configuration(self) -> frozenset[str]:
        """Full names of all active states, including compound ones but not the root."""
        return self._state.configuration.names

    @property
    def outcome(self) -> str | None:
        """The name of the top-level final state that ended the run; None while it runs."""
        return self._state.outcome

    @property
    def due(self) -> float:
        """When the run continues by itself: the first deadline of a time-out or of a delayed event, in seconds.

        Infinite if nothing happens without an event, an outcome or a change of a signal.
        """
        return -inf if self._pending else self._state.wake

    @property
    def variables(self) -> Mapping[str, Any]:
        """The values of variables and parameters by their full names; states never entered have none."""
        values = self._state.values
        if self._named is None or self._named[0] is not values:  # a step that sets variables makes a new list of them
            named = zip(self.machine.generator.variables, values, strict=True)
            self._named = values, MappingProxyType({name: value for name, value in named if value is not None})
        return self._named[1]

    @property
    def moment(self) -> tuple[Sequence[Any], frozenset[int]]:
        """The arguments of generated functions: values by slot, and active states by index, with the root."""
        return self._state.values, self._state.configuration.active

    @property
    def arguments(self) -> Mapping[str, Sequence[Any]]:
        """The arguments of the running activities, by the full names of their states; replaced, never changed."""
        return self._arguments

    @property
    def coverage(self) -> Coverage:
        """The coverage of this run so far."""
        return self._collector.coverage()

    # Steps.

    def step(self, time: float, events: Sequence[OutsideInput] = (), facts: F | None = None) -> Macrostep:
        """Execute one macrostep: the machine reacts to its inputs.

        The step handles the outcomes of activities and the given events, one after the other, then due time-outs, then
        conditions until none fires.

        Args:
            time: logical time in seconds; it never runs backwards.
            events: events from outside, in the order in which they happened: names, texts with data such as
                ``floor(number = 3)``, or ``Occurrence``. New values for adjustable parameters are among them, as texts
                such as ``cruise = 0.3 m/s`` or as ``Adjustment``.
            facts: the argument of the signals and actions in this step.

        Returns:
            The record of the step.

        Raises:
            MachineFault: something failed and the machine does not handle it, or its transitions repeat without end;
                the machine is in the state before the step.
            ValueError: the time is before that of the last step, infinite or NaN; an event is not declared, or its data
                differs from its declaration; or a parameter cannot be adjusted to a value.
            TypeError: the time is not a number, the events are not a list of events, or one carries a value of another
                type.
        """
        # A step that only moves runs a few generated functions, in a twentieth of the time of the full path with its
        # queues and its copy of the state. In every other case the step runs in full, with the signals that were
        # evaluated; nothing was changed before. A property test compares the two.
        state = self._state
        values = state.values
        leaf = state.configuration.root
        found = leaf.found
        try:
            if time.__class__ is not float:
                time = checked_time(time, self._time)
            if not self._time <= time < self._wake:
                raise SlowPath
            if events:
                if events.__class__ is not list and events.__class__ is not tuple:
                    raise SlowPath
                for event in events:
                    look = leaf.events.get(event)
                    found = (leaf.event(event) if look is None else look)(facts, values, found)
                    leaf = found[0]
                    while leaf.rest is not None:
                        found = leaf.advance(facts, values, found)
                        leaf = found[0]
            while (go := leaf.go) is not None:
                found = go(facts, values, found)
                leaf = found[0]
        except Interrupted as stop:
            return self._react(time, events, facts, leaf.interrupted(found, values, stop.args[0]), stop.__cause__)
        except (SlowPath, TypeError):  # TypeError: a time or events of the wrong kind, which the full path reports
            return self._react(time, events, facts, leaf.memo(found, values))
        try:
            self._leaves[leaf] += 1
        except KeyError:
            self._collector.first(leaf)
        state.configuration = leaf.after
        self._time = time
        step = Macrostep()
        step.raw = (time, found, values, state.timers)
        return step

    def _react(
        self,
        time: float,
        events: Sequence[OutsideInput],
        facts: object,
        memo: dict[Any, Any],
        error: BaseException | None = None,
    ) -> Macrostep:
        """A step in full; when it fails, nothing was changed."""
        time = checked_time(time, self._time)
        heard = checked_events(self.machine.model, events)
        execution = MacrostepExecution(self.machine, self._state, time, facts=facts, memo=memo, hits=self._hits)
        execution.run((*self._pending, *heard), error)
        self._pending = []
        return self._adopt(execution, time)

    def _adopt(self, execution: MacrostepExecution, time: float) -> Macrostep:
        """Adopt the result of a step as the state of the run."""
        self._time = time
        self._state = state = execution.state
        self._set_wake()
        self._collector.count([one.plan for one in execution.selections])
        self._stop(execution.stopped if state.outcome is None else self._running)
        return execution.macrostep()

    def _set_wake(self) -> None:
        """The time from which a step must also check time-outs."""
        state = self._state
        watched = state.configuration.always is not None or state.configuration.held or state.store is not None
        always = self._pending or watched or state.deferred or state.outcome is not None
        self._wake = -inf if always else state.wake

    # Saving, restoring, changing.

    def snapshot(self) -> dict[str, Any]:
        """The state of the run as JSON values; ``Machine.restore`` continues from it with the same trace.

        It does not contain activities: they begin again.
        """
        return to_json(self.machine, self._run())

    def reload(self, machine: CompiledChart) -> None:
        """Continue with a changed machine.

        Variables, time-outs and history are kept if the new machine still has them; an activity continues if its state
        still has the same one. Coverage starts again.

        Args:
            machine: the changed machine.

        Raises:
            SnapshotError: an active state is gone, with the reason; the run continues with the old machine.
        """
        given = {name: value for name, value in self.variables.items() if name in self._parameter_names(machine)}
        run = carry_over(self.machine, self._run(), machine, parameter_values(machine.model, given))
        old = self.machine.model.states
        doing = {old[index].name: (activity, old[index].activity) for index, activity in self._running.items()}
        self._running = {}
        new = machine.model.states
        for index in run.state.configuration.activities:
            activity, call = doing.pop(new[index].name, (None, None))
            if activity is not None and _same(call, new[index].activity):
                self._running[index] = activity
            else:
                stop_activity(activity)
        for activity, _ in doing.values():
            stop_activity(activity)
        finished = frozenset(index for index, activity in self._running.items() if activity is _FINISHED)
        self._resume(machine, replace(run, finished=finished))

    def _parameter_names(self, machine: CompiledChart) -> set[str]:
        own = {parameter.name: parameter.type for parameter in self.machine.model.parameters}
        return {one.name for one in machine.model.parameters if own.get(one.name) == one.type}

    def _run(self) -> SavedRun:
        finished = frozenset(state for state, activity in self._running.items() if activity is _FINISHED)
        return SavedRun(self._time, self._state, tuple(self._pending), finished)

    # Activities.

    def act(self, facts: F) -> Sequence[tuple[str, E]]:
        """Tick the running activities, in document order.

        An outcome is kept for the next step; an activity that has ended is not ticked again.

        Args:
            facts: the argument of the activities.

        Returns:
            The name of the state and the effect, for each activity that returned one.

        Raises:
            MachineFault: an activity failed and no transition in its scope handles a fault.
        """
        effects: list[tuple[str, E]] = []
        for state in self._state.configuration.activities:
            activity = self._running.get(state)
            if activity is _FINISHED or self._state.outcome is not None:
                continue
            try:
                if activity is None:
                    activity = self._running[state] = self._begin(state, facts)
                effect = activity.tick(facts)
            except Exception as error:
                self._activity_failed(state, error)
                continue
            if isinstance(effect, Outcome):
                self._running[state] = _FINISHED
                self._collector.outcomes[state, effect.name] += 1
                self._postpone(StateEvent((effect.name,), state, f"done.invoke.{self._name(state)}"))
            elif effect is not None:
                effects.append((self._name(state), effect))
        return effects

    def stop(self) -> None:
        """Stop all activities: the caller ends the run."""
        self._stop(self._running)

    def _begin(self, state: int, facts: F) -> Activity[F, E]:
        call = self.machine.model.states[state].activity
        assert call is not None, "only states with an activity are begun"
        arguments = self.machine.generator.arguments(call.arguments)
        values = arguments(facts, {}, self._state.values, self._state.configuration.active)
        self._arguments = MappingProxyType({**self._arguments, self._name(state): tuple(values)})
        return call.activity.factory(*values)

    def _activity_failed(self, state: int, error: Exception) -> None:
        self._running[state] = _FINISHED
        fault = self._fault_of(state, error)
        if self._state.configuration.on(fault.event) is None:
            raise fault.unhandled(self.machine)
        self._postpone(fault)

    def _postpone(self, entry: StateEvent | PendingFault) -> None:
        self._pending.append(entry)
        self._set_wake()

    def _stop(self, states: Sequence[int] | Mapping[int, Activity[F, E]]) -> None:
        """Stop activities; a fault in one of them is handled in the next step, like a fault in a tick."""
        for state in tuple(states):
            activity = self._running.pop(state, None)
            try:
                stop_activity(activity)
            except Exception as error:
                self._postpone(self._fault_of(state, error))

    def _fault_of(self, state: int, error: Exception) -> PendingFault:
        call = self.machine.model.states[state].activity
        assert call is not None, "only states with an activity fail in one"
        return PendingFault(fault_event(state), f"activity `{call.activity.name}` failed: {error!r}", call.place, error)

    def _name(self, state: int) -> str:
        return self.machine.model.states[state].name
