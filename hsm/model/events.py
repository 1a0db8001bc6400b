"""What a machine reacts to, beside conditions and time-outs."""

from __future__ import annotations

from dataclasses import dataclass

from hsm.model.chart import On


@dataclass(frozen=True, slots=True)
class Scoped:
    """An event that comes from a state: an outcome of its activity, its completion or a fault in it.

    Only transitions of that state and of the states around it see it by ``names``. Transitions read from SCXML see
    ``standard`` everywhere.

    Attributes:
        names: its names; a completion has two, ``done`` and the name of the final state.
        origin: index of the state that it comes from.
        standard: its name in SCXML.
    """

    names: tuple[str, ...]
    origin: int
    standard: str

    def __str__(self) -> str:
        return self.names[-1]


Event = str | Scoped
"""An event by its name, sent from outside or raised by the machine, or one that comes from a state."""


def matches(trigger: On, event: Event, *, inside: bool) -> bool:
    """Whether a trigger names an event.

    Args:
        trigger: the names that a transition waits for.
        event: what happened.
        inside: whether a scoped event comes from the transition's source or from a state inside it.
    """
    if trigger.prefix:
        name = event if isinstance(event, str) else event.standard
        return any(_describes(descriptor, name) for descriptor in trigger.names)
    if isinstance(event, str):
        return event in trigger.names
    return inside and any(name in trigger.names for name in event.names)


def _describes(descriptor: str, name: str) -> bool:
    """SCXML's matching of an event descriptor: a prefix of the dotted name, token by token; ``*`` matches any event."""
    descriptor = descriptor.removesuffix("*").removesuffix(".")
    return not descriptor or name == descriptor or name.startswith(descriptor + ".")
