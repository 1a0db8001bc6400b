"""Events that carry data, and the data of a chart in SCXML."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import Any

from hsm.model.values import dataclass

STORE = "store"
"""The key under which the signals of a step hold the data of the chart."""


@dataclass(frozen=True, slots=True)
class Occurrence:
    """An event that carries the data that its machine declares.

    Attributes:
        name: the event's name.
        data: the value of each field of its data, by name, in SI units.
    """

    name: str
    data: Mapping[str, Any] = field(default_factory=dict, hash=False)

    def __str__(self) -> str:
        return self.name


@dataclass(frozen=True, slots=True)
class Adjustment:
    """A new value for a parameter that an operator may change while the machine runs.

    Attributes:
        parameter: its name.
        value: in SI units.
    """

    parameter: str
    value: Any


OutsideInput = str | Occurrence | Adjustment
"""What a machine receives from outside: an event, alone or with its data, or an adjustment."""


@dataclass(frozen=True, slots=True)
class Emission:
    """An event on its way to other machines.

    Attributes:
        event: the event.
        receivers: how the members of this machine that receive it call it.
    """

    event: str | Occurrence
    receivers: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class ScxmlEvent:
    """An event with data of a chart in SCXML, with SCXML's fields.

    Attributes:
        name: its name.
        kind: ``external``, ``internal``, or ``platform`` for errors and completions.
        data: what it carries; None for nothing.
        sendid: the identifier of the ``send`` that failed or made it.
        origin: where an answer would go.
        invokeid: the invocation that it comes from.
    """

    name: str
    kind: str = "external"
    data: Any = None
    sendid: str | None = None
    origin: str | None = None
    invokeid: str | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Store:
    """The data of a chart at one moment; it is replaced, never changed.

    Attributes:
        values: the data, by name.
        event: the event that is handled, or was last.
        results: what the completion of each state carries, by index.
        begun: the states whose data was set on their first entry.
        given: data that the invoking chart has given a value, in place of its own first value.
        session: the identifier of the session; None where it is the chart's name.
        reachable: the targets of other sessions that events can be sent to.
    """

    values: Mapping[str, Any] = field(default_factory=dict)
    event: ScxmlEvent | None = None
    results: Mapping[int, Any] = field(default_factory=dict)
    begun: frozenset[int] = frozenset()
    given: Mapping[str, Any] = field(default_factory=dict)
    session: str | None = None
    reachable: frozenset[str] = frozenset()
