"""What happened in one step, as a value."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from operator import itemgetter
from typing import TYPE_CHECKING, Any

from hsm.engine.plans import Plan
from hsm.model.chart import Action, Transition
from hsm.model.events import Event, Scoped

if TYPE_CHECKING:
    from hsm.engine.configuration import Configuration
    from hsm.engine.explanation import Considered


class Phase(Enum):
    """What a machine looks for, where that is not an event."""

    START = "start"
    ALWAYS = "always"
    AFTER = "after"
    WHEN = "when"

    def __str__(self) -> str:
        return self.value


Look = tuple["Phase | Event", "Configuration", Sequence[Any], frozenset[int], Plan | None]
"""One look at the transitions for one trigger: the trigger, the configuration, the variables, the due time-outs, and
what was done."""

NOTHING_DUE: frozenset[int] = frozenset()


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


Evidence = tuple[
    float, Sequence[Look | Plan], Mapping[Any, Any], Sequence[Any] | None, Mapping[int, float], "Configuration"
]
"""What a step leaves behind: its time; its looks (a plan alone was fired by conditions, with the last variables); the
signals evaluated; the variables at the last look for conditions, which found none to hold and is not among the looks
(None where there was no such look); the deadlines of time-outs; the configuration afterwards."""


class Macrostep:
    """What one step did: a value that does not change, worked out further when it is asked.

    Two are equal when the same was done at the same time. As a truth value: whether anything was done.

    Attributes:
        evidence: what the step leaves behind; everything else is worked out from it.
    """

    # One is made every tick, which itself takes less than a microsecond: what the step leaves behind is set from
    # outside, as it is, which is a quarter faster than an __init__.
    __slots__ = ("evidence",)

    evidence: Evidence

    @property
    def time(self) -> float:
        """The logical time of the step in seconds."""
        return self.evidence[0]

    @property
    def configuration(self) -> frozenset[str]:
        """Full names of all states active after the step."""
        return self.evidence[5].names

    @property
    def looks(self) -> tuple[Look, ...]:
        """The looks in full, but for the last one."""
        _, looks, _, values, _, after = self.evidence
        return tuple(
            (Phase.WHEN, look.source or after, values or (), NOTHING_DUE, look) if isinstance(look, Plan) else look
            for look in looks
        )

    @property
    def microsteps(self) -> tuple[Microstep, ...]:
        """What was done, one microstep after the other."""
        model = self.evidence[5].machine.model
        return tuple(
            Microstep(
                trigger=str(trigger),
                transitions=tuple(model.transitions[index] for index in plan.transitions),
                exited=tuple(model.states[state].name for state in plan.exited),
                entered=tuple(model.states[state].name for state in plan.entered if state),
                actions=plan.actions,
            )
            for trigger, _, _, _, plan in self.looks
            if plan is not None
        )

    @property
    def transitions(self) -> tuple[Transition, ...]:
        """All transitions taken, in order."""
        return tuple(transition for one in self.microsteps for transition in one.transitions)

    @property
    def exited(self) -> tuple[str, ...]:
        """Full names of all states left, in order; a state that was left twice stands twice."""
        return tuple(name for one in self.microsteps for name in one.exited)

    @property
    def entered(self) -> tuple[str, ...]:
        """Full names of all states entered, in order; a state that was entered twice stands twice."""
        return tuple(name for one in self.microsteps for name in one.entered)

    @property
    def actions(self) -> tuple[Action, ...]:
        """All actions run, in order."""
        return tuple(action for one in self.microsteps for action in one.actions)

    @property
    def handled(self) -> tuple[str, ...]:
        """The events that made a transition fire, in order."""
        return tuple(str(look[0]) for look in self._events() if look[4] is not None)

    @property
    def ignored(self) -> tuple[str, ...]:
        """The events that nothing reacted to, in order."""
        return tuple(str(look[0]) for look in self._events() if look[4] is None)

    @property
    def considered(self) -> tuple[Considered, ...]:
        """Every transition that was looked at, with what became of it and why.

        Worked out from the signals and variables of the step, so it is true of the step whenever it is asked.
        """
        from hsm.engine.explanation import explain  # noqa: PLC0415 - only needed on demand

        return explain(self)

    def why(self, state: str) -> tuple[Considered, ...]:
        """What became of the transitions of one state, and why.

        Args:
            state: its full name.
        """
        model = self.evidence[5].machine.model
        return tuple(one for one in self.considered if model.states[one.transition.source].name == state)

    def _events(self) -> list[Look]:
        return [look for look in self.looks if isinstance(look[0], str | Scoped)]

    def _said(self) -> tuple[Any, ...]:
        return self.time, self.microsteps, self.ignored, self.configuration

    def __bool__(self) -> bool:
        return any(map(itemgetter(4), self.looks))

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
