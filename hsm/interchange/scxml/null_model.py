"""A chart without data: its conditions and its executable content as the engine's own expressions and actions."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Protocol

from hsm.interchange.scxml.conditions import ConditionError, parse_condition
from hsm.interchange.scxml.data_use import SILENT
from hsm.interchange.scxml.datamodel.content import is_delay, seconds_of
from hsm.interchange.scxml.datamodel.expressions import PROCESSORS
from hsm.interchange.scxml.elements import Element
from hsm.model.chart import Action, Cancel, Raise, Send
from hsm.model.diagnostics import Place
from hsm.model.expressions import Active, Expression
from hsm.model.messages import Store
from hsm.model.rewriting import parts_of
from hsm.model.values import dataclass


class Find(Protocol):
    """Reports a diagnostic."""

    def __call__(self, code: str, message: str, place: Place, suggestion: str | None = None) -> None:
        """Report one."""
        ...


def report_unsupported(find: Find, element: Element) -> None:
    """Report an element, with advice."""
    find("E0903", f"<{element.tag}> is not supported", element.place, _ADVICE.get(element.tag, "leave it out"))


@dataclass(frozen=True, slots=True)
class NullModel:
    """The data model that the standard calls ``null``.

    Attributes:
        find: reports what is not supported.
        check: reports each name in a list that no state has.
    """

    find: Find
    check: Callable[[list[str], Place], object]

    elements: frozenset[str] = frozenset()
    """What a state may contain in addition."""

    def declare(self, _names: Iterable[str]) -> Store | None:
        """There is no data."""
        return None

    def guard(self, element: Element) -> Expression | None:
        """The condition of a transition; None, with a diagnostic, if it is not one."""
        try:
            guard = parse_condition(element.attributes["cond"], element.place)
        except ConditionError as error:
            hint = "declare the data in a <datamodel>, or combine In('state') by and, or, not"
            self.find("E0905", f"this condition is not supported: {error}", element.place, hint)
            return None
        self.check([part.state for part in parts_of(guard) if isinstance(part, Active)], element.place)
        return guard

    def begin(self, _elements: Iterable[Element], _state: int, *, first: bool) -> tuple[Action, ...]:
        """No data is set."""
        return ()

    def script(self, _element: Element) -> tuple[Action, ...]:
        """No script is run."""
        return ()

    def result(self, _element: Element, _state: int) -> tuple[Action, ...]:
        """Completion carries nothing."""
        return ()

    def block(self, block: Element) -> tuple[Action, ...]:
        """The executable content of an element."""
        found = (self._action(element) for element in block.children if element.tag not in SILENT)
        return tuple(action for action in found if action is not None)

    def _action(self, element: Element) -> Action | None:
        match element.tag:
            case "raise":
                event = self._required(element, "event")
                return Raise(event, element.place) if event else None
            case "send":
                return self._send(element)
            case "cancel":
                self._only(element, "sendid")
                label = self._required(element, "sendid")
                return Cancel(label, element.place) if label else None
            case _:
                report_unsupported(self.find, element)
                return None

    def _send(self, element: Element) -> Action | None:
        self._only(element, "event", "target", "type", "id", "delay")
        for child in element.children:
            report_unsupported(self.find, child)
        attributes = element.attributes
        if attributes.get("type", "scxml") not in PROCESSORS:
            reason = f"an event of type `{attributes['type']}` cannot be sent"
            self.find("E0904", reason, element.place, "a chart sends to itself only")
        target = attributes.get("target", "")
        if target not in ("", "#_internal"):
            self.find("E0904", f"nothing can be sent to `{target}`", element.place, "a chart sends to itself only")
        event = self._required(element, "event")
        text = attributes.get("delay", "0")
        if not event or not is_delay(text):
            return None
        if target == "#_internal":
            return Raise(event, element.place)
        return Send(event, seconds_of(text), attributes.get("id"), element.place)

    def _required(self, element: Element, name: str) -> str | None:
        value = element.attributes.get(name)
        if not value:
            self.find("E0909", f"<{element.tag}> needs `{name}`", element.place)
        return value

    def _only(self, element: Element, *known: str) -> None:
        for name in element.attributes:
            if name not in known:
                hint = (
                    f"write the value itself: `{name.removesuffix('expr')}`"
                    if name.endswith("expr")
                    else "leave it out"
                )
                self.find("E0904", f"`{name}` of <{element.tag}> is not supported", element.place, hint)


_DATA = 'declare the data model of the chart: `datamodel="ecmascript"`'
_ADVICE = {
    "invoke": "put it into a state of a chart with a data model; a .maze-machine has activities (`do`)",
    "finalize": "put it into an <invoke>",
    **dict.fromkeys(("script", "datamodel", "data", "assign", "foreach", "if", "elseif", "else"), _DATA),
    "donedata": "leave it out: the name of the final state shows how the chart ended",
    "param": "events carry no data: send one of several events instead",
    "content": "events carry no data: send one of several events instead",
}
