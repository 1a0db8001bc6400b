"""What happened in one step, as a value."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Any

from hsm.events import Event, Scoped
from hsm.model import Action, Transition
from hsm.plans import Plan

if TYPE_CHECKING:
    from hsm.configuration import Configuration


class Phase(Enum):
    """What a machine looks for, where that is not an event."""

    START = "start"
    ALWAYS = "always"
    AFTER = "after"
    WHEN = "when"

    def __str__(self) -> str:
        return self.value


Look = tuple["Phase | Event", "Configuration", Sequence[Any], "frozenset[int]", "Plan | None"]
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


class Macrostep:
    """What one step did: a value that does not change, worked out further when it is asked.

    Two are equal when the same was done at the same time.
    """

    __slots__ = ("_after", "_looks", "_memo", "_time")

    def __init__(self, time: float, looks: Sequence[Look], memo: Mapping[Any, Any], after: Configuration) -> None:
        self._time = time
        self._looks = looks
        self._memo = memo
        self._after = after

    @property
    def time(self) -> float:
        """The logical time of the step in seconds."""
        return self._time

    @property
    def configuration(self) -> frozenset[str]:
        """Full names of all states active after the step."""
        return self._after.names

    @property
    def microsteps(self) -> tuple[Microstep, ...]:
        """What was done, one microstep after the other."""
        model = self._after.machine.model
        return tuple(
            Microstep(
                trigger=str(trigger),
                transitions=tuple(model.transitions[index] for index in plan.transitions),
                exited=tuple(model.states[state].name for state in plan.exited),
                entered=tuple(model.states[state].name for state in plan.entered if state),
                actions=plan.actions,
            )
            for trigger, _, _, _, plan in self._looks
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
        return tuple(str(look[0]) for look in self._looks if isinstance(look[0], str | Scoped) and look[4] is not None)

    @property
    def ignored(self) -> tuple[str, ...]:
        """The events that nothing reacted to, in order."""
        return tuple(str(look[0]) for look in self._looks if isinstance(look[0], str | Scoped) and look[4] is None)

    def __bool__(self) -> bool:
        return any(look[4] is not None for look in self._looks)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Macrostep):
            return NotImplemented
        return (self.time, self.microsteps, self.ignored, self.configuration) == (
            other.time,
            other.microsteps,
            other.ignored,
            other.configuration,
        )

    def __hash__(self) -> int:
        return hash((self._time, self.configuration))

    def __repr__(self) -> str:
        done = "; ".join(
            f"{one.trigger}: left {', '.join(one.exited) or 'nothing'}, entered {', '.join(one.entered) or 'nothing'}"
            for one in self.microsteps
        )
        return f"<Macrostep at {self._time:.10g} s: {done or 'nothing taken'}>"
