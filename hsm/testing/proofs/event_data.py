"""Events with data, deferred events and events that members send to one another, within a step and between steps.

What an event from outside carries is represented by symbols, which are new for each event. An event that waits keeps
known values; others may then be anything. Of more than a few waiting events only the names are kept: such events may
come in any number and order. Both only add runs.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from hsm.engine.machine import Machine
from hsm.engine.occurrences import event_text
from hsm.model.messages import Occurrence
from hsm.model.types import Type
from hsm.testing.proofs.points import AnyOf, CarriedEvent, Place, Point, Queued, Waiting
from hsm.testing.proofs.values import NOTHING, Derived, Exact, Symbols, Value

MOST_WAITING = 2
"""At most this many events that wait are distinguished."""


class EventSymbols:
    """The events of one machine.

    Args:
        machine: the machine.
        symbols: represent what events from outside carry.

    Attributes:
        deferring: whether the machine defers events.
    """

    def __init__(self, machine: Machine, symbols: Symbols) -> None:
        model, slots = machine.model, machine.generator.variables
        self._model = model
        self._symbols = symbols
        self._own = len(machine.generator.own_variables)
        self._all = len(slots)
        self._parts: dict[str, list[tuple[int, str, Type]]] = {
            declared.event: [(slots[declared.variable(part)], part.name, part.type) for part in declared.fields]
            for declared in model.event_data
        }
        self.deferring = model.defers_events()

    def types(self, event: str) -> list[Type]:
        """The types of what an event carries."""
        return [kind for _, _, kind in self._parts.get(event, ())]

    def opened(self, place: Place, event: Queued) -> tuple[Point, frozenset[int]]:
        """A point with the data of an event among the variables, and the symbols of what may be anything.

        Without data the point remains as it is.
        """
        _, point, queue = place
        name = event.name if isinstance(event, CarriedEvent) else event
        parts = self._parts.get(name) if isinstance(name, str) else None
        if parts is None:
            return point, frozenset()
        given = event.values if isinstance(event, CarriedEvent) else (None,) * len(parts)
        values = [*point.values, *(NOTHING for _ in range(self._all - self._own))]
        used = self._symbols.used((*point.values, *carried(queue)))
        fresh = set[int]()
        for (slot, part, kind), value in zip(parts, given, strict=True):
            if value is not None:
                values[slot] = value
                continue
            number = self._fresh(f"{name}.{part}", kind, used)
            fresh.add(number)
            values[slot] = Derived(number)
        return point.with_values(tuple(values)), frozenset(fresh)

    def closed(self, point: Point, name: str) -> tuple[Point, str | CarriedEvent]:
        """A point without the data of the event that is handled there, and that event."""
        parts = self._parts.get(name)
        if parts is None:
            return point, name
        event = CarriedEvent(name, tuple(point.values[slot] for slot, _, _ in parts))
        return point.with_values(point.values[: self._own]), event

    def text(self, event: CarriedEvent, carried: Mapping[int, Any]) -> str:
        """An event as scenarios write it, given the values of the symbols in it."""
        names = [part for _, part, _ in self._parts[event.name]]
        values = [carried[one.symbol] for one in event.values if isinstance(one, Derived)]
        return event_text(self._model, Occurrence(event.name, dict(zip(names, values, strict=True))))

    def _fresh(self, name: str, kind: Type, used: frozenset[int]) -> int:
        numbers = (self._symbols.number("event", (name, count), kind) for count in range(len(used) + 1))
        return next(one for one in numbers if one not in used)


def carried(events: Iterable[Queued]) -> tuple[Value, ...]:
    """All values that some events carry."""
    return tuple(value for one in events if isinstance(one, CarriedEvent) for value in one.values if value is not None)


def with_waiting(waiting: Waiting, event: str | CarriedEvent) -> Waiting:
    """One more event that waits, after the others; of its data what is known."""
    name = event.name if isinstance(event, CarriedEvent) else event
    if waiting and isinstance(waiting[-1], AnyOf):
        return (*waiting[:-1], AnyOf(waiting[-1].names | {name}))
    if len(waiting) >= MOST_WAITING:
        return (*waiting, AnyOf(frozenset((name,))))
    if isinstance(event, CarriedEvent):
        event = CarriedEvent(name, tuple(value if isinstance(value, Exact) else None for value in event.values))
    return (*waiting, event)
