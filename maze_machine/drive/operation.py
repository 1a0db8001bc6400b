"""External control of a run: events for the machine, and requests to end it.

These inputs are part of the run: each tick lists its events, so that a recording replays them.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Protocol

from hsm import Machine, Occurrence
from hsm.engine.occurrences import event_text, is_adjustment, name_of
from maze_machine.errors import UsageError


class Operator(Protocol):
    """A source of events for a running machine, which may also end the run."""

    def events(self, index: int, time: float) -> Sequence[str | Occurrence]:
        """The events for a tick, with their data, in the order in which they were sent.

        Args:
            index: the tick's number.
            time: its time on the robot's clock, s.
        """
        ...

    @property
    def ended(self) -> str:
        """Why the run must end after this tick; empty if it continues."""
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
        """The events of this tick in the recording."""
        return self._events[index] if index < len(self._events) else ()


class Together:
    """Several operators of one run; their events are concatenated in order."""

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
"""Tolerance for the rounding of stamps: an event belongs to a tick that is at most this much earlier, s."""


def scheduled(entries: Iterable[str], machine: Machine) -> ScheduledEvents:
    """A schedule from text.

    Args:
        entries: each ``SECONDS:EVENT``.
        machine: the machine, which must know the events.

    Raises:
        UsageError: an entry has another form, or names no event of the machine.
    """
    found: list[tuple[float, str]] = []
    for entry in entries:
        seconds, _, event = entry.partition(":")
        try:
            after = float(seconds)
        except ValueError:
            after = -1.0
        if not event or not 0 <= after < 1e9:
            raise UsageError(
                f"`{entry}` is not a time and event", "write SECONDS:EVENT, such as 12.5:go or 12.5:cruise=0.3m/s"
            )
        found.append((after, checked_event(event, machine)))
    return ScheduledEvents(found)


def checked_event(event: str, machine: Machine) -> str:
    """An event with its data, such as ``floor(number = 3)``, or an adjustment, in the form of recordings.

    Raises:
        UsageError: the machine does not declare it, or a value is not what its declaration allows.
    """
    known = machine.model.events
    if known is not None and not is_adjustment(event) and name_of(event) not in known:
        listed = ", ".join(sorted(known)) or "none"
        raise UsageError(f"machine {machine.name} declares no event `{name_of(event)}`", f"its events: {listed}")
    try:
        return event_text(machine.model, event)
    except (TypeError, ValueError) as error:
        raise UsageError(str(error)) from None
