"""What somebody outside does to a run: events that are sent to the machine, and an end that is asked for.

Whatever comes this way is part of the run: each tick says which events it was given, so that a recording replays them.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Protocol

from hsm import Machine, Occurrence
from hsm.engine.occurrences import event_text, name_of
from maze_machine.errors import UsageError


class Operator(Protocol):
    """Somebody who sends events to a running machine, and may end its run."""

    def events(self, index: int, time: float) -> Sequence[str | Occurrence]:
        """The events for a tick, with what they carry, in the order in which they were sent.

        Args:
            index: the tick's number.
            time: its time on the robot's clock, s.
        """
        ...

    @property
    def ended(self) -> str:
        """Why the run is to end after this tick; empty while it is to continue."""
        ...


class Nobody:
    """An operator who does nothing."""

    ended = ""

    def events(self, _index: int, _time: float) -> Sequence[str]:
        """No events."""
        return ()


NOBODY = Nobody()
"""Nobody sends anything."""


class ScheduledEvents:
    """Events at fixed times of a run.

    Args:
        entries: seconds after the first tick, and the event as a text.
    """

    ended = ""

    def __init__(self, entries: Iterable[tuple[float, str]]) -> None:
        self._open = sorted(entries, key=lambda entry: entry[0])
        self._began: float | None = None

    def events(self, _index: int, time: float) -> Sequence[str]:
        """The events whose time has come."""
        if self._began is None:
            self._began = time
        due = [name for after, name in self._open if time - self._began >= after - _SPACING]
        del self._open[: len(due)]
        return due


class Recorded:
    """The events of a recorded run, tick by tick."""

    ended = ""

    def __init__(self, events: Sequence[Sequence[str]]) -> None:
        self._events = events

    def events(self, index: int, _time: float) -> Sequence[str]:
        """The events that this tick was given when it was recorded."""
        return self._events[index] if index < len(self._events) else ()


class Together:
    """Several operators of one run; their events come one operator after the other."""

    def __init__(self, *operators: Operator) -> None:
        self._operators = operators

    def events(self, index: int, time: float) -> Sequence[str | Occurrence]:
        """The events of all of them."""
        return [event for one in self._operators for event in one.events(index, time)]

    @property
    def ended(self) -> str:
        """Why the first of them wants the run to end."""
        return next((one.ended for one in self._operators if one.ended), "")


_SPACING = 1e-9
"""A tick that comes so little before an event's time, by the rounding of stamps, is that event's tick, s."""


def scheduled(entries: Iterable[str], machine: Machine) -> ScheduledEvents:
    """The schedule that a person has written.

    Args:
        entries: each ``SECONDS:EVENT``.
        machine: the machine, which must know the events.

    Raises:
        UsageError: an entry is not written so, or names no event of the machine.
    """
    found: list[tuple[float, str]] = []
    for entry in entries:
        seconds, _, event = entry.partition(":")
        try:
            after = float(seconds)
        except ValueError:
            after = -1.0
        if not event or not 0 <= after < 1e9:
            raise UsageError(f"`{entry}` is not a time and event", "write SECONDS:EVENT, such as 12.5:go")
        found.append((after, checked_event(event, machine)))
    return ScheduledEvents(found)


def checked_event(event: str, machine: Machine) -> str:
    """An event with what it carries, such as ``floor(number = 3)``, in the form in which recordings hold it.

    Raises:
        UsageError: the machine does not know it, or it carries something else than declared.
    """
    known = machine.model.events
    if known is not None and name_of(event) not in known:
        listed = ", ".join(sorted(known)) or "none"
        raise UsageError(f"machine {machine.name} knows no event `{name_of(event)}`", f"its events: {listed}")
    try:
        return event_text(machine.model, event)
    except (TypeError, ValueError) as error:
        raise UsageError(str(error)) from None
