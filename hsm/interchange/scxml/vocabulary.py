"""The rules of the standard for each element of SCXML: its attributes, its children, and which exclude each other.

Source: W3C, State Chart XML (SCXML), sections 3 to 6. Attributes of other namespaces are skipped; elements of other
namespaces are refused by the reader.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from difflib import get_close_matches

from hsm.interchange.scxml.datamodel.content import is_delay
from hsm.interchange.scxml.elements import Element
from hsm.model.codes import finding
from hsm.model.diagnostics import Diagnostic
from hsm.model.values import dataclass

_CONTENT = frozenset({"raise", "if", "foreach", "log", "assign", "script", "send", "cancel"})
_STATES = frozenset({"state", "parallel", "history", "final"})
_HANDLERS = frozenset({"onentry", "onexit"})


@dataclass(frozen=True, slots=True)
class Rule:
    """One element.

    Attributes:
        attributes: those that it may have.
        children: the elements that may lie in it.
        exclusive: pairs of attributes that exclude each other.
        text: whether there may be text in it.
    """

    attributes: frozenset[str]
    children: frozenset[str] = frozenset()
    exclusive: tuple[tuple[str, str], ...] = ()
    text: bool = False


def _rule(attributes: str, children: frozenset[str] = frozenset(), exclusive: str = "", *, text: bool = False) -> Rule:
    pairs = [one.partition("|") for one in exclusive.split()]
    return Rule(frozenset(attributes.split()), children, tuple((first, second) for first, _, second in pairs), text)


RULES: dict[str, Rule] = {
    # Transitions, handlers and activities of the whole chart are an extension: this project's own charts have them.
    "scxml": _rule(
        "initial name version datamodel binding",
        _STATES - {"history"} | _HANDLERS | {"datamodel", "script", "initial", "transition", "invoke"},
    ),
    "state": _rule("id initial", _STATES | _HANDLERS | {"transition", "initial", "datamodel", "invoke"}),
    "parallel": _rule("id", _STATES - {"final"} | _HANDLERS | {"transition", "datamodel", "invoke"}),
    "final": _rule("id", _HANDLERS | {"donedata"}),
    "history": _rule("id type", frozenset({"transition"})),
    "initial": _rule("", frozenset({"transition"})),
    "transition": _rule("event cond target type", _CONTENT),
    "onentry": _rule("", _CONTENT),
    "onexit": _rule("", _CONTENT),
    "raise": _rule("event"),
    "if": _rule("cond", _CONTENT | {"elseif", "else"}),
    "elseif": _rule("cond"),
    "else": _rule(""),
    "foreach": _rule("array item index", _CONTENT),
    "log": _rule("label expr"),
    "datamodel": _rule("", frozenset({"data"})),
    "data": _rule("id src expr", exclusive="src|expr", text=True),
    "assign": _rule("location expr", text=True),
    "donedata": _rule("", frozenset({"param", "content"})),
    "content": _rule("expr", text=True),
    "param": _rule("name expr location", exclusive="expr|location"),
    "script": _rule("src", text=True),
    "send": _rule(
        "event eventexpr target targetexpr type typeexpr id idlocation delay delayexpr namelist",
        frozenset({"param", "content"}),
        "event|eventexpr target|targetexpr type|typeexpr id|idlocation delay|delayexpr namelist|content",
    ),
    "cancel": _rule("sendid sendidexpr", exclusive="sendid|sendidexpr"),
    "invoke": _rule(
        "type typeexpr src srcexpr id idlocation namelist autoforward",
        frozenset({"param", "content", "finalize"}),
        "type|typeexpr src|srcexpr id|idlocation",
    ),
    "finalize": _rule("", _CONTENT),
}
"""The rule of each element of the standard."""

_VALUES = {
    ("scxml", "version"): ("1.0",),
    ("scxml", "binding"): ("early", "late"),
    ("transition", "type"): ("internal", "external"),
    ("history", "type"): ("shallow", "deep"),
    ("invoke", "autoforward"): ("true", "false"),
}
_REQUIRED = {
    "raise": ("event",),
    "if": ("cond",),
    "elseif": ("cond",),
    "foreach": ("array", "item"),
    "data": ("id",),
    "assign": ("location",),
    "param": ("name",),
}
_VALUED = {"assign": ("expr",), "param": ("expr", "location")}
"""Elements that need a value: in one of these attributes, or, where text is allowed, as text."""

_ONCE = {
    "scxml": {"datamodel", "script"},
    "state": {"datamodel"},
    "parallel": {"datamodel"},
    "final": {"donedata"},
    "donedata": {"content"},
    "send": {"content"},
    "invoke": {"content", "finalize"},
}
"""The elements of which another one has one at most; a second ``initial`` is found by the reader."""

_DESCRIPTOR = re.compile(r"\.?\*|[^\s.*,;]+(\.[^\s.*,;]+)*(\.\*?)?")
"""An event descriptor (section 3.12.1): tokens separated by dots, `*` only at the end; `.*` is the same as `*`."""

_OPAQUE = ("content", "data", "assign")
"""The contents of these elements are always data."""


def breaches(top: Element) -> Iterator[Diagnostic]:
    """Everything in a document that the standard does not allow, with a suggestion."""
    pending = [top]
    while pending:
        element = pending.pop()
        rule = RULES.get(element.tag)
        if rule is None:
            continue  # the reader refuses it by name
        yield from _attributes(element, rule)
        if not rule.text and element.text.strip():
            message = f"text in <{element.tag}>: `{element.text.strip()[:40]}`"
            yield finding("E0903", element.place, message, "remove it, or make it a comment")
        if element.tag in _OPAQUE:
            continue
        for child in element.children:
            if child.tag in RULES and child.tag not in rule.children:
                hint = f"it may contain: {', '.join(sorted(rule.children)) or 'nothing'}"
                yield finding("E0903", child.place, f"<{element.tag}> cannot contain <{child.tag}>", hint)
            elif child.tag not in RULES and not child.tag.startswith("{"):
                close = get_close_matches(child.tag, sorted(rule.children), 1)
                hint = f"did you mean `{close[0]}`?" if close else "leave it out"
                yield finding("E0903", child.place, f"<{child.tag}> is not supported", hint)
        yield from _repeated(element)
        yield from _branches(element)
        pending.extend(reversed(element.children))


def _repeated(element: Element) -> Iterator[Diagnostic]:
    """Children of which there may be one only, and those that exclude each other."""
    found: set[str] = set()
    for child in element.children:
        if child.tag in found & _ONCE.get(element.tag, set()):
            yield finding("E0903", child.place, f"<{element.tag}> has a second <{child.tag}>", "keep one of them")
        elif element.tag in ("send", "donedata") and {child.tag, *found} >= {"param", "content"}:
            message = f"<{element.tag}> has <param> and <content>, which exclude each other"
            yield finding("E0903", child.place, message, "keep one of them")
        found.add(child.tag)


def _branches(element: Element) -> Iterator[Diagnostic]:
    """Branches of an ``if`` that follow its ``else``, which nothing reaches."""
    tags = [child.tag for child in element.children]
    if "else" in tags:
        for child in element.children[tags.index("else") + 1 :]:
            if child.tag in ("else", "elseif"):
                yield finding("E0903", child.place, f"<{child.tag}> cannot follow <else>", "put <else> last")


def _attributes(element: Element, rule: Rule) -> Iterator[Diagnostic]:
    for name, value in element.attributes.items():
        if name.startswith("{"):
            continue
        if name not in rule.attributes:
            close = get_close_matches(name, sorted(rule.attributes), 1)
            hint = f"did you mean `{close[0]}`?" if close else "leave it out"
            yield finding("E0904", element.place, f"`{name}` of <{element.tag}> is not supported", hint)
        elif not value.strip() and (element.tag, name) != ("log", "label"):
            message = f"`{name}` of <{element.tag}> is empty"
            yield finding("E0910", element.place, message, "give it a value, or leave it out")
        elif value not in _VALUES.get((element.tag, name), (value,)):
            known = " or ".join(f"`{one}`" for one in _VALUES[element.tag, name])
            yield finding("E0910", element.place, f"`{name}` of <{element.tag}> is {known}, not `{value}`")
    yield from _values(element)
    for name in _REQUIRED.get(element.tag, ()):
        if name not in element.attributes:
            yield finding("E0909", element.place, f"<{element.tag}> needs `{name}`")
    for first, second in rule.exclusive:
        both = first in element.attributes and (
            second in element.attributes or any(child.tag == second for child in element.children)
        )
        if both:
            message = f"<{element.tag}> has `{first}` and `{second}`, which exclude each other"
            yield finding("E0904", element.place, message, "keep one of them")
    inner = rule.text and bool(element.text.strip() or element.children)
    if element.tag in _OPAQUE and "expr" in element.attributes and inner:
        message = f"<{element.tag}> has `expr` and a value in it, which exclude each other"
        yield finding("E0904", element.place, message, "keep one of them")
    wanted = _VALUED.get(element.tag)
    if wanted and not inner and not any(name in element.attributes for name in wanted):
        names = " or ".join(f"`{name}`" for name in wanted)
        yield finding("E0909", element.place, f"<{element.tag}> needs {names}{' or a value in it' * rule.text}")


def _values(element: Element) -> Iterator[Diagnostic]:
    """Delays that are none, and events that are none."""
    delay = element.attributes.get("delay", "0") if element.tag == "send" else "0"
    if delay.strip() and not is_delay(delay):
        what = "a delay without a unit" if delay.strip().replace(".", "", 1).isdecimal() else "not a delay"
        yield finding("E0910", element.place, f"`{delay}` is {what}", "write it as in `1.5s` or `200ms`")
    events = element.attributes.get("event", "").split() if element.tag == "transition" else ()
    for name in events:
        if not _DESCRIPTOR.fullmatch(name):
            hint = "separate events by spaces, and write `*` only at the end, as in `door.*`"
            yield finding("E0910", element.place, f"`{name}` is not an event descriptor", hint)
