"""Whether an SCXML chart needs its data model."""

from __future__ import annotations

from collections.abc import Iterator

from hsm.interchange.scxml.conditions import ConditionError, parse_condition
from hsm.interchange.scxml.datamodel.expressions import PROCESSOR_NAMES
from hsm.interchange.scxml.elements import Element

SILENT = ("log",)
"""The elements that change nothing."""

_DATA_ELEMENTS = {"invoke", "data", "assign", "script", "if", "foreach", "donedata", "param", "content"}


def _to_itself(element: Element) -> bool:
    """Whether an event is sent to the chart itself; anything else is an error of a chart with data, while it runs."""
    kind = element.attributes.get("type", "scxml")
    return element.attributes.get("target", "") in ("", "#_internal") and kind in PROCESSOR_NAMES


def uses_data(top: Element) -> bool:
    """Whether anything in a chart needs its data model: a chart may name one and use none of it."""
    pending = [top]
    while pending:
        element = pending.pop()
        pending.extend(element.children)
        if element.tag in SILENT:
            continue
        if element.tag == "send" and not _to_itself(element):
            return True
        if element.tag in _DATA_ELEMENTS or any(name.endswith("expr") for name in element.attributes):
            return True
        condition = element.attributes.get("cond")
        if condition is not None:
            try:
                parse_condition(condition, element.place)
            except ConditionError:
                return True
    return False


def has_data_elements(top: Element) -> bool:
    """Whether a chart has elements that mean nothing without a data model."""
    return any(True for tag in _DATA_ELEMENTS for _ in all_of(top, tag))


def all_of(top: Element, tag: str) -> Iterator[Element]:
    """All elements of a kind, except for those of charts within the chart."""
    pending = [top]
    while pending:
        element = pending.pop()
        if element.tag == tag:
            yield element
        if element.tag != "content":
            pending.extend(element.children)
