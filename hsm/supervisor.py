"""One run of a machine."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import inf
from types import MappingProxyType
from typing import Any

from hsm.codegen import NONE, Block
from hsm.configuration import CACHE, Picked, Selector
from hsm.coverage import Coverage
from hsm.diagnostics import Place
from hsm.evaluation import Evaluation, SignalFault
from hsm.events import Event, Scoped
from hsm.expressions import SignalValue
from hsm.faults import MachineFault, Spin
from hsm.machine import Machine
from hsm.macrostep import NOTHING_DUE, Look, Macrostep, Phase
from hsm.model import Cancel, Send
from hsm.plans import Plan
from hsm.registry import Activity, Outcome, Stoppable

TOLERANCE = 1e-9
"""A time-out is due so many seconds early: sums of time steps do not hit their mark exactly."""

SPIN = 1000
"""So many microsteps may follow one another within a step before they count as endless."""

_FINISHED: Any = object()


@dataclass(frozen=True, slots=True)
class Fault:
    """Something that went wrong, on its way to a transition that handles it."""

    event: Scoped
    reason: str
    place: Place | None
    error: BaseException


class Supervisor:
    """A running machine: its configuration, variables, time-outs, history and activities.

    Made by ``Machine.start`` or ``Machine.restore``.

    Attributes:
        machine: what is run.
        initial: the macrostep that entered the initial configuration.
    """

    def __init__(self, machine: Machine, parameters: Sequence[Any], facts: object, time: float) -> None:
        self.machine = machine
        self._time = time
        self._values: list[Any] = [*parameters, *(None for _ in machine.model.variables)]
        self._timers: dict[int, float] = {}
        self._sent: tuple[tuple[float, Send], ...] = ()
        self._wake = inf
        self._history: dict[int, tuple[int, ...]] = {}
        self._memory: object = ()
        self._pending: list[Scoped | Fault] = []
        self._outcome: str | None = None
        self._running: dict[int, Activity] = {}
        self._stopped: list[int] = []
        self._hits: dict[int, int] = {}
        self._counts: dict[Plan, int] = {}
        self._covered = Coverage()
        self._outcomes: dict[tuple[int, str], int] = {}
        # Within a step:
        self._facts = facts
        self._memo: dict[Any, Any] = {}
        self._looks: list[Look] = []
        self._queue: deque[Event | Fault | Send | Cancel] = deque()
        self._external: deque[Event | Fault] = deque()
        self._faulted: dict[Any, BaseException] = {}
        self._error: BaseException | None = None
        self._reported: set[Any] = set()
        self.initial = self._enter(time)

    # What can be seen of a run.

    @property
    def time(self) -> float:
        """The logical time of the last step in seconds."""
        return self._time

    @property
    def configuration(self) -> frozenset[str]:
        """Full names of all active states, compound ones included, the root not."""
        return self._configuration.names

    @property
    def outcome(self) -> str | None:
        """The name of the top-level final state that ended the run; None while it goes on."""
        return self._outcome

    @property
    def variables(self) -> Mapping[str, Any]:
        """The values of variables and parameters by their full names; those of states never entered are left out."""
        named = zip(self.machine.generator.variables, self._values, strict=True)
        return MappingProxyType({name: value for name, value in named if value is not None})

    @property
    def coverage(self) -> Coverage:
        """What this run has exercised so far."""
        self._fold()
        width = max(1, len(self.machine.model.transitions))
        guards: dict[int, set[int]] = {}
        for mark in self._hits:
            guards.setdefault(mark % width, set()).add(mark // width)
        paths = {index: frozenset(found) for index, found in sorted(guards.items())}
        return self._covered.merge(Coverage(guards=paths, outcomes=dict(self._outcomes)))

    # Steps.

    def step(self, time: float, events: Sequence[str] = (), facts: object = None) -> Macrostep:
        """Let the machine react to what happened and to what is now.

        First the outcomes of activities and the given events, one after the other, then time-outs that are due, then
        conditions, until nothing fires any more.

        Args:
            time: logical time in seconds; it never runs backwards.
            events: names of events from outside, in the order in which they happened.
            facts: what the signals and actions of this step are given.

        Returns:
            What was done.

        Raises:
            MachineFault: something failed that the machine does not handle, or its transitions spin; the machine is as
                it was before the step.
            ValueError: the time is before that of the last step.
        """
        configuration = self._configuration
        memo: dict[Any, Any] = {}
        picked: Picked = NONE
        if events or self._pending or time >= self._wake or configuration.always is not None or time < self._time:
            return self._react(time, events, facts, memo)
        # Only conditions can fire.
        selector = configuration.when
        if selector is not None:
            try:
                picked = selector.pick(facts, memo, self._values, configuration.active, self._hits)
            except Exception as error:
                self._error = error
                return self._react(time, events, facts, memo)
            if picked != NONE:
                return self._react(time, events, facts, memo)
        self._time = time
        return Macrostep(time, ((Phase.WHEN, configuration, self._values, NOTHING_DUE, None),), memo, configuration)

    def _enter(self, time: float) -> Macrostep:
        plan = self.machine.planner.start()
        self._configuration = plan.target
        self._looks.append((Phase.START, plan.target, self._values, NOTHING_DUE, plan))
        self._apply(plan)
        self._settle()
        self._work_off()
        self._facts = None
        return Macrostep(time, self._looks, self._memo, self._configuration)

    def _react(self, time: float, events: Sequence[str], facts: object, memo: dict[Any, Any]) -> Macrostep:
        """A step in which something fires or may fire; whatever is raised, the machine is as before."""
        if time < self._time:
            raise ValueError(f"time runs backwards: {time} s after {self._time} s")
        before = (
            self._configuration, self._values, self._timers, self._sent, self._wake, self._history, self._memory,
            self._pending, self._outcome, self._time,
        )  # fmt: skip
        self._time = time
        self._facts = facts
        self._memo = memo
        self._looks = []
        pending, self._pending = self._pending, []
        try:
            if time >= self._wake and self._sent:
                self._receive(time)
            self._external.extend(pending)
            self._external.extend(events)
            self._settle()
            self._work_off()
            if time >= self._wake:
                self._time_outs(time)
                self._work_off()
            self._conditions()
        except BaseException:
            (
                self._configuration, self._values, self._timers, self._sent, self._wake, self._history, self._memory,
                self._pending, self._outcome, self._time,
            ) = before  # fmt: skip
            self._stopped.clear()
            raise
        finally:
            self._facts = None
            self._error = None
            if self._queue or self._external:
                self._queue.clear()
                self._external.clear()
            if self._faulted or self._reported:
                self._faulted = {}
                self._reported.clear()
        if self._stopped:
            self._stop_left()
        return Macrostep(time, self._looks, memo, self._configuration)

    def _settle(self) -> None:
        """Take transitions without a trigger and handle the machine's own events until there are none."""
        for _ in range(SPIN):
            if self._outcome is not None:
                return
            always = self._configuration.always
            if always is not None and self._fire(always, Phase.ALWAYS):
                continue
            if not self._queue:
                return
            entry = self._queue.popleft()
            if isinstance(entry, Send):
                self._send(entry)
            elif isinstance(entry, Cancel):
                self._set_sent(tuple(one for one in self._sent if one[1].label != entry.label))
            else:
                self._look(entry)
        raise self._spin()

    def _work_off(self) -> None:
        """Handle the events from outside, and those that the machine sends itself meanwhile."""
        known = len(self._external) + SPIN
        while self._external and self._outcome is None:
            if known == 0:
                raise self._spin()
            known -= 1
            self._look(self._external.popleft())
            self._settle()

    def _send(self, send: Send) -> None:
        if send.delay <= 0:
            self._external.append(send.event)
        else:
            self._set_sent((*self._sent, (self._time + send.delay, send)))

    def _receive(self, time: float) -> None:
        """Let events that were sent with a delay arrive, the earliest first."""
        arrived = sorted((one for one in self._sent if time >= one[0] - TOLERANCE), key=lambda one: one[0])
        self._external.extend(send.event for _, send in arrived)
        self._set_sent(tuple(one for one in self._sent if one not in arrived))

    def _set_sent(self, sent: tuple[tuple[float, Send], ...]) -> None:
        self._sent = sent
        self._set_wake()

    def _set_wake(self) -> None:
        """When the next time-out or sent event is due."""
        self._wake = min([*self._timers.values(), *(due for due, _ in self._sent)], default=inf) - TOLERANCE

    def _look(self, entry: Event | Fault) -> None:
        """Let one event fire what it can."""
        event = entry.event if isinstance(entry, Fault) else entry
        selector = self._configuration.on(event)
        if selector is not None:
            fired = self._fire(selector, event)
        else:
            fired = False
            self._looks.append((event, self._configuration, self._values, NOTHING_DUE, None))
        if not fired and isinstance(entry, Fault):
            raise self._unhandled(entry)

    def _time_outs(self, time: float) -> None:
        due = frozenset(index for index, deadline in self._timers.items() if time >= deadline - TOLERANCE)
        for _ in range(SPIN):
            after = self._configuration.after
            if self._outcome is not None or after is None or not self._fire(after, Phase.AFTER, due):
                return
            plan = self._looks[-1][4]
            due = due.difference(plan.disarmed if plan else ())
            self._settle()
        raise self._spin()

    def _conditions(self) -> None:
        for _ in range(SPIN):
            when = self._configuration.when
            if when is None or self._outcome is not None:
                return
            fired = self._fire(when, Phase.WHEN)
            if not fired and not self._queue:
                return
            self._settle()
            self._work_off()
        raise self._spin()

    def _fire(self, selector: Selector, trigger: Phase | Event, due: frozenset[int] = NOTHING_DUE) -> bool:
        """Take what a selector picks; whether there was anything."""
        configuration = self._configuration
        values = self._values
        picked = self._pick(selector, due if trigger is Phase.AFTER else None)
        if picked == NONE:
            self._looks.append((trigger, configuration, values, due, None))
            return False
        plan = configuration.plan(picked, self._history, self._memory)
        self._looks.append((trigger, configuration, values, due, plan))
        self._configuration = plan.target
        if plan.plain:
            try:
                self._counts[plan] += 1
            except KeyError:
                self._count(plan)
        else:
            self._apply(plan)
        return True

    def _pick(self, selector: Selector, due: frozenset[int] | None) -> Picked:
        if self._error is None and not self._faulted:
            arguments = (self._facts, self._memo, self._values, self._configuration.active, self._hits)
            try:
                return selector.pick(*arguments) if due is None else selector.pick(*arguments, due)
            except Exception as error:
                self._error = error
        return self._pick_carefully(selector, due)

    def _apply(self, plan: Plan) -> None:
        """Do what a microstep asks for; old values stay untouched for the record and for a way back."""
        self._count(plan)
        timers = self._timers
        if plan.timed:
            timers = {index: deadline for index, deadline in timers.items() if index not in plan.disarmed}
        if plan.remembered:
            self._history = {**self._history, **dict(plan.remembered)}
            self._memory = tuple(sorted(self._history.items()))
        if plan.work:
            values = self._values[:]
            for item in plan.work:
                if isinstance(item, Scoped):
                    self._queue.append(item)
                    continue
                block, active = item
                try:
                    block.run(self._facts, self._memo, values, active, self._queue, timers, self._time)
                except Exception as error:
                    raise self._failed(block, error) from error
            self._values = values
        if plan.timed:
            self._timers = timers
            self._set_wake()
        self._stopped.extend(plan.stopped)
        self._outcome = plan.outcome or self._outcome

    # Faults.

    def _pick_carefully(self, selector: Selector, due: frozenset[int] | None) -> Picked:
        """What a selector picks when a signal has failed: every guard that needs the signal counts as false."""
        evaluation = self.evaluation(self._memo, self._values, self._configuration.active, self._ask)
        width = len(self.machine.model.transitions)
        found: list[int] = []
        for chain in selector.chains:
            for index in chain.candidates:
                if due is not None and index not in due:
                    continue
                try:
                    held, path = self.machine.generator.decision(index).follow(evaluation.condition)
                except Exception as error:
                    self._error = None
                    self._report(index, error)
                    continue
                self._hits[path * width + index] = 1
                if held:
                    if index not in found:
                        found.append(index)
                    break
        self._error = None
        return (tuple(found) if len(found) > 1 else found[0]) if found else NONE

    def evaluation(
        self,
        memo: Mapping[Any, Any],
        values: Sequence[Any],
        active: frozenset[int],
        ask: Callable[[SignalValue], Any],
    ) -> Evaluation:
        """What expressions are evaluated against at one moment of this run."""
        generator = self.machine.generator
        return Evaluation(values, generator.variables, active, self.machine.indices, memo, generator.key, ask)

    def _ask(self, call: SignalValue) -> Any:
        """Evaluate a signal that was not asked yet; the first of them is the one that has just failed."""
        key = self.machine.generator.key(call, self._values)
        error = self._faulted.get(key)
        if error is None and self._error is not None:
            error, self._error = self._error, None
        if error is None:
            try:
                arguments = self.machine.generator.arguments(call.arguments)(None, {}, self._values, ())
                value = self._memo[key] = call.signal.function(self._facts, *arguments)
            except Exception as raised:
                error = raised
            else:
                return value
        self._faulted[key] = error
        raise SignalFault(call, error)

    def _report(self, transition: int, error: Exception) -> None:
        """Announce a failed guard, once for each state and cause in a step."""
        declared = self.machine.model.transitions[transition]
        place, cause, reason = declared.place, error, f"the guard failed: {error!r}"
        known: Any = (declared.source, transition)
        if isinstance(error, SignalFault):
            known = (declared.source, self.machine.generator.key(error.call, self._values), None)
            place, reason = error.call.place or place, str(error)
            cause = error.__cause__ if isinstance(error.__cause__, Exception) else error
        if known not in self._reported:
            self._reported.add(known)
            self._queue.append(Fault(_fault_event(declared.source), reason, place, cause))

    def _unhandled(self, fault: Fault) -> MachineFault:
        raised = MachineFault(fault.reason, self._state_name(fault.event.origin), fault.place)
        raised.__cause__ = fault.error
        return raised

    def _failed(self, block: Block, error: Exception) -> MachineFault:
        state = self.machine.model.states[block.state]
        return MachineFault(f"an action failed: {error!r}", state.name, block.place_of(error) or state.place)

    def _spin(self) -> Spin:
        """The cycle of transitions at the end of the step so far."""
        taken = [look[4].transitions for look in self._looks if look[4] is not None]
        period = next((n for n in range(1, len(taken) // 2) if taken[-n:] == taken[-2 * n : -n]), len(taken))
        cycle = [self.machine.model.transitions[index] for one in taken[-period:] for index in one]
        listed = ", ".join(self._state_name(one.source) + (f" ({one.place})" if one.place else "") for one in cycle[:8])
        reason = f"transitions follow one another without end within one step, through {listed}"
        return Spin(reason, self._state_name(cycle[0].source), cycle[0].place)

    def _state_name(self, state: int) -> str:
        return self.machine.model.states[state].name

    # Activities.

    def act(self, facts: object) -> Sequence[tuple[str, object]]:
        """Let the running activities do their part of this tick, in document order.

        An outcome is kept for the next step; an activity that is over is not ticked again.

        Args:
            facts: what the activities are given.

        Returns:
            The name of the state and the effect, for each activity that gave one.

        Raises:
            MachineFault: an activity failed and no transition in its scope handles a fault.
        """
        effects: list[tuple[str, object]] = []
        for state in self._configuration.activities:
            activity = self._running.get(state)
            if activity is _FINISHED:
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
                self._outcomes[state, effect.name] = self._outcomes.get((state, effect.name), 0) + 1
                self._pending.append(Scoped((effect.name,), state, f"done.invoke.{self._state_name(state)}"))
            elif effect is not None:
                effects.append((self._state_name(state), effect))
        return effects

    def stop(self) -> None:
        """Stop all activities: the caller ends the run."""
        self._stopped.extend(self._configuration.activities)
        self._stop_left()

    def _begin(self, state: int, facts: object) -> Activity:
        call = self.machine.model.states[state].activity
        assert call is not None, "only states with an activity are begun"
        arguments = self.machine.generator.arguments(call.arguments)
        return call.activity.factory(*arguments(facts, self._memo, self._values, self._configuration.active))

    def _activity_failed(self, state: int, error: Exception) -> None:
        self._running[state] = _FINISHED
        call = self.machine.model.states[state].activity
        assert call is not None, "only states with an activity fail in one"
        fault = Fault(_fault_event(state), f"activity `{call.activity.name}` failed: {error!r}", call.place, error)
        if self._configuration.on(fault.event) is None:
            raise self._unhandled(fault)
        self._pending.append(fault)

    def _stop_left(self) -> None:
        stopped, self._stopped = self._stopped, []
        for state in stopped:
            activity = self._running.pop(state, None)
            if isinstance(activity, Stoppable):
                activity.stop()

    # Coverage.

    def _count(self, plan: Plan) -> None:
        if len(self._counts) >= CACHE:
            self._fold()
        self._counts[plan] = self._counts.get(plan, 0) + 1

    def _fold(self) -> None:
        """Add up what the plans taken so far have exercised."""
        states: dict[int, int] = {}
        transitions: dict[int, int] = {}
        history: dict[tuple[int, bool], int] = {}
        for plan, count in self._counts.items():
            for state in plan.entered:
                states[state] = states.get(state, 0) + count
            for index in plan.transitions:
                transitions[index] = transitions.get(index, 0) + count
            for entered in plan.restored:
                history[entered] = history.get(entered, 0) + count
        self._counts.clear()
        self._covered = self._covered.merge(Coverage(states=states, transitions=transitions, history=history))


def _fault_event(state: int) -> Scoped:
    return Scoped(("fault",), state, "error.execution")
