"""Whether an SCXML chart needs its data model."""

from __future__ import annotations

from collections.abc import Iterator

from hsm.interchange.scxml.conditions import ConditionError, parse_condition
from hsm.interchange.scxml.datamodel.expressions import PROCESSORS
from hsm.interchange.scxml.elements import Element

SILENT = ("log",)
"""The elements that change nothing."""

_DATA_ELEMENTS = {"invoke", "data", "assign", "script", "if", "foreach", "donedata", "param", "content"}
_DATA_ATTRIBUTES = {"namelist", "idlocation"}


def _to_itself(element: Element) -> bool:
    """Whether an event is sent to the chart itself; anything else is an error of a chart with data, while it runs."""
    kind = element.attributes.get("type", "scxml")
    return element.attributes.get("target", "") in ("", "#_internal") and kind in PROCESSORS


def has_data(top: Element) -> bool:
    """Whether a chart has data or changes it; a condition alone does not show that."""
    return any(map(_has_data, _active(top)))


def uses_data(top: Element) -> bool:
    """Whether anything in a chart needs its data model: a chart may name one and use none of it."""
    return any(
        _has_data(one) or (one.tag == "send" and not _to_itself(one)) or not _is_plain(one) for one in _active(top)
    )


def _active(top: Element) -> Iterator[Element]:
    """Every element that has an effect."""
    pending = [top]
    while pending:
        element = pending.pop()
        pending.extend(element.children)
        if element.tag not in SILENT:
            yield element


def _has_data(element: Element) -> bool:
    return element.tag in _DATA_ELEMENTS or any(
        name.endswith("expr") or name in _DATA_ATTRIBUTES for name in element.attributes
    )


def _is_plain(element: Element) -> bool:
    """Whether the condition of an element, if it has one, needs no data."""
    try:
        parse_condition(element.attributes.get("cond", "true"), element.place)
    except ConditionError:
        return False
    return True


def all_of(top: Element, tag: str) -> Iterator[Element]:
    """All elements of a kind, except for those of charts within the chart."""
    pending = [top]
    while pending:
        element = pending.pop()
        if element.tag == tag:
            yield element
        if element.tag != "content":
            pending.extend(element.children)
