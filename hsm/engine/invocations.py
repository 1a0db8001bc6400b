"""Invoked charts within a step: begin them, end them, and forward their events."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import replace
from typing import Any, Protocol

from hsm.engine.compiled import CompiledChart
from hsm.engine.configuration import Plan
from hsm.engine.run_state import PendingFault, RunState
from hsm.engine.sessions import MOST_SESSIONS, InvokedChart
from hsm.model.chart import Cancel, Invoked, Send
from hsm.model.events import Event, StateEvent
from hsm.model.faults import MachineFault
from hsm.model.messages import STORE, Adjustment, ScxmlEvent


class InvokingStep(Protocol):
    """The step of a chart that may invoke others.

    Attributes:
        chart: the chart.
        state: the state of its run, as far as the step has come.
        memo: the signals evaluated, and the data of the chart.
        queue: events of the chart's own that are to be handled.
        external: events from outside that are to be handled.
        outbox: events for sessions that this one does not run, each with its target.
    """

    chart: CompiledChart
    state: RunState
    memo: dict[Any, Any]
    queue: deque[Event | ScxmlEvent | PendingFault | Send | Cancel]
    external: deque[Event | ScxmlEvent | PendingFault | Adjustment]
    outbox: list[tuple[str, ScxmlEvent]]

    def inner(self, session: InvokedChart[RunState]) -> InvokingStep:
        """A step of an invoked chart at the same time."""

    def start(self, plan: Plan) -> None:
        """Enter the initial configuration."""

    def run(self, events: Iterable[Event | ScxmlEvent | PendingFault]) -> None:
        """Handle events, then conditions."""

    def leave(self) -> None:
        """Run the exit actions of a chart that has ended."""

    def bind(self, entry: Event | ScxmlEvent | PendingFault) -> None:
        """Make an event the chart's ``_event``."""


class Invocations:
    """The invoked charts of one step.

    Args:
        step: the step.
    """

    def __init__(self, step: InvokingStep) -> None:
        self._step = step
        self._entered: set[int] = set()
        self._stepped: set[str] = set()

    @property
    def waiting(self) -> bool:
        """Whether states were entered whose charts are still to begin."""
        return bool(self._entered)

    def begin(self) -> None:
        """Begin the charts of the states that were entered and not left since."""
        for state in sorted(self._entered):
            for one in self._step.chart.model.states[state].invokes:
                invoked = one.begin(self._step.memo, self._step.state.configuration.active, self._step.queue)
                if invoked is not None:
                    self._begin(state, invoked)
        self._entered.clear()

    def follow(self, plan: Plan) -> None:
        """End the charts of the states that a microstep leaves, and note those of the states that it enters."""
        states = self._step.chart.model.states
        self._entered.difference_update(plan.exited)
        self._entered.update(one for one in plan.entered if states[one].invokes)
        if plan.exited and self._step.state.sessions:
            self._put_sessions(tuple(one for one in self._step.state.sessions if one.source not in plan.exited))

    def _begin(self, state: int, invoked: Invoked) -> None:
        """Enter an invoked chart."""
        if len(self._step.state.sessions) >= MOST_SESSIONS:
            reason = f"more than {MOST_SESSIONS} charts are invoked"
            raise MachineFault(reason, self._step.chart.model.states[state].name, None)
        chart = self._step.chart.invoked(invoked.model)
        self._step.state.invoked += 1
        name = f"{self._name}.{self._step.state.invoked}"
        first = chart.model.store
        if first is not None:
            around = frozenset(("#_parent", f"#_scxml_{self._name}"))
            first = replace(first, given=invoked.data, session=name, reachable=around)
        plan = chart.planner.start()
        begun = RunState(plan.target, chart.generator.first_values(()), {}, (), {}, None, store=first)
        session = InvokedChart(invoked.identifier, name, chart, begun, state, invoked.autoforward, invoked.finalize)
        self._put_sessions((*self._step.state.sessions, session))
        self._stepped.add(name)
        execution = self._step.inner(session)
        execution.start(plan)
        self._take_over(session, execution)

    def run(self) -> bool:
        """Let invoked charts handle their events; return whether this chart has more to do."""
        for session in self._step.state.sessions:
            due = session.inbox or session.name not in self._stepped
            if due and not session.ended and session in self._step.state.sessions:
                self._stepped.add(session.name)
                execution = self._step.inner(session)
                execution.run(session.inbox)
                self._take_over(replace(session, inbox=()), execution)
        return bool(self._step.external) or any(one.inbox for one in self._step.state.sessions)

    def _take_over(self, session: InvokedChart[RunState], execution: InvokingStep) -> None:
        """Adopt the step of an invoked chart, and forward its events."""
        ended = execution.state.outcome is not None
        if ended:
            execution.leave()
        after = replace(session, state=execution.state, ended=ended, autoforward=session.autoforward and not ended)
        self._put_sessions(tuple(after if one.name == session.name else one for one in self._step.state.sessions))
        for target, message in execution.outbox:
            told = replace(message, invokeid=session.identifier)
            if target in ("#_parent", f"#_scxml_{self._name}"):
                self._step.external.append(told)
            else:
                self.deliver(Send(message.name, message=told, target=target))
        if ended:
            store = execution.state.store
            result = store.results.get(0) if store is not None else None
            done = f"done.invoke.{session.identifier}"
            self._step.external.append(ScxmlEvent(done, "external", result, invokeid=session.identifier))

    @property
    def _name(self) -> str:
        store = self._step.memo.get(STORE)
        return (store.session if store is not None else None) or self._step.chart.name

    def deliver(self, send: Send) -> None:
        """Send an event to another session: one that this one has invoked, or one around it."""
        assert send.target is not None, "events for the chart itself go another way"
        message = send.message if isinstance(send.message, ScxmlEvent) else ScxmlEvent(send.event)
        for number, session in enumerate(self._step.state.sessions):
            if send.target in session.targets:
                sessions = list(self._step.state.sessions)
                sessions[number] = replace(session, inbox=(*session.inbox, message))
                self._step.state.sessions = tuple(sessions)
                return
        self._step.outbox.append((send.target, message))

    def forward(self, entry: Event | ScxmlEvent | PendingFault) -> None:
        """Before an event is handled: run `finalize` of the chart that sent it, and forward copies to the others."""
        if isinstance(entry, PendingFault | StateEvent) or STORE not in self._step.memo:
            return
        self._step.bind(entry)
        event: ScxmlEvent = self._step.memo[STORE].event
        for session in self._step.state.sessions:
            if session.finalize is not None and event.invokeid == session.identifier:
                session.finalize(self._step.memo, self._step.state.configuration.active, self._step.queue)
        self._step.state.sessions = tuple(
            replace(one, inbox=(*one.inbox, event)) if one.autoforward else one
            for one in self._step.state.sessions
            if not (one.ended and event.name == f"done.invoke.{one.identifier}" and event.invokeid == one.identifier)
        )

    def _put_sessions(self, sessions: tuple[InvokedChart[RunState], ...]) -> None:
        """The set of sessions has changed; update the reachable ones in the chart's data."""
        self._step.state.sessions = sessions
        store = self._step.memo.get(STORE)
        if store is not None:
            outer = () if store.session is None else ("#_parent", f"#_scxml_{store.session.rpartition('.')[0]}")
            targets = (one for session in sessions for one in session.targets)
            self._step.memo[STORE] = replace(store, reachable=frozenset((*outer, *targets)))
