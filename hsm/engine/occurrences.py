"""What comes from outside, events with their data and adjustments: checks of the values, and their form as text.

As a text an event is its name, followed by its data in parentheses: ``floor(number = 3)``. An adjustment is the name of
a parameter and its new value: ``cruise = 0.3 m/s``. Commands, scenarios, recordings and the network use this form.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Set
from typing import Any

from hsm.engine.inputs import parameter_value, shown, typed, wanted_type
from hsm.engine.limits import within_limits
from hsm.model.chart import EventData, Model
from hsm.model.messages import Adjustment, Occurrence, OutsideInput
from hsm.model.registry import EnumerationClass, EventField, Parameter
from hsm.model.types import Type
from hsm.model.unparse import value_text
from hsm.model.written import value_of

_WIDEST = 40
_LONGEST = 10_000
_ADJUSTING = re.compile(r"\s*([\w.]+)\s*=(.*)", re.ASCII | re.DOTALL)
_WITH_DATA = re.compile(r"\s*([\w.]+)\s*\((.*)\)\s*", re.ASCII | re.DOTALL)


def checked_events(model: Model, events: Iterable[OutsideInput]) -> list[OutsideInput]:
    """The events and adjustments of a step, as the engine takes them.

    Args:
        model: the machine.
        events: their names, with data either as texts such as ``floor(number = 3)`` or as ``Occurrence``; adjustments
            as texts such as ``cruise = 0.3 m/s`` or as ``Adjustment``.

    Raises:
        TypeError: it is not a list or one text, something in the list is not an event, or a value is of another type
            than declared.
        ValueError: neither the machine nor its library declares an event of that name, something that it carries is
            missing, unknown or given twice, the parameter is not adjustable, or a value is infinite, NaN or out
            of bounds.
    """
    if isinstance(events, str):
        raise TypeError(f"events are a list of names: [{events!r:.{_WIDEST}}], not {events!r:.{_WIDEST}}")
    if not isinstance(events, Iterable) or isinstance(events, bytes | Mapping | Set):  # a set has no order
        raise TypeError(f"events are a list of names, not {shown(events)}")
    return [_checked(model, event) for event in events]


def event_text(model: Model, event: OutsideInput) -> str:
    """The text form of an event or an adjustment, which reads back as the same; recordings use it.

    Raises:
        TypeError, ValueError: as for ``checked_events``.
    """
    found = _checked(model, event)
    if isinstance(found, Adjustment):
        return f"{found.parameter} = {value_text(found.value, _parameter(model, found.parameter).type)}"
    declared = model.data_of(found.name) if isinstance(found, Occurrence) else None
    if isinstance(found, str) or declared is None:
        return str(found)
    return _text(declared, found)


def _text(declared: EventData, event: Occurrence) -> str:
    parts = [f"{one.name} = {value_text(event.data[one.name], one.type)}" for one in declared.fields]
    return f"{event.name}({', '.join(parts)})"


def sent_text(model: Model, event: str | Occurrence) -> str:
    """An event that a machine, or a member of it, has sent to others, as a text.

    Args:
        model: the machine.
        event: as ``Macrostep.sent`` has it.
    """
    declared = model.data_of(event.name) if isinstance(event, Occurrence) else None
    return str(event) if declared is None or isinstance(event, str) else _text(declared, event)


def name_of(event: str) -> str:
    """The name of an event that is written as a text."""
    return event.partition("(")[0].strip()


def is_adjustment(event: str) -> bool:
    """Whether a text is the form of an adjustment, such as ``cruise = 0.3 m/s``."""
    return len(event) <= _LONGEST and _ADJUSTING.fullmatch(event) is not None


def _checked(model: Model, event: OutsideInput) -> OutsideInput:
    if isinstance(event, str) and not model.event_data and (model.events is None or event in model.events):
        return event
    if isinstance(event, Adjustment):
        return _adjustment(model, event.parameter, event.value)
    if not isinstance(event, str | Occurrence):
        raise TypeError(f"an event is a text or an Occurrence, not {shown(event)}")
    if isinstance(event, str) and model.events is not None and is_adjustment(event):
        return _written_adjustment(model, event)
    name, given = (event.name, event.data) if isinstance(event, Occurrence) else _parts(model, event)
    if not isinstance(name, str):
        raise TypeError(f"the name of an event is a text, not {shown(name)}")
    if not isinstance(given, Mapping):
        raise TypeError(f"the data of event `{name}` is a mapping from names to values, not {shown(given)}")
    if model.events is None:
        return event
    if name not in model.events:
        known = ", ".join(sorted(model.events)) or "none"
        raise ValueError(f"no event `{name}` is declared for machine {model.name}; its events: {known}")
    declared = model.data_of(name)
    if declared is None:
        if given:
            raise ValueError(f"event `{name}` has no data; send `{name}` alone")
        return name
    return Occurrence(name, _data(declared, given))


def _written_adjustment(model: Model, text: str) -> Adjustment:
    name, _, value = (one.strip() for one in text.partition("="))
    parameter = _parameter(model, name)
    enumeration = next((one for one in model.enumerations if one.__name__ == str(parameter.type)), None)
    subject = f"parameter `{name} : {parameter.type}`"
    return _adjustment(model, name, _value(subject, parameter.type, enumeration, value))


def _adjustment(model: Model, name: str, value: Any) -> Adjustment:
    return Adjustment(name, parameter_value(model, _parameter(model, name), value))


def _parameter(model: Model, name: str) -> Parameter:
    """An adjustable parameter."""
    if model.adjustable_named(name) is None:
        known = ", ".join(one.parameter for one in model.adjustable) or "none"
        raise ValueError(f"machine {model.name} has no adjustable parameter `{name:.{_WIDEST}}`; adjustable: {known}")
    return next(one for one in model.parameters if one.name == name)


def _parts(model: Model, text: str) -> tuple[str, Mapping[str, Any]]:
    """The name in a text and the values after it, by name."""
    written = None if len(text) > _LONGEST else _WITH_DATA.fullmatch(text)
    if written is None:
        return text, {}
    event, values = written.groups()
    declared = model.data_of(event)
    fields = {} if declared is None else {one.name: one for one in declared.fields}
    found: dict[str, Any] = {}
    for position, part in enumerate(values.split(",") if values.strip() else ()):
        name, equals, value = (one.strip() for one in part.partition("="))
        if not equals and fields and position >= len(fields):
            raise ValueError(f"event `{event}` carries {len(fields)} value{'s' * (len(fields) != 1)}, not more")
        if not equals:
            name, value = (list(fields)[position] if fields else ""), name
        if name in found:
            raise ValueError(f"`{name}` of event `{event}` is given twice in `{text:.{_WIDEST}}`")
        if name in fields:
            field = fields[name]
            subject = f"`{name} : {field.type}` of event `{event}`"
            value = _value(subject, field.type, field.enumeration, value)
        found[name] = value
    return event, found


def _value(subject: str, kind: Type, enumeration: EnumerationClass | None, text: str) -> Any:
    try:
        return value_of(text, kind, enumeration)
    except ValueError as way_out:
        raise ValueError(f"`{text:.{_WIDEST}}` is not a value for {subject}: {way_out}") from None


def _data(declared: EventData, given: Mapping[str, Any]) -> dict[str, Any]:
    """What an event carries, in the order of its declaration."""
    fields = {one.name: one for one in declared.fields}
    unknown = [name for name in given if name not in fields]
    missing = [name for name in fields if name not in given]
    if unknown or missing:
        wrong = f"`{unknown[0]}` is not part of it" if unknown else f"`{missing[0]}` is missing"
        form = ", ".join(f"{one.name} : {one.type}" for one in declared.fields)
        raise ValueError(f"event `{declared.event}` carries ({form}); {wrong}")
    return {name: _held(declared.event, field, given[name]) for name, field in fields.items()}


def _held(event: str, field: EventField, given: Any) -> Any:
    value = typed(given, field.type, field.enumeration)
    subject = f"`{field.name}` of event `{event}`"
    if value is None:
        wanted = wanted_type(field.type)
        raise TypeError(f"{subject} is {wanted}, not {shown(given)}")
    if not within_limits(value, field.type):
        raise ValueError(f"{subject} cannot be {shown(given)}")
    return value
