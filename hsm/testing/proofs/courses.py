"""The courses of a symbolic step: how one place leads to the next, and with which signals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field

from hsm.engine.configuration import Plan
from hsm.model.values import dataclass
from hsm.testing.proofs.diagrams import Diagram
from hsm.testing.proofs.points import Label, Place
from hsm.testing.proofs.selections import Path as GuardPath

Ways = dict[int, dict[int, Diagram]]
"""From one place to others, by their numbers, each with the signals."""


@dataclass(frozen=True, slots=True)
class Continuation:
    """One way to continue from a place.

    Attributes:
        target: number of the place that it leads to.
        among: the signals.
        label: what is heard.
        plan: the microstep that is done, or None.
        grows: whether a value there would grow without end.
        fresh: symbols that represent something else from there on.
    """

    target: int
    among: Diagram
    label: Label
    plan: Plan | None = None
    grows: bool = False
    fresh: frozenset[int] = frozenset()


@dataclass(frozen=True, slots=True)
class Origin:
    """How a place was reached.

    Attributes:
        place: from where.
        label: what is heard.
        among: the signals for which it is.
        fresh: symbols that represent something else from there on.
    """

    place: Place
    label: Label
    among: Diagram
    fresh: frozenset[int]


@dataclass(frozen=True, slots=True)
class Failing:
    """A course on which something fails.

    Attributes:
        among: the signals.
        label: what is heard.
        states: those that a fault may be handled in or around.
        obstacle: why the proof does not follow the handler.
    """

    among: Diagram
    label: Label
    states: tuple[int, ...]
    obstacle: str


@dataclass(slots=True)
class Expansion:
    """The successors of a place, for all signals."""

    ways: list[Continuation] = field(default_factory=list)
    failing: list[Failing] = field(default_factory=list)
    paths: list[Sequence[GuardPath]] = field(default_factory=list)


def on_cycles(ways: Ways) -> set[int]:
    """The places on cycles, and those between them; all others are removed."""
    left = {place: {one for one in onward if one in ways} for place, onward in ways.items()}
    before: dict[int, list[int]] = {}
    for place, onward in left.items():
        for one in onward:
            before.setdefault(one, []).append(place)
    ended = [place for place, onward in left.items() if not onward]
    while ended:
        place = ended.pop()
        del left[place]
        for one in before.get(place, ()):
            if one in left:
                left[one].discard(place)
                if not left[one]:
                    ended.append(one)
    return set(left)
