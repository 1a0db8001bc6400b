"""One step in full: SCXML's main loop on a copy of a run's state, which the run adopts on success."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from hsm.engine.clock import nanoseconds, tolerance
from hsm.engine.compiled import CompiledChart
from hsm.engine.configuration import Picked, Plan, Selector
from hsm.engine.failures import Failures
from hsm.engine.generated import NONE, Block, Occasion
from hsm.engine.invocations import Invocations
from hsm.engine.limits import duration
from hsm.engine.macrostep import Macrostep
from hsm.engine.record import NOTHING_DUE, Phase, Selection, StepRecord
from hsm.engine.run_state import PendingFault, RunState, Work, event_of
from hsm.engine.sessions import InvokedChart
from hsm.model.chart import Cancel, Held, Model, Send
from hsm.model.events import Event, StateEvent
from hsm.model.faults import MachineFault, Spin
from hsm.model.messages import STORE, Adjustment, Emission, Occurrence, ScxmlEvent, Store

SPIN = 1000
"""A step with more consecutive microsteps than this counts as endless."""

MOST_DEFERRED = 1000
"""At most this many events may be deferred at once."""


class MacrostepExecution:
    """One step.

    Attributes:
        state: the state of the run, as far as the step has come.
        selections: the selections so far.
        stopped: states that were left and had an activity, in order.
        sent: events that were sent to other machines, in order.
        outbox: events for sessions that this one does not run, each with its target.
        facts: the argument of signals and actions.
        memo: the signals evaluated so far.
        hits: the paths through guards that were taken, for coverage.
        queue: the machine's own events that are to be handled.
        external: events from outside that are to be handled.
    """

    def __init__(
        self,
        chart: CompiledChart,
        state: RunState,
        time: float,
        *,
        facts: object,
        memo: dict[Any, Any],
        hits: set[tuple[int, int]],
    ) -> None:
        self.chart = chart
        self.state = replace(state)
        self.selections: list[Selection] = []
        self.stopped: list[int] = []
        self.sent: list[str | Occurrence] = []
        self.outbox: list[tuple[str, ScxmlEvent]] = []
        self._time = time
        self._settled = False
        self._moved = False
        self._due = NOTHING_DUE
        self._now = nanoseconds(time)
        self._latest = self._now + tolerance(time)
        self.facts = facts
        self.memo = memo
        self.hits = hits
        self.queue: deque[Event | ScxmlEvent | PendingFault | Send | Cancel] = deque()
        self.external: deque[Event | ScxmlEvent | PendingFault | Adjustment] = deque()
        self._failures = Failures(self)
        self._invocations = Invocations(self)

    def start(self, plan: Plan) -> None:
        """Enter the initial configuration."""
        self.memo.update(self._stored())
        self._take(Phase.START, NOTHING_DUE, plan)
        self._run_to_stability()
        self._drain()
        self.state.store = self.memo.get(STORE)

    def run(
        self, events: Iterable[Event | ScxmlEvent | PendingFault | Adjustment], error: BaseException | None = None
    ) -> None:
        """Handle events and adjustments, then time-outs, then conditions.

        Args:
            events: outcomes of activities, and events and adjustments from outside, in order.
            error: the exception of a guard, if the fast path failed.
        """
        self._settled = True
        self._failures.error = error
        self.memo.update(self._stored())
        if self.state.outcome is not None:
            for entry in events:
                if not isinstance(entry, Adjustment):
                    self._record(event_of(entry), NOTHING_DUE, None)
            return
        self.external.extend(self._arrived())
        self.external.extend(events)
        self._run_to_stability()
        self._drain()
        self._due = frozenset(index for index, deadline in self.state.timers.items() if self._reached(deadline))
        if self._due:
            self._time_outs()
        self._conditions()
        self._watch()
        self.state.store = self.memo.get(STORE)

    def _stored(self) -> dict[str, Store]:
        """The data of the chart, as the first of the step's signals; without a data model nothing."""
        store = self.state.store or self.chart.model.store
        return {} if store is None else {STORE: store}

    def bind(self, entry: Event | ScxmlEvent | PendingFault) -> None:
        """Make an event the chart's ``_event``."""
        store: Store = self.memo[STORE]
        match entry:
            case ScxmlEvent():
                event = entry
            case Occurrence(name, data):
                event = ScxmlEvent(name, data=dict(data) or None)
            case str():
                event = ScxmlEvent(entry)
            case StateEvent(origin=origin, standard=name):
                event = ScxmlEvent(name, "platform", store.results.get(origin))
            case _:
                event = ScxmlEvent(entry.event.standard, "platform", entry.reason)
        self.memo[STORE] = replace(store, event=event)

    def macrostep(self) -> Macrostep:
        """The record of the completed step."""
        state = self.state
        # The last selection for conditions found nothing; a step that ends the machine, or enters it, has none.
        values = state.values if self._settled and state.outcome is None else None
        step = Macrostep()
        step.sending = tuple(self.sent)
        step.raw = StepRecord(self._time, self.selections, self.memo, values, state.timers, state.configuration)
        return step

    def _reached(self, deadline: int) -> bool:
        return deadline <= self._latest

    def _run_to_stability(self) -> None:
        """Take transitions without a trigger and handle the machine's own events until there are none."""
        taken = 0
        while self.state.outcome is None:
            always = self.state.configuration.always
            if always is not None and self._fire(always, Phase.ALWAYS):
                taken += 1
            elif not self.queue:
                return
            else:
                entry = self.queue.popleft()
                if isinstance(entry, Send):
                    self._send(entry)
                elif isinstance(entry, Cancel):
                    self.state.sent = tuple(one for one in self.state.sent if one[1].label != entry.label)
                else:
                    taken += self._handle(entry)
            if taken > SPIN:
                raise endless(self.chart.model, self.selections)

    def _drain(self) -> None:
        """Handle the events from outside, and those that the machine sends itself meanwhile."""
        bound = len(self.external) + SPIN
        while self.state.outcome is None:
            if self._moved and self.state.deferred:
                self.external.extendleft(reversed(self.state.deferred))
                self.state.deferred = ()
            self._moved = False
            if self._invocations.waiting:
                self._invocations.begin()
            if self.queue:
                self._run_to_stability()
                continue
            if not self.external and not (self.state.sessions and self._invocations.run()):
                return
            if bound == 0:
                raise endless(self.chart.model, self.selections)
            bound -= 1
            if not self.external:
                continue
            entry = self.external.popleft()
            if isinstance(entry, Adjustment):
                self._put({entry.parameter: entry.value})
                continue
            if self.state.sessions:
                self._invocations.forward(entry)
            self._handle(entry)
            self._run_to_stability()

    def _is_settled(self) -> bool:
        """Whether no event waits: a fault's handler may have raised one, or have ended the wait of a deferred one."""
        return not self.queue and not (self._moved and self.state.deferred)

    def _send(self, send: Send) -> None:
        if send.delay <= 0 and send.target is not None:
            self._invocations.deliver(send)
        elif send.delay <= 0:
            self.external.append(send.message or send.event)
        else:
            self.state.sent = (*self.state.sent, (self._now + nanoseconds(send.delay), send))

    def _emit(self, emission: Emission) -> None:
        """Send an event to other machines; the members of this one receive it in the next step."""
        event = emission.event
        self.sent.append(event)
        for name in emission.receivers:
            message = Occurrence(name, event.data) if isinstance(event, Occurrence) else None
            self.state.sent = (*self.state.sent, (self._now, Send(name, message=message)))

    def _arrived(self) -> list[Event | ScxmlEvent]:
        """The events on their way that arrive now, the earliest first."""
        arrived = sorted((one for one in self.state.sent if self._reached(one[0])), key=lambda one: one[0])
        if arrived:
            self.state.sent = tuple(one for one in self.state.sent if not self._reached(one[0]))
        for _, send in arrived:
            if send.target is not None:
                self._invocations.deliver(send)
        return [send.message or send.event for _, send in arrived if send.target is None]

    def leave(self) -> None:
        """Run the exit actions of all active states of a chart that has ended, from the inside out."""
        queue: list[Any] = []
        for index in sorted(self.state.configuration.active, reverse=True):
            block = self.chart.generator.actions(index, Occasion.EXIT, self.chart.model.states[index].exit)
            if block is not None:
                arguments = (self.facts, self.memo, self.state.values, self.state.configuration.active)
                block.run(*arguments, queue, self.state.timers, self._now)
        for entry in queue:
            if isinstance(entry, Send) and entry.target is not None and entry.delay <= 0:
                self._invocations.deliver(entry)
        self.state.store = self.memo.get(STORE)

    def inner(self, session: InvokedChart[RunState]) -> MacrostepExecution:
        """A step of a chart that this one has invoked."""
        return MacrostepExecution(session.chart, session.state, self._time, facts=self.facts, memo={}, hits=set())

    def _handle(self, entry: Event | ScxmlEvent | PendingFault) -> bool:
        """Let one event fire its transitions; return whether it fired any."""
        if STORE in self.memo:
            self.bind(entry)
        event = event_of(entry)
        declared = self.chart.model.data_of(event.name) if isinstance(event, Occurrence) else None
        if declared is None or not isinstance(event, Occurrence):
            return self._let_fire(entry, event)
        # The data of the event is among the variables while it is handled.
        carried = {declared.variable(part): event.data[part.name] for part in declared.fields}
        self._put(carried)
        fired = self._let_fire(entry, event)
        self._put(dict.fromkeys(carried))
        return fired

    def _put(self, carried: Mapping[str, Any]) -> None:
        """Give slots other values in a new list; the record keeps the old one."""
        values = self.state.values[:]
        for name, value in carried.items():
            values[self.chart.generator.variables[name]] = value
        self.state.values = values

    def _let_fire(self, entry: Event | ScxmlEvent | PendingFault, event: Event) -> bool:
        selector = self.state.configuration.on(event)
        if selector is not None:
            fired = self._fire(selector, event)
        else:
            fired = False
            self._record(event, NOTHING_DUE, None)
        plan = self.selections[-1].plan if fired else None
        if plan is not None and plan.kept and isinstance(event, str | Occurrence):
            self._defer(event)
        if not fired and isinstance(entry, PendingFault):
            raise entry.unhandled(self.chart)
        return fired

    def _defer(self, event: str | Occurrence) -> None:
        """Keep an event until another state is active."""
        if len(self.state.deferred) >= MOST_DEFERRED:
            plan = self.selections[-1].plan
            assert plan is not None, "a transition keeps it"
            line = self.chart.model.transitions[plan.transitions[0]]
            name = self.chart.model.states[line.source].name
            raise MachineFault(f"more than {MOST_DEFERRED} events are deferred", name, line.place)
        self.state.deferred = (*self.state.deferred, event)

    def _time_outs(self) -> None:
        for _ in range(SPIN):
            after = self.state.configuration.after
            if self.state.outcome is not None or after is None:
                return
            if not self._fire(after, Phase.AFTER, self._due) and self._is_settled():
                return
            self._run_to_stability()
            self._drain()
        raise endless(self.chart.model, self.selections)

    def _conditions(self) -> None:
        for _ in range(SPIN):
            if self.state.outcome is not None:
                return
            when = self.state.configuration.when
            if when is None:
                return
            if not self._fire(when, Phase.WHEN) and self._is_settled():
                self.selections.pop()  # the last selection, which finds nothing, is part of every macrostep
                return
            self._run_to_stability()
            self._drain()
        raise endless(self.chart.model, self.selections)

    def _selection(self, trigger: Phase | Event, due: frozenset[int], plan: Plan | None) -> Selection:
        return Selection(trigger, self.state.configuration, self.state.values, due, plan)

    def _watch(self) -> None:
        """Start the timers of conditions that hold now, and stop those of the others."""
        for _ in range(SPIN):
            state = self.state
            if state.outcome is not None or not (state.configuration.held or state.acted):
                return
            for index in state.configuration.held:
                self._watch_one(index)
            found = self._failures.take()
            if not found:
                return
            for fault in found:
                self._handle(fault)
            self._run_to_stability()
            self._drain()
            self._conditions()
        raise endless(self.chart.model, self.selections)

    def _watch_one(self, index: int) -> None:
        trigger = self.chart.model.transitions[index].trigger
        assert isinstance(trigger, Held), "nothing else is watched"
        state, holds = self.state, False
        try:
            evaluation = self._failures.evaluation()
            holds = bool(evaluation.condition(trigger.condition))
            length = duration(evaluation.value(trigger.duration)) if holds else 0
        except Exception as error:
            self._failures.report(index, error)
            holds = False
        finally:
            self._failures.error = None
        if not holds:
            state.timers = {one: due for one, due in state.timers.items() if one != index}
            state.acted -= {index}
        elif index not in state.timers and index not in state.acted:
            state.timers = {**state.timers, index: self._now + length}

    def _record(self, trigger: Phase | Event, due: frozenset[int], plan: Plan | None) -> None:
        self.selections.append(self._selection(trigger, due, plan))

    def _fire(self, selector: Selector, trigger: Phase | Event, due: frozenset[int] = NOTHING_DUE) -> bool:
        """Take the transitions of a selector; return whether there were any."""
        picked = self._pick(selector, due if trigger is Phase.AFTER else None)
        while found := self._failures.take():
            # A fault comes first: it is handled before everything else, then the selection is repeated.
            for fault in found:
                self._handle(fault)
            again = self._selection(trigger, due, None).selector if self.state.outcome is None else None
            picked = self._pick(again, due if trigger is Phase.AFTER else None) if again is not None else NONE
        if picked == NONE:
            self._record(trigger, due, None)
            return False
        self._take(trigger, due, self.chart.planner.plan(self.state.configuration, picked, self.state.history))
        return True

    def _pick(self, selector: Selector, due: frozenset[int] | None) -> Picked:
        failures = self._failures
        if failures.is_empty():
            state = self.state
            arguments = (self.facts, self.memo, state.values, state.configuration.active, self.hits)
            try:
                return selector.pick(*arguments) if due is None else selector.pick(*arguments, due)
            except Exception as error:
                failures.error = error
        return failures.pick(selector, due)

    def _take(self, trigger: Phase | Event, due: frozenset[int], plan: Plan) -> None:
        """Execute a microstep; old values stay unchanged for the record."""
        if self.chart.invokes:
            self._invocations.follow(plan)
        if plan.plain:
            self._commit(trigger, due, plan)
            return
        work = Work(self.state.values, self.state.timers, [])
        if plan.timed:
            work.timers = {index: due for index, due in work.timers.items() if index not in plan.disarmed}
        before = work
        if plan.work:
            work = work.copy()
            for item in plan.work:
                if isinstance(item, StateEvent):
                    work.raised.append(item)
                    continue
                block, active = item
                if block in self._failures.left_out:
                    continue
                try:
                    block.run(self.facts, self.memo, work.values, active, work.raised, work.timers, self._now)
                except Exception as error:
                    if plan.source is not None:
                        self._record(trigger, due, None)
                    self._undo(plan, before, block, error)
                    return
                if plan.source is None and block.state == 0:
                    before = work.copy()  # the machine itself is entered once and for all
        self._commit(trigger, due, plan)
        state = self.state
        state.values, state.timers = work.values, work.timers
        if plan.acted or state.acted:
            state.acted = state.acted.difference(plan.disarmed).union(plan.acted)
        self._put_out(work.raised)
        if plan.remembered:
            state.history = {**state.history, **dict(plan.remembered)}
        self.stopped.extend(plan.stopped)
        state.outcome = plan.outcome or state.outcome

    def _commit(self, trigger: Phase | Event, due: frozenset[int], plan: Plan) -> None:
        """Record a microstep that succeeded, and enter its states; what it restarts is due in another step."""
        self._record(trigger, due, plan)
        self.state.configuration = plan.target
        self._moved = self._moved or bool(plan.exited or plan.entered)
        self._due = self._due.difference(plan.disarmed, plan.transitions)

    def _put_out(self, raised: Iterable[Event | ScxmlEvent | Send | Emission | Cancel]) -> None:
        """Queue raised events; events for other machines are sent at once, even if this one has ended."""
        for entry in raised:
            if isinstance(entry, Emission):
                self._emit(entry)
            elif isinstance(entry, Send) and entry.target is not None and entry.delay <= 0:
                self._invocations.deliver(entry)
            else:
                self.queue.append(entry)

    # When something goes wrong.

    def _undo(self, plan: Plan, before: Work, block: Block, error: Exception) -> None:
        """Let a transition handle a microstep whose action failed; nothing of the microstep was done.

        The failed transitions are not tried again in this step, nor are the exit actions of a state that could not be
        left.
        """
        state, fault = self.state, self._failures.of_action(block, error)
        if plan.source is None:
            if block.state == 0:
                raise fault.unhandled(self.chart)
            state.configuration = self.chart.configuration(())
            state.values, state.timers = before.values, before.timers
            self._put_out(before.raised)
        self._failures.undo(plan, block)
        handler = self._failures.handler(fault, plan)
        if handler is None:
            raise fault.unhandled(self.chart)
        self._take(fault.event, NOTHING_DUE, self.chart.planner.plan(state.configuration, handler, state.history))


def endless(model: Model, selections: Sequence[Selection]) -> Spin:
    """The error for an endless step, which names the cycle of transitions at its end."""
    taken: Sequence[tuple[int, ...]] = [one.plan.transitions for one in selections if one.plan is not None]
    period = next((n for n in range(1, len(taken) // 2) if taken[-n:] == taken[-2 * n : -n]), len(taken))
    cycle = [model.transitions[index] for one in taken[-period:] for index in one]
    names = [model.states[one.source].name for one in cycle]
    listed = ", ".join(
        f"{name} ({one.place})" if one.place else name for name, one in zip(names[:8], cycle, strict=False)
    )
    reason = f"transitions follow one another without end within one step, through {listed}"
    return Spin(reason, names[0], cycle[0].place)
