"""The data of a chart as JSON, and back; what it names is named as in the chart."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from hsm.engine.compiled import CompiledChart
from hsm.model.messages import ScxmlEvent, Store

_DEEPEST = 100


def store_json(machine: CompiledChart, store: Store) -> dict[str, Any]:
    """The data of a chart.

    Raises:
        ValueError: it holds something that JSON cannot.
    """
    names = [one.name for one in machine.model.states]
    return {
        "values": {name: _plain(value) for name, value in store.values.items()},
        "event": None if store.event is None else message_json(store.event),
        "results": {names[index]: _plain(value) for index, value in sorted(store.results.items())},
        "begun": [names[index] for index in sorted(store.begun)],
    }


def store_of(machine: CompiledChart, saved: Mapping[str, Any]) -> Store:
    """The data of a chart that ``store_json`` wrote.

    Raises:
        ValueError, KeyError: it is that of another chart.
    """
    first = machine.model.store
    known = {} if first is None else first.values
    if first is None or saved["values"].keys() != known.keys():
        other = sorted(saved["values"].keys() ^ known.keys())
        raise ValueError(f"the chart and the snapshot do not have the same data: `{other[0] if other else 'none'}`")
    return Store(
        dict(saved["values"]),
        None if saved["event"] is None else message_of(saved["event"]),
        {machine.indices[name]: value for name, value in saved["results"].items()},
        frozenset(machine.indices[name] for name in saved["begun"]),
    )


def message_json(message: ScxmlEvent) -> dict[str, Any]:
    """An event with data of a chart.

    Raises:
        ValueError: it carries something that JSON cannot hold.
    """
    return {**asdict(message), "data": _plain(message.data)}


def message_of(saved: Mapping[str, Any]) -> ScxmlEvent:
    """The event that ``message_json`` wrote.

    Raises:
        TypeError: it is none.
    """
    return ScxmlEvent(**saved)


def _plain(value: Any, depth: int = 0) -> Any:
    """A value that JSON can hold, as it is."""
    if depth > _DEEPEST:
        raise ValueError("the data is nested too deep to be saved")
    match value:
        case None | bool() | int() | float() | str():
            return value
        case list():
            return [_plain(one, depth + 1) for one in value]
        case dict() if all(isinstance(name, str) for name in value):
            return {name: _plain(one, depth + 1) for name, one in value.items()}
    raise ValueError(f"{value!r:.40} cannot be saved")
