"""Where a machine is within a step, and what comes next."""

from __future__ import annotations

from dataclasses import dataclass, field

from hsm.model.events import Event
from hsm.testing.proofs.diagrams import Diagram
from hsm.testing.proofs.values import Value


@dataclass(frozen=True, slots=True)
class Timer:
    """A time-out that runs.

    Attributes:
        transition: its index.
        least: its duration in nanoseconds, at least.
        most: at most.
        due: whether its time had come in an earlier step or has come in this one.
        fresh: whether it began in this step.
    """

    transition: int
    least: int
    most: int
    due: bool = False
    fresh: bool = False


@dataclass(frozen=True, slots=True)
class Point:
    """Where a step is.

    Attributes:
        leaves: the active atomic states.
        history: what each history state remembers.
        over: states whose activity has ended.
        timers: the time-outs that run.
        values: the variables.
        entered: the states that were entered in this step, as far as anybody asks.
        outcome: how the run ended, or None.
    """

    leaves: tuple[int, ...]
    history: tuple[tuple[int, tuple[int, ...]], ...]
    over: frozenset[int]
    timers: tuple[Timer, ...]
    values: tuple[Value, ...]
    entered: frozenset[int] = frozenset()
    outcome: str | None = None
    _hash: int = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        # Points are looked up many times, and each time all that is in them would be hashed.
        own = (self.leaves, self.history, self.over, self.timers, self.values, self.entered, self.outcome)
        object.__setattr__(self, "_hash", hash(own))

    def __hash__(self) -> int:
        return self._hash


@dataclass(frozen=True, slots=True)
class Stage:
    """What a step does next.

    Attributes:
        number: 0 outcomes, 1 events from outside, 2 time-outs, 3 conditions, 4 nothing more.
        reports: the activities that may report something, from this one on.
        due: the time-outs that are due and have not been looked at.
    """

    number: int
    reports: tuple[int, ...] = ()
    due: frozenset[int] = frozenset()


Place = tuple[Stage, Point, tuple[Event, ...]]
"""A point with what comes next and the events that wait in the machine's own queue."""

Label = tuple[str, str, str] | None
"""An outcome (``report``, state, outcome) or an event (``event``, name, empty) that was heard, or None."""


@dataclass(frozen=True, slots=True)
class FailingStep:
    """A step that cannot be done.

    Attributes:
        place: within the step.
        among: the signals for which it fails.
        label: the outcome or event that is heard there.
    """

    place: Place
    among: Diagram
    label: Label


ENDED = Stage(4)

SETTLING = Stage(5)
"""The start: only what follows by itself."""
