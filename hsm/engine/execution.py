"""One step in full: SCXML's main loop on a copy of a run's state, which the run adopts when all went well."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from hsm.engine.clock import nanoseconds, tolerance, waking
from hsm.engine.codegen import NONE, Block, Occasion
from hsm.engine.compiled import CompiledChart
from hsm.engine.configuration import Configuration, Picked, Plan, Selector
from hsm.engine.evaluation import Evaluation, SignalFault
from hsm.engine.limits import duration
from hsm.engine.macrostep import Macrostep
from hsm.engine.record import NOTHING_DUE, Phase, Selection, StepRecord
from hsm.engine.sessions import MOST_SESSIONS, Session
from hsm.model.chart import Cancel, Held, Invoked, On, Send
from hsm.model.diagnostics import Place
from hsm.model.events import Event, StateEvent, matches
from hsm.model.expressions import SignalValue
from hsm.model.faults import MachineFault, Spin
from hsm.model.messages import STORE, Emission, Message, Occurrence, Store
from hsm.model.topology import Remembered

SPIN = 1000
"""A step with more consecutive microsteps than this counts as endless."""

MOST_DEFERRED = 1000
"""At most this many events may be deferred at once."""


@dataclass(slots=True)
class RunState:
    """Where a run is. The collections in it are never changed, only replaced.

    Attributes:
        configuration: the active states.
        values: the variables, by slot.
        timers: the deadline of each time-out that runs in nanoseconds, by transition.
        sent: events on their way, each with the time of its arrival in nanoseconds.
        history: what each history state remembers.
        outcome: how the run ended, or None.
        acted: conditions that have held long enough, by transition: they wait until they are false.
        store: the data of a chart that has any, between its steps.
        deferred: events that are kept until another state is active, in the order in which they came.
        sessions: the charts that were invoked and run, in the order in which they began.
        invoked: how many charts were invoked so far.
    """

    configuration: Configuration
    values: list[Any]
    timers: dict[int, int]
    sent: tuple[tuple[int, Send], ...]
    history: Remembered
    outcome: str | None
    acted: frozenset[int] = frozenset()
    store: Store | None = None
    deferred: tuple[str | Occurrence, ...] = ()
    sessions: tuple[Session[RunState], ...] = ()
    invoked: int = 0

    @property
    def wake(self) -> float:
        """A time in seconds before which no time-out and no event on its way is due; infinite when there is none."""
        return waking([*self.timers.values(), *(due for due, _ in self.sent)])


@dataclass(slots=True)
class _Work:
    """What the actions of a microstep change: variables, time-outs, and the events that they raise."""

    values: list[Any]
    timers: dict[int, int]
    raised: list[Event | Message | Send | Emission | Cancel]

    def copy(self) -> _Work:
        """The same, to go on from."""
        return _Work(self.values[:], dict(self.timers), self.raised[:])


@dataclass(frozen=True, slots=True)
class PendingFault:
    """Something that went wrong, on its way to a transition that handles it."""

    event: StateEvent
    reason: str
    place: Place | None
    error: BaseException

    def unhandled(self, chart: CompiledChart) -> MachineFault:
        """The exception for the caller."""
        raised = MachineFault(self.reason, chart.model.states[self.event.origin].name, self.place)
        raised.__cause__ = self.error
        return raised


def fault_event(state: int) -> StateEvent:
    """The event that announces a fault in a state."""
    return StateEvent(("fault",), state, "error.execution")


def _event(entry: Event | Message | PendingFault) -> Event:
    if isinstance(entry, Message):
        return entry.name
    return entry.event if isinstance(entry, PendingFault) else entry


class MacrostepExecution:
    """One step.

    Attributes:
        state: the state of the run, as far as the step has come.
        selections: what was looked at and done so far.
        stopped: states that were left and had an activity, in order.
        sent: events that were sent to other machines, in order.
        outbox: events for sessions that this one does not run, each with its target.
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
        self.outbox: list[tuple[str, Message]] = []
        self._invoking: set[int] = set()
        self._stepped: set[str] = set()
        self._time = time
        self._settled = False
        self._moved = False
        self._now = nanoseconds(time)
        self._latest = self._now + tolerance(time)
        self._facts = facts
        self._memo = memo
        self._hits = hits
        self._queue: deque[Event | Message | PendingFault | Send | Cancel] = deque()
        self._external: deque[Event | Message | PendingFault] = deque()
        self._failed: dict[Any, BaseException] = {}
        self._reported: set[Any] = set()
        self._found: list[PendingFault] = []
        self._error: BaseException | None = None
        self._undone: set[int] = set()
        self._left_out: set[Block] = set()

    def start(self, plan: Plan) -> None:
        """Enter the initial configuration."""
        self._memo.update(self._stored())
        self._take(Phase.START, NOTHING_DUE, plan)
        self._run_to_stability()
        self._drain()
        self.state.store = self._memo.get(STORE)

    def run(self, events: Iterable[Event | Message | PendingFault], error: BaseException | None = None) -> None:
        """Handle events, then time-outs, then conditions.

        Args:
            events: outcomes of activities and events from outside, in order.
            error: what a guard has just raised, when the step was tried the quick way.
        """
        self._settled = True
        self._error = error
        self._memo.update(self._stored())
        if self.state.outcome is not None:
            for entry in events:
                self._record(_event(entry), NOTHING_DUE, None)
            return
        self._external.extend(self._arrived())
        self._external.extend(events)
        self._run_to_stability()
        self._drain()
        due = frozenset(index for index, deadline in self.state.timers.items() if self._reached(deadline))
        if due:
            self._time_outs(due)
        self._conditions()
        self._watch()
        self.state.store = self._memo.get(STORE)

    def _stored(self) -> dict[str, Store]:
        """The data of the chart, as the first of the step's signals; without a data model nothing."""
        store = self.state.store or self.chart.model.store
        return {} if store is None else {STORE: store}

    def _bind(self, entry: Event | Message | PendingFault) -> None:
        """Make an event the chart's ``_event``."""
        store: Store = self._memo[STORE]
        match entry:
            case Message():
                event = entry
            case Occurrence(name, data):
                event = Message(name, data=dict(data) or None)
            case str():
                event = Message(entry)
            case StateEvent(origin=origin, standard=name):
                event = Message(name, "platform", store.results.get(origin))
            case _:
                event = Message(entry.event.standard, "platform", entry.reason)
        self._memo[STORE] = replace(store, event=event)

    def macrostep(self) -> Macrostep:
        """What was done, once all is done."""
        state = self.state
        # The last look for conditions found nothing; a step that ends the machine, or enters it, has none.
        values = state.values if self._settled and state.outcome is None else None
        step = Macrostep()
        step.sending = tuple(self.sent)
        step.raw = StepRecord(self._time, self.selections, self._memo, values, state.timers, state.configuration)
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
            elif not self._queue:
                return
            else:
                entry = self._queue.popleft()
                if isinstance(entry, Send):
                    self._send(entry)
                elif isinstance(entry, Cancel):
                    self.state.sent = tuple(one for one in self.state.sent if one[1].label != entry.label)
                else:
                    taken += self._handle(entry)
            if taken > SPIN:
                raise self._spin()

    def _drain(self) -> None:
        """Handle the events from outside, and those that the machine sends itself meanwhile."""
        bound = len(self._external) + SPIN
        while self.state.outcome is None:
            if self._moved and self.state.deferred:
                self._external.extendleft(reversed(self.state.deferred))
                self.state.deferred = ()
            self._moved = False
            if self._invoking:
                self._invoke()
            if self._queue:
                self._run_to_stability()
                continue
            if not self._external and not (self.state.sessions and self._run_sessions()):
                return
            if bound == 0:
                raise self._spin()
            bound -= 1
            if not self._external:
                continue
            entry = self._external.popleft()
            if self.state.sessions:
                self._forward(entry)
            self._handle(entry)
            self._run_to_stability()

    def _send(self, send: Send) -> None:
        if send.delay <= 0 and send.target is not None:
            self._deliver(send)
        elif send.delay <= 0:
            self._external.append(send.message or send.event)
        else:
            self.state.sent = (*self.state.sent, (self._now + nanoseconds(send.delay), send))

    def _emit(self, emission: Emission) -> None:
        """Send an event to other machines; the members of this one hear of it in the next step."""
        event = emission.event
        self.sent.append(event)
        for name in emission.receivers:
            message = Occurrence(name, event.data) if isinstance(event, Occurrence) else None
            self.state.sent = (*self.state.sent, (self._now, Send(name, message=message)))

    def _arrived(self) -> list[Event | Message]:
        """The events on their way that arrive now, the earliest first."""
        arrived = sorted((one for one in self.state.sent if self._reached(one[0])), key=lambda one: one[0])
        if arrived:
            self.state.sent = tuple(one for one in self.state.sent if not self._reached(one[0]))
        for _, send in arrived:
            if send.target is not None:
                self._deliver(send)
        return [send.message or send.event for _, send in arrived if send.target is None]

    # Charts that this one has invoked.

    def _invoke(self) -> None:
        """Begin the charts of the states that were entered and not left since."""
        for state in sorted(self._invoking):
            for one in self.chart.model.states[state].invokes:
                invoked = one.begin(self._memo, self.state.configuration.active, self._queue)
                if invoked is not None:
                    self._begin(state, invoked)
        self._invoking.clear()

    def _leave_invoked(self, plan: Plan) -> None:
        """End the charts of the states that a microstep leaves, and note those of the states that it enters."""
        states = self.chart.model.states
        self._invoking.difference_update(plan.exited)
        self._invoking.update(one for one in plan.entered if states[one].invokes)
        if plan.exited and self.state.sessions:
            self._put_sessions(tuple(one for one in self.state.sessions if one.source not in plan.exited))

    def _begin(self, state: int, invoked: Invoked) -> None:
        """Enter an invoked chart."""
        if len(self.state.sessions) >= MOST_SESSIONS:
            reason = f"more than {MOST_SESSIONS} charts are invoked"
            raise MachineFault(reason, self.chart.model.states[state].name, None)
        chart = self.chart.invoked(invoked.model)
        self.state.invoked += 1
        name = f"{self._session_name}.{self.state.invoked}"
        first = chart.model.store
        if first is not None:
            around = frozenset(("#_parent", f"#_scxml_{self._session_name}"))
            first = replace(first, given=invoked.data, session=name, reachable=around)
        plan = chart.planner.start()
        begun = RunState(plan.target, chart.generator.first_values(()), {}, (), {}, None, store=first)
        session = Session(invoked.identifier, name, chart, begun, state, invoked.autoforward, invoked.finalize)
        self._put_sessions((*self.state.sessions, session))
        self._stepped.add(name)
        execution = self._inner(session)
        execution.start(plan)
        self._take_over(session, execution)

    def _inner(self, session: Session[RunState]) -> MacrostepExecution:
        return MacrostepExecution(session.chart, session.state, self._time, facts=self._facts, memo={}, hits=set())

    def _run_sessions(self) -> bool:
        """Let invoked charts handle what they were sent; whether this one has more to do then."""
        for session in self.state.sessions:
            due = session.inbox or session.name not in self._stepped
            if due and not session.ended and session in self.state.sessions:
                self._stepped.add(session.name)
                execution = self._inner(session)
                execution.run(session.inbox)
                self._take_over(replace(session, inbox=()), execution)
        return bool(self._external) or any(one.inbox for one in self.state.sessions)

    def _take_over(self, session: Session[RunState], execution: MacrostepExecution) -> None:
        """Adopt what an invoked chart has done, and hand its events on."""
        ended = execution.state.outcome is not None
        if ended:
            execution.leave()
        after = replace(session, state=execution.state, ended=ended, autoforward=session.autoforward and not ended)
        self._put_sessions(tuple(after if one.name == session.name else one for one in self.state.sessions))
        for target, message in execution.outbox:
            told = replace(message, invokeid=session.identifier)
            if target in ("#_parent", f"#_scxml_{self._session_name}"):
                self._external.append(told)
            else:
                self._deliver(Send(message.name, message=told, target=target))
        if ended:
            store = execution.state.store
            result = store.results.get(0) if store is not None else None
            done = f"done.invoke.{session.identifier}"
            self._external.append(Message(done, "external", result, invokeid=session.identifier))

    @property
    def _session_name(self) -> str:
        store = self._memo.get(STORE)
        return (store.session if store is not None else None) or self.chart.name

    def leave(self) -> None:
        """Run the exit actions of all active states of a chart that has ended, from the inside out."""
        queue: list[Any] = []
        for index in sorted(self.state.configuration.active, reverse=True):
            block = self.chart.generator.actions(index, Occasion.EXIT, self.chart.model.states[index].exit)
            if block is not None:
                arguments = (self._facts, self._memo, self.state.values, self.state.configuration.active)
                block.run(*arguments, queue, self.state.timers, self._now)
        for entry in queue:
            if isinstance(entry, Send) and entry.target is not None and entry.delay <= 0:
                self._deliver(entry)
        self.state.store = self._memo.get(STORE)

    def _deliver(self, send: Send) -> None:
        """Send an event to another session: one that this one has invoked, or one around it."""
        assert send.target is not None, "events for the chart itself go another way"
        message = send.message if isinstance(send.message, Message) else Message(send.event)
        for number, session in enumerate(self.state.sessions):
            if send.target in session.targets:
                sessions = list(self.state.sessions)
                sessions[number] = replace(session, inbox=(*session.inbox, message))
                self.state.sessions = tuple(sessions)
                return
        self.outbox.append((send.target, message))

    def _forward(self, entry: Event | Message | PendingFault) -> None:
        """Before an event is handled: what the chart it comes from is finalized with, and copies for the others."""
        if isinstance(entry, PendingFault | StateEvent) or STORE not in self._memo:
            return
        self._bind(entry)
        event: Message = self._memo[STORE].event
        for session in self.state.sessions:
            if session.finalize is not None and event.invokeid == session.identifier:
                session.finalize(self._memo, self.state.configuration.active, self._queue)
        self.state.sessions = tuple(
            replace(one, inbox=(*one.inbox, event)) if one.autoforward else one
            for one in self.state.sessions
            if not (one.ended and event.name == f"done.invoke.{one.identifier}" and event.invokeid == one.identifier)
        )

    def _put_sessions(self, sessions: tuple[Session[RunState], ...]) -> None:
        """Other sessions run now; the chart's data knows which can be reached."""
        self.state.sessions = sessions
        store = self._memo.get(STORE)
        if store is not None:
            outer = () if store.session is None else ("#_parent", f"#_scxml_{store.session.rpartition('.')[0]}")
            targets = (one for session in sessions for one in session.targets)
            self._memo[STORE] = replace(store, reachable=frozenset((*outer, *targets)))

    def _handle(self, entry: Event | Message | PendingFault) -> bool:
        """Let one event fire what it can; whether there was anything."""
        if STORE in self._memo:
            self._bind(entry)
        event = _event(entry)
        declared = self.chart.model.data_of(event.name) if isinstance(event, Occurrence) else None
        if declared is None or not isinstance(event, Occurrence):
            return self._let_fire(entry, event)
        # What the event carries is among the variables for as long as it is handled.
        carried = {declared.variable(part): event.data[part.name] for part in declared.fields}
        self._put(carried)
        fired = self._let_fire(entry, event)
        self._put(dict.fromkeys(carried))
        return fired

    def _put(self, carried: Mapping[str, Any]) -> None:
        """Give slots other values; the old list stays as it is, for the record."""
        values = self.state.values[:]
        for name, value in carried.items():
            values[self.chart.generator.variables[name]] = value
        self.state.values = values

    def _let_fire(self, entry: Event | Message | PendingFault, event: Event) -> bool:
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

    def _time_outs(self, due: frozenset[int]) -> None:
        for _ in range(SPIN):
            after = self.state.configuration.after
            if self.state.outcome is not None or after is None or not self._fire(after, Phase.AFTER, due):
                return
            plan = self.selections[-1].plan
            due = due.difference((*plan.disarmed, *plan.transitions) if plan else ())
            self._run_to_stability()
            self._drain()
        raise self._spin()

    def _conditions(self) -> None:
        for _ in range(SPIN):
            if self.state.outcome is not None:
                return
            when = self.state.configuration.when
            if when is None:
                return
            if not self._fire(when, Phase.WHEN) and not self._queue:
                self.selections.pop()  # the last look, which finds nothing, is part of every macrostep
                return
            self._run_to_stability()
            self._drain()
        raise self._spin()

    def _selection(self, trigger: Phase | Event, due: frozenset[int], plan: Plan | None) -> Selection:
        return Selection(trigger, self.state.configuration, self.state.values, due, plan)

    def _watch(self) -> None:
        """Let the time of conditions begin that hold now, and end of those that do not."""
        for _ in range(SPIN):
            state = self.state
            if state.outcome is not None or not (state.configuration.held or state.acted):
                return
            for index in state.configuration.held:
                self._watch_one(index)
            if not self._found:
                return
            found, self._found = self._found, []
            for fault in found:
                self._handle(fault)
            self._run_to_stability()
            self._drain()
            self._conditions()
        raise self._spin()

    def _watch_one(self, index: int) -> None:
        trigger = self.chart.model.transitions[index].trigger
        assert isinstance(trigger, Held), "nothing else is watched"
        state, holds = self.state, False
        try:
            evaluation = self._evaluation()
            holds = bool(evaluation.condition(trigger.condition))
            length = duration(evaluation.value(trigger.duration)) if holds else 0
        except Exception as error:
            self._report(index, error)
            holds = False
        finally:
            self._error = None
        if not holds:
            state.timers = {one: due for one, due in state.timers.items() if one != index}
            state.acted -= {index}
        elif index not in state.timers and index not in state.acted:
            state.timers = {**state.timers, index: self._now + length}

    def _record(self, trigger: Phase | Event, due: frozenset[int], plan: Plan | None) -> None:
        self.selections.append(self._selection(trigger, due, plan))

    def _fire(self, selector: Selector, trigger: Phase | Event, due: frozenset[int] = NOTHING_DUE) -> bool:
        """Take what a selector picks; whether there was anything."""
        picked = self._pick(selector, due if trigger is Phase.AFTER else None)
        while self._found:
            # A fault comes before all else: it is handled first, then there is another look at what is left to do.
            found, self._found = self._found, []
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
        if self._error is None and not self._failed and not self._undone:
            state = self.state
            arguments = (self._facts, self._memo, state.values, state.configuration.active, self._hits)
            try:
                return selector.pick(*arguments) if due is None else selector.pick(*arguments, due)
            except Exception as error:
                self._error = error
        return self._pick_carefully(selector, due)

    def _take(self, trigger: Phase | Event, due: frozenset[int], plan: Plan) -> None:
        """Do what a microstep asks for; old values stay untouched for the record."""
        self._moved = self._moved or bool(plan.exited or plan.entered)
        if self.chart.invokes:
            self._leave_invoked(plan)
        if plan.plain:
            self._record(trigger, due, plan)
            self.state.configuration = plan.target
            return
        work = _Work(self.state.values, self.state.timers, [])
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
                if block in self._left_out:
                    continue
                try:
                    block.run(self._facts, self._memo, work.values, active, work.raised, work.timers, self._now)
                except Exception as error:
                    if plan.source is not None:
                        self._record(trigger, due, None)
                    self._undo(plan, before, block, error)
                    return
                if plan.source is None and block.state == 0:
                    before = work.copy()  # the machine itself is entered once and for all
        self._record(trigger, due, plan)
        state = self.state
        state.configuration = plan.target
        state.values, state.timers = work.values, work.timers
        if plan.acted or state.acted:
            state.acted = state.acted.difference(plan.disarmed).union(plan.acted)
        self._put_out(work.raised)
        if plan.remembered:
            state.history = {**state.history, **dict(plan.remembered)}
        self.stopped.extend(plan.stopped)
        state.outcome = plan.outcome or state.outcome

    def _put_out(self, raised: Iterable[Event | Message | Send | Emission | Cancel]) -> None:
        """Queue what was raised; what is for other machines is sent at once, also when this one has ended."""
        for entry in raised:
            if isinstance(entry, Emission):
                self._emit(entry)
            elif isinstance(entry, Send) and entry.target is not None and entry.delay <= 0:
                self._deliver(entry)
            else:
                self._queue.append(entry)

    # When something goes wrong.

    def _undo(self, plan: Plan, before: _Work, block: Block, error: Exception) -> None:
        """Let a transition handle a microstep whose action failed; nothing of the microstep was done.

        What failed is not tried again in this step: neither the transitions nor, where a state could not be left, its
        exit actions.
        """
        state, fault = self.state, self._action_failed(block, error)
        if plan.source is None:
            if block.state == 0:
                raise fault.unhandled(self.chart)
            state.configuration = self.chart.configuration(())
            state.values, state.timers = before.values, before.timers
            self._put_out(before.raised)
        self._undone.update(plan.transitions)
        if block.role is Occasion.EXIT:
            self._left_out.add(block)
        handler = self._handler(fault, plan)
        if handler is None:
            raise fault.unhandled(self.chart)
        self._take(fault.event, NOTHING_DUE, self.chart.planner.plan(state.configuration, handler, state.history))

    def _handler(self, fault: PendingFault, plan: Plan) -> int | None:
        """The transition that handles a failed action.

        That is one of the state whose action it is, be it not entered yet, of the states around it, or of those that
        the failed transitions belong to.
        """
        topology, model = self.chart.topology, self.chart.model
        sources = [model.transitions[index].source for index in plan.transitions]
        origin = fault.event.origin
        states = dict.fromkeys(one for start in (origin, *sources) for one in topology.up(start))
        evaluation = self._evaluation()
        for state in sorted(states, reverse=True):
            for index in model.states[state].transitions:
                trigger = model.transitions[index].trigger
                waits = isinstance(trigger, On) and matches(trigger, fault.event, origin, origin)
                if not waits or index in self._undone:
                    continue
                decision = self.chart.generator.decision(index)
                try:
                    held, path = decision.follow(evaluation.condition)
                except Exception:
                    continue
                if decision.conditions:
                    self._hits.add((index, path))
                if held:
                    return index
        return None

    def _evaluation(self) -> Evaluation:
        state = self.state
        return self.chart.generator.evaluation(self._memo, state.values, state.configuration.active, self._ask)

    def _pick_carefully(self, selector: Selector, due: frozenset[int] | None) -> Picked:
        """What a selector picks when something has failed in this step.

        A guard that needs a failed signal counts as false, and a transition that was undone is not tried again.
        """
        generator, evaluation = self.chart.generator, self._evaluation()
        found: list[int] = []
        for chain in selector.chains:
            for index in chain.candidates:
                if index in self._undone or (due is not None and index not in due):
                    continue
                decision = generator.decision(index)
                try:
                    held, path = decision.follow(evaluation.condition)
                except Exception as error:
                    self._report(index, error)
                    continue
                finally:
                    self._error = None
                if decision.conditions:
                    self._hits.add((index, path))
                if held:
                    if index not in found:
                        found.append(index)
                    break
        return (tuple(found) if len(found) > 1 else found[0]) if found else NONE

    def _ask(self, call: SignalValue) -> Any:
        """Evaluate a signal that was not asked yet; the first of them is the one that has just failed."""
        generator, values = self.chart.generator, self.state.values
        key = generator.key(call, values)
        error = self._failed.get(key)
        if error is None and self._error is not None:
            error, self._error = self._error, None
        if error is None:
            try:
                arguments = generator.arguments(call.arguments)(None, {}, values, ())
                value = self._memo[key] = call.signal.function(self._facts, *arguments)
            except Exception as raised:
                error = raised
            else:
                return value
        self._failed[key] = error
        raise SignalFault(call, error)

    def _report(self, transition: int, error: Exception) -> None:
        """Announce a failed guard, once for each state and cause in a step."""
        declared = self.chart.model.transitions[transition]
        place, cause, reason = declared.place, error, f"the guard failed: {error!r}"
        known: Any = (declared.source, transition)
        if isinstance(error, SignalFault):
            known = (declared.source, self.chart.generator.key(error.call, self.state.values), None)
            place, reason = error.call.place or place, str(error)
            cause = error.__cause__ if isinstance(error.__cause__, Exception) else error
        if STORE in self._memo:
            self._queue.append(Message("error.execution", "platform", reason))
        elif known not in self._reported:
            self._reported.add(known)
            self._found.append(PendingFault(fault_event(declared.source), reason, place, cause))

    def _action_failed(self, block: Block, error: Exception) -> PendingFault:
        place = block.place_of(error) or self.chart.model.states[block.state].place
        return PendingFault(fault_event(block.state), f"an action failed: {error!r}", place, error)

    def _spin(self) -> Spin:
        """The error for an endless step, which names the cycle of transitions at its end."""
        taken: Sequence[tuple[int, ...]] = [one.plan.transitions for one in self.selections if one.plan is not None]
        period = next((n for n in range(1, len(taken) // 2) if taken[-n:] == taken[-2 * n : -n]), len(taken))
        cycle = [self.chart.model.transitions[index] for one in taken[-period:] for index in one]
        names = [self.chart.model.states[one.source].name for one in cycle]
        listed = ", ".join(
            f"{name} ({one.place})" if one.place else name for name, one in zip(names[:8], cycle, strict=False)
        )
        reason = f"transitions follow one another without end within one step, through {listed}"
        return Spin(reason, names[0], cycle[0].place)
