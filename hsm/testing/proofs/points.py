"""The position of a machine within a step, and what comes next."""

from __future__ import annotations

from dataclasses import field, replace
from enum import IntEnum

from hsm.model.events import Event
from hsm.model.registry import SignalDeclaration
from hsm.model.values import dataclass
from hsm.testing.proofs.diagrams import Diagram
from hsm.testing.proofs.values import Value
from hsm.testing.proofs.zones import Clock

NEVER = 1 << 60
"""In nanoseconds: longer than any run."""


@dataclass(frozen=True, slots=True)
class Timer:
    """A time-out that runs, or an event on its way.

    Attributes:
        transition: its index; of an event on its way the number of the action that sent it, negative.
        least: its duration in nanoseconds, at least.
        most: at most.
        clock: what measures its time: the state, for those that run from its entry on, or one of its own.
        due: whether its time had come in an earlier step or has come in this one.
        fresh: whether it began in this step.
        beats: whether it was due in this step and continues to its next time.
    """

    transition: int
    least: int
    most: int
    clock: Clock
    due: bool = False
    fresh: bool = False
    beats: bool = False


Remembered = tuple[tuple[int, tuple[int, ...]], ...]
"""What each history state remembers, by the number of its state."""


@dataclass(frozen=True, slots=True)
class CarriedEvent:
    """An event with its data.

    Attributes:
        name: the event's name.
        values: what it carries, in the order of its declaration; None for a value that may be anything.
    """

    name: str
    values: tuple[Value | None, ...]


@dataclass(frozen=True, slots=True)
class AnyOf:
    """Events of some names, any number of them in any order."""

    names: frozenset[str]


Waiting = tuple[str | CarriedEvent | AnyOf, ...]
"""Events that wait."""

Queued = Event | CarriedEvent
"""An event in the machine's own queue."""


@dataclass(frozen=True, slots=True)
class Point:
    """The position within a step.

    Attributes:
        leaves: the active atomic states.
        history: what each history state remembers.
        over: states whose activity has ended.
        timers: the time-outs that run.
        values: the variables.
        acted: conditions that have held long enough, by transition: they wait until they are false.
        entered: the states that were entered in this step, as far as needed.
        outcome: how the run ended, or None.
        deferred: events that wait for another state.
        pending: events that members have sent to one another; they arrive in the next step.
    """

    leaves: tuple[int, ...]
    history: Remembered
    over: frozenset[int]
    timers: tuple[Timer, ...]
    values: tuple[Value, ...]
    acted: frozenset[int] = frozenset()
    entered: frozenset[int] = frozenset()
    outcome: str | None = None
    deferred: Waiting = ()
    pending: Waiting = ()
    _hash: int = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        # Points are looked up many times, and each time all that is in them would be hashed.
        own = (self.leaves, self.history, self.over, self.timers, self.values, self.acted, self.entered, self.outcome)
        object.__setattr__(self, "_hash", hash((own, self.deferred, self.pending)))

    def __hash__(self) -> int:
        return self._hash

    def with_values(self, values: tuple[Value, ...]) -> Point:
        """The same with other values of the variables."""
        return replace(self, values=values)


class Part(IntEnum):
    """The parts of a step, in order."""

    ARRIVALS = 0
    REPORTS = 1
    OUTSIDE = 2
    TIME_OUTS = 3
    CONDITIONS = 4
    WATCH = 5
    END = 6
    SETTLING = 7


@dataclass(frozen=True, slots=True)
class Stage:
    """The next part of a step.

    Attributes:
        part: of the step.
        reports: the activities that may report something, from this one on.
        left: those of them whose state was left in this step: what runs there now is another one.
        due: the time-outs that are due and have not been examined.
        held: the conditions that are watched for some time and have not been examined, by transition.
        heard: the name of an event whose data is among the values: it is handled first; empty for none.
        recalled: events that are handled before those of this part.
        moved: whether a state was left or entered since deferred events were recalled; only where events are deferred.
    """

    part: Part
    reports: tuple[int, ...] = ()
    left: frozenset[int] = frozenset()
    due: frozenset[int] = frozenset()
    held: tuple[int, ...] = ()
    heard: str = ""
    recalled: Waiting = ()
    moved: bool = False


Place = tuple[Stage, Point, tuple[Queued, ...]]
"""A point with what comes next and the events that wait in the machine's own queue."""

Label = tuple[str, str, str] | None
"""An outcome (``report``, state, outcome) or an event (``event``, name, empty) that was heard, or None.

An event that waited is ``recalled`` where its number is not known.
"""


@dataclass(frozen=True, slots=True)
class FailingStep:
    """A step that fails.

    Attributes:
        place: within the step.
        among: the signals for which it fails.
        label: the outcome or event that is heard there.
    """

    place: Place
    among: Diagram
    label: Label


@dataclass(frozen=True, slots=True)
class Loose:
    """What the parts of a machine that are not followed may do to the others, at any moment of a step.

    Attributes:
        signals: they replace what those parts decide; each may change between two microsteps.
        events: what those parts raise.
    """

    signals: tuple[SignalDeclaration, ...] = ()
    events: tuple[str, ...] = ()


NOTHING_LOOSE = Loose()

ENDED = Stage(Part.END)

SETTLING = Stage(Part.SETTLING)
"""The start: only reactions without input."""
