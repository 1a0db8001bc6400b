"""The state of a run, the changes of a microstep, and faults on their way to a handler."""

from __future__ import annotations

from typing import Any

from hsm.engine.clock import waking
from hsm.engine.compiled import CompiledChart
from hsm.engine.configuration import Configuration
from hsm.engine.sessions import InvokedChart
from hsm.model.chart import Cancel, Send
from hsm.model.diagnostics import Place
from hsm.model.events import Event, StateEvent
from hsm.model.faults import MachineFault
from hsm.model.messages import Emission, Occurrence, ScxmlEvent, Store
from hsm.model.topology import Remembered
from hsm.model.values import dataclass


@dataclass(slots=True)
class RunState:
    """The state of a run. Its collections are never modified, only replaced.

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
    sessions: tuple[InvokedChart[RunState], ...] = ()
    invoked: int = 0

    @property
    def wake(self) -> float:
        """A time in seconds before which no time-out and no event on its way is due; infinite when there is none."""
        return waking([*self.timers.values(), *(due for due, _ in self.sent)])


@dataclass(slots=True)
class Work:
    """What the actions of a microstep change: variables, time-outs, and the events that they raise."""

    values: list[Any]
    timers: dict[int, int]
    raised: list[Event | ScxmlEvent | Send | Emission | Cancel]

    def copy(self) -> Work:
        """The same, to continue from."""
        return Work(self.values[:], dict(self.timers), self.raised[:])


@dataclass(frozen=True, slots=True)
class PendingFault:
    """A fault on its way to a transition that handles it."""

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


def event_of(entry: Event | ScxmlEvent | PendingFault) -> Event:
    """The event that transitions wait for, of an occurrence."""
    if isinstance(entry, ScxmlEvent):
        return entry.name
    return entry.event if isinstance(entry, PendingFault) else entry
