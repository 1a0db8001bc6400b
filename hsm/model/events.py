"""What a machine reacts to, beside conditions and time-outs."""

from __future__ import annotations

from hsm.model.chart import Defer, On
from hsm.model.messages import Occurrence
from hsm.model.values import dataclass


@dataclass(frozen=True, slots=True)
class StateEvent:
    """An event that comes from a state: an outcome of its activity, its completion or a fault in it.

    Transitions of that state and of the states around it see it by ``names``, those of the state alone by ``own``, too.
    Transitions read from SCXML see ``standard`` everywhere.

    Attributes:
        names: the outcome, ``fault``, or the name of the final state that completes the state.
        origin: index of the state that it comes from.
        standard: its name in SCXML.
        own: ``done`` for a completion: it belongs to the state that is complete.
    """

    names: tuple[str, ...]
    origin: int
    standard: str
    own: tuple[str, ...] = ()

    def __str__(self) -> str:
        return (*self.own, *self.names)[-1]


Event = str | Occurrence | StateEvent
"""An event, sent from outside or raised by the machine, by its name or with what it carries, or one from a state."""


def matches(trigger: On, event: Event, source: int, last: int) -> bool:
    """Whether a trigger names an event.

    Args:
        trigger: the names that a transition waits for.
        event: what happened.
        source: index of the transition's state.
        last: index of the last state inside it.
    """
    if isinstance(event, Occurrence):
        event = event.name
    if trigger.prefix:
        name = event if isinstance(event, str) else event.standard
        return any(_describes(descriptor, name) for descriptor in trigger.names)
    if isinstance(event, str):
        return any(name == event or (name.endswith("*") and event.startswith(name[:-1])) for name in trigger.names)
    if isinstance(trigger, Defer):
        return False  # outcomes of the state itself are not deferred
    if event.origin == source and any(name in trigger.names for name in event.own):
        return True
    return source <= event.origin <= last and any(name in trigger.names for name in event.names)


def _describes(descriptor: str, name: str) -> bool:
    """SCXML's matching of an event descriptor: a prefix of the dotted name, token by token; ``*`` matches any event."""
    descriptor = descriptor.removesuffix("*").removesuffix(".")
    return not descriptor or name == descriptor or name.startswith(descriptor + ".")
