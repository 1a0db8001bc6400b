"""What happened in one step, as a value."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from hsm.engine.configuration import Plan
from hsm.engine.explanation import Considered, explain, idle
from hsm.engine.record import Phase, RawRecord, Selection, StepRecord, record_of, took_something
from hsm.model.chart import Action, Model, Transition
from hsm.model.events import Event, StateEvent
from hsm.model.messages import Occurrence
from hsm.model.values import dataclass


@dataclass(frozen=True, slots=True)
class Microstep:
    """One set of transitions taken together.

    Attributes:
        trigger: the event's name, or ``start``, ``always``, ``after`` or ``when``.
        transitions: the transitions taken, in order.
        exited: full names of the states left, in order.
        entered: full names of the states entered, in order.
        actions: the actions run, in order.
    """

    trigger: str
    transitions: tuple[Transition, ...]
    exited: tuple[str, ...]
    entered: tuple[str, ...]
    actions: tuple[Action, ...]


class Macrostep:
    """The record of one step: an immutable value; details are computed on demand.

    Two records are equal if their steps did the same at the same time. A record is true if the step did anything.

    Attributes:
        raw: the recorded data; everything else is computed from it.
        sending: the events that it has sent to other machines; not set if there are none. See ``sent``.
    """

    # One is made every tick, which itself takes less than a microsecond: what the step records is set from
    # outside, without names, which is a quarter faster than an __init__.
    __slots__ = ("raw", "sending")

    raw: RawRecord
    sending: tuple[str | Occurrence, ...]

    @property
    def time(self) -> float:
        """The logical time of the step in seconds."""
        return self.raw[0]

    @property
    def configuration(self) -> frozenset[str]:
        """Full names of all states active after the step."""
        return self.record.after.names

    @property
    def record(self) -> StepRecord:
        """The recorded data of the step."""
        return record_of(self.raw)

    @property
    def selections(self) -> tuple[Selection, ...]:
        """The selections of the step, except for the last one, which took nothing."""
        return tuple(self.record.selections)

    @property
    def microsteps(self) -> tuple[Microstep, ...]:
        """The microsteps of the step, in order."""
        model = self._model
        return tuple(_microstep(model, one.trigger, one.plan) for one in self.selections if one.plan is not None)

    def begun(self, count: int) -> Macrostep:
        """The same step up to some of its microsteps: what they did, and the states after them.

        Args:
            count: the number of microsteps.
        """
        fired = [number for number, one in enumerate(self.selections) if one.plan is not None]
        if count >= len(fired):
            return self
        upcoming = self.selections[fired[count]]
        step = Macrostep()
        step.raw = self.record._replace(
            selections=self.selections[: fired[count]], values=None, timers={}, after=upcoming.configuration
        )
        return step

    @property
    def transitions(self) -> tuple[Transition, ...]:
        """All transitions taken, in order."""
        return tuple(transition for one in self.microsteps for transition in one.transitions)

    @property
    def exited(self) -> tuple[str, ...]:
        """Full names of all states left, in order; a state that was left twice appears twice."""
        return tuple(name for one in self.microsteps for name in one.exited)

    @property
    def entered(self) -> tuple[str, ...]:
        """Full names of all states entered, in order; a state that was entered twice appears twice."""
        if not took_something(self.raw):
            return ()
        return tuple(name for one in self.microsteps for name in one.entered)

    @property
    def actions(self) -> tuple[Action, ...]:
        """All actions run, in order."""
        return tuple(action for one in self.microsteps for action in one.actions)

    @property
    def handled(self) -> tuple[str, ...]:
        """The events that made a transition fire, in order."""
        return tuple(str(one.trigger) for one in self._events() if one.plan is not None and not one.plan.kept)

    @property
    def deferred(self) -> tuple[str, ...]:
        """The events that were deferred until another state is active, in order; one may be listed several times."""
        return tuple(str(one.trigger) for one in self._events() if one.plan is not None and one.plan.kept)

    @property
    def sent(self) -> tuple[str | Occurrence, ...]:
        """The events that were sent to other machines, in order, with their data."""
        return getattr(self, "sending", ())

    @property
    def ignored(self) -> tuple[str, ...]:
        """The events to which no transition reacted, in order."""
        return tuple(str(one.trigger) for one in self._events() if one.plan is None)

    @property
    def considered(self) -> tuple[Considered, ...]:
        """Every transition that was considered, with its verdict and the reason.

        It is computed from the recorded signals and variables of the step, so the time of the call does not matter.
        """
        return explain(self.record)

    @property
    def verdicts(self) -> tuple[Considered, ...]:
        """``considered``, and the transitions of the active states that the step had no reason to consider."""
        considered = self.considered
        return (*considered, *idle(self.record, considered))

    def why(self, state: str) -> tuple[Considered, ...]:
        """The verdicts about the transitions of one state, with reasons.

        Args:
            state: its full name.
        """
        model = self._model
        return tuple(one for one in self.verdicts if model.states[one.transition.source].name == state)

    @property
    def _model(self) -> Model:
        return self.record.after.topology.model

    def _events(self) -> Iterator[Selection]:
        return (one for one in self.selections if isinstance(one.trigger, str | Occurrence | StateEvent))

    def _said(self) -> tuple[Any, ...]:
        return self.time, self.microsteps, self.ignored, self.sent, self.configuration

    def __bool__(self) -> bool:
        return any(one.plan is not None for one in self.selections)

    def __eq__(self, other: object) -> bool:
        return self._said() == other._said() if isinstance(other, Macrostep) else NotImplemented

    def __hash__(self) -> int:
        return hash((self.time, self.configuration))

    def __repr__(self) -> str:
        done = "; ".join(
            f"{one.trigger}: left {', '.join(one.exited) or 'nothing'}, entered {', '.join(one.entered) or 'nothing'}"
            for one in self.microsteps
        )
        return f"<Macrostep at {self.time:.10g} s: {done or 'nothing taken'}>"


def _microstep(model: Model, trigger: Phase | Event, plan: Plan) -> Microstep:
    return Microstep(
        trigger=str(trigger),
        transitions=tuple(model.transitions[index] for index in plan.transitions),
        exited=tuple(model.states[state].name for state in plan.exited),
        entered=tuple(model.states[state].name for state in plan.entered if state),
        actions=plan.actions,
    )
