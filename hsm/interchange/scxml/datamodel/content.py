"""Executable content of charts with a data model: blocks of steps that change the data and send events."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Iterable, Mapping
from copy import deepcopy
from dataclasses import field, replace
from typing import Any

from hsm.interchange.scxml.datamodel.expressions import (
    PROCESSORS,
    DataError,
    Environment,
    Evaluate,
    Language,
)
from hsm.interchange.scxml.datamodel.tokens import LONGEST_EXPRESSION, InvalidExpressionError, UnsupportedError
from hsm.interchange.scxml.elements import Element
from hsm.model.chart import Cancel, Send
from hsm.model.messages import STORE, ScxmlEvent, Store
from hsm.model.values import dataclass

_DELAY = re.compile(r"\s*([0-9]+(?:\.[0-9]*)?|\.[0-9]+)\s*(ms|s|m|h|d)\s*")
_SECONDS = {"ms": 0.001, "s": 1.0, "m": 60.0, "h": 3600.0, "d": 86400.0}
NAME = re.compile(r"[A-Za-z_$][A-Za-z0-9_$]*")
"""The names of data."""
_LOCATION = re.compile(r"\s*([A-Za-z_$][A-Za-z0-9_$]*)((?:\.[A-Za-z_$][A-Za-z0-9_$]*)*)\s*")
_STATEMENT = re.compile(r"(?:(?:var|let|const)\s+)?([A-Za-z_$][A-Za-z0-9_$]*)\s*=(?!=)\s*(.+)")
_LONGEST_LOOP = 10_000
_INTERNAL = "#_internal"
_SYSTEM = ("_event", "_sessionid", "_name", "_ioprocessors", "_x")


class CommunicationError(DataError):
    """An unreachable target: SCXML's ``error.communication``."""


@dataclass(slots=True)
class BlockContext:
    """The context of a block.

    Attributes:
        memo: holds the data, under ``STORE``.
        active: the active states, by index.
        queue: takes the events that are raised or sent.
        states: the index of each state, by name.
        system: the chart's own constants.
    """

    memo: dict[Any, Any]
    active: Any
    queue: Any
    states: Mapping[str, int]
    system: Mapping[str, Any]

    @property
    def store(self) -> Store:
        """The data."""
        found: Store = self.memo[STORE]
        return found

    def set(self, name: str, value: Any) -> None:
        """Give a piece of data a value."""
        self.memo[STORE] = replace(self.store, values={**self.store.values, name: value})

    def evaluate(self, expression: Evaluate) -> Any:
        """The value of an expression; a copy, which nothing else changes."""
        value = expression(Environment(self.store, self.active, self.states, self.system))
        return deepcopy(value) if isinstance(value, list | dict) else value

    def fail(self, error: DataError, sendid: str | None = None) -> None:
        """Announce an error to the chart."""
        what = "communication" if isinstance(error, CommunicationError) else "execution"
        self.queue.append(ScxmlEvent(f"error.{what}", "platform", str(error), sendid))


Step = Callable[[BlockContext], None]


@dataclass(slots=True)
class Builder:
    """Makes steps from elements.

    Attributes:
        refuse: reports an element, its unsupported feature, and a suggestion.
        language: of the expressions.
        prefix: of the identifiers that are made.
    """

    refuse: Callable[[Element, str, str], None]
    language: type[Language]
    prefix: str = "send"
    _made: int = field(default=0)

    def expression(self, element: Element, text: str) -> Evaluate:
        """The function of an expression; an invalid expression fails when it is evaluated."""
        try:
            return self.language.read(text)
        except UnsupportedError as error:
            self.refuse(element, f"`{text.strip()[:60]}` is not supported: {error}", "compute it from simpler data")
            reason = str(error)
        except InvalidExpressionError as error:
            reason = f"`{text.strip()[:60]}` is not an expression: {error}"

        def fail(_: Environment) -> Any:
            raise DataError(reason)

        return fail

    def block(self, elements: Iterable[Element]) -> list[Step]:
        """The steps of some executable content."""
        return [step for one in elements if (step := self._step(one)) is not None]

    def _step(self, element: Element) -> Step | None:
        makers: dict[str, Callable[[Element], Step | None]] = {
            "raise": self._raise,
            "log": self._log,
            "assign": self._assign,
            "if": self._if,
            "foreach": self._foreach,
            "send": self._send,
            "cancel": self._cancel,
            "script": self.script,
        }
        maker = makers.get(element.tag)
        if maker is not None:
            return maker(element)
        self.refuse(element, f"<{element.tag}> is not supported", "leave it out")
        return None

    def _raise(self, element: Element) -> Step:
        name = element.attributes.get("event", "")
        return lambda session: session.queue.append(ScxmlEvent(name, "internal"))

    def _log(self, element: Element) -> Step | None:
        text = element.attributes.get("expr")
        if text is None:
            return None
        expression = self.expression(element, text)
        return lambda session: session.evaluate(expression) and None

    def value(self, element: Element) -> Evaluate:
        """The value of an element with ``expr``, or with the value in it."""
        text = element.attributes.get("expr")
        if text is not None:
            return self.expression(element, text)
        if element.children:
            self.refuse(element, "XML as data is not supported", "write the data as an expression")
        return self.literal(element, element.text)

    def literal(self, element: Element, text: str) -> Evaluate:
        """The value of some text: of the literal that it is, or the text itself, with single blanks."""
        body = text.strip()
        if len(body) > LONGEST_EXPRESSION:
            reason = f"data of more than {LONGEST_EXPRESSION:,} characters is not supported"
            self.refuse(element, reason, "keep the data outside of the chart")
            return lambda _: None
        if not body:
            return lambda _: None
        try:
            value = self.language.literal(body)
        except (InvalidExpressionError, UnsupportedError):
            value = " ".join(body.split())  # no literal: a text
        return lambda _: value

    def _assign(self, element: Element) -> Step:
        value = self.value(element)
        where = element.attributes.get("location", "")
        location = _LOCATION.fullmatch(where)
        if location is None and "[" in where:
            self.refuse(element, f"the location `{where}` is not supported", "assign the whole list or object")

        def assign(session: BlockContext) -> None:
            new = session.evaluate(value)
            if location is None or location[1] in _SYSTEM or location[1] not in session.store.values:
                raise DataError(f"`{where}` cannot be assigned to")
            name, path = location[1], location[2].split(".")[1:]
            session.set(name, _changed(session.store.values[name], path, new))

        return assign

    def script(self, element: Element) -> Step:
        """A script that consists of assignments to whole pieces of data."""
        steps: list[tuple[str, Evaluate]] = []
        if "src" in element.attributes:
            self.refuse(element, "`src` of <script> is not supported", "write the assignments themselves")
        for statement in filter(None, map(str.strip, re.split(r"[;\n]", element.text))):
            found = _STATEMENT.fullmatch(statement)
            if found is None or found[1] in _SYSTEM:
                reason = f"`{statement[:60]}` is not supported in a <script>"
                self.refuse(element, reason, "use <assign>, <if> or <foreach>")
            else:
                steps.append((found[1], self.expression(element, found[2])))

        def run(session: BlockContext) -> None:
            for name, value in steps:
                session.set(name, session.evaluate(value))

        return run

    def _if(self, element: Element) -> Step:
        branches: list[tuple[Evaluate, list[Element]]] = [(self._condition(element), [])]
        for child in element.children:
            if child.tag == "elseif":
                branches.append((self._condition(child), []))
            elif child.tag == "else":
                branches.append((lambda _: True, []))
            else:
                branches[-1][1].append(child)
        steps = [(condition, self.block(content)) for condition, content in branches]

        def choose(session: BlockContext) -> None:
            for condition, block in steps:
                if self.language.truth(self._tested(session, condition)):
                    for step in block:
                        step(session)
                    return

        return choose

    def _condition(self, element: Element) -> Evaluate:
        return self.expression(element, element.attributes.get("cond", ""))

    @staticmethod
    def _tested(session: BlockContext, condition: Evaluate) -> Any:
        try:
            return session.evaluate(condition)
        except DataError as error:
            session.fail(error)
            return False

    def _foreach(self, element: Element) -> Step:
        array = self.expression(element, element.attributes.get("array", ""))
        item, index = element.attributes.get("item", ""), element.attributes.get("index")
        block = self.block(element.children)

        def each(session: BlockContext) -> None:
            values = session.evaluate(array)
            if not isinstance(values, list) or len(values) > _LONGEST_LOOP:
                raise DataError("`foreach` goes over a list")
            for name in (item, index):
                if name is not None and (NAME.fullmatch(name) is None or name in _SYSTEM):
                    raise DataError(f"`{name}` is not a name for data")
            for name in (item, index):
                if name is not None and name not in session.store.values:
                    session.set(name, None)
            for number, value in enumerate(values):
                session.set(item, value)
                if index is not None:
                    session.set(index, number)
                for step in block:
                    step(session)

        return each

    def payload(self, element: Element, *, content: bool = True) -> Callable[[BlockContext], Any]:
        """The values of the parameters, the name list and, where allowed, the content of an element."""
        inner = next(iter(element.of("content")), None)
        if content and inner is not None:
            value = self.value(inner)
            return lambda session: session.evaluate(value)
        names = element.attributes.get("namelist", "").split()
        parameters = [
            (
                one.attributes.get("name", ""),
                self.expression(one, one.attributes.get("expr") or one.attributes.get("location", "")),
            )
            for one in element.of("param")
        ]
        listed = [(name, self.expression(element, name)) for name in names]

        def collect(session: BlockContext) -> Any:
            found = {name: session.evaluate(value) for name, value in listed}
            for name, value in parameters:
                try:
                    found[name] = session.evaluate(value)
                except DataError as error:
                    session.fail(error)
            return found or None

        return collect

    def either(self, element: Element, name: str, default: str | None = None) -> Callable[[BlockContext], Any]:
        """The value of an attribute, or of its ``...expr``."""
        computed = element.attributes.get(f"{name}expr")
        if computed is None:
            value = element.attributes.get(name, default)
            return lambda _: value
        expression = self.expression(element, computed)
        return lambda session: session.evaluate(expression)

    def _send(self, element: Element) -> Step:
        if any("basichttp" in value.lower() for value in element.attributes.values()):
            self.refuse(element, "events over HTTP are not supported", "a chart sends to itself only")
        event, target = self.either(element, "event"), self.either(element, "target", "")
        kind, delay = self.either(element, "type", "scxml"), self.either(element, "delay", "0s")
        payload, place = self.payload(element), element.attributes.get("idlocation")
        given = element.attributes.get("id")
        self._made += 1
        made = f"{self.prefix}.{self._made}"

        def send(session: BlockContext) -> None:
            label = given or (made if place is not None else None)
            try:
                if place is not None:
                    if place not in session.store.values:
                        raise DataError(f"there is no data `{place}`")
                    session.set(place, made)
                name, processor, where = event(session), kind(session), target(session)
                seconds = seconds_of(delay(session))
                data = payload(session)
                if not isinstance(name, str) or not name:
                    raise DataError("an event that is sent needs a name")
                _check_processor(processor)
                own = session.store.session or session.system["_sessionid"]
                route = _route(where, own, session.store.reachable)
            except DataError as error:
                session.fail(error, label)
                raise ReportedError from None
            if route == _INTERNAL:
                session.queue.append(ScxmlEvent(name, "internal", data, label))
            else:
                message = ScxmlEvent(name, "external", data, label, f"#_scxml_{own}")
                session.queue.append(Send(name, seconds, label, element.place, message, target=route))

        return send

    def _cancel(self, element: Element) -> Step:
        label = self.either(element, "sendid")
        return lambda session: session.queue.append(Cancel(str(label(session)), element.place))


class ReportedError(DataError):
    """An error that the chart has already received."""


def run_block(steps: list[Step], session: BlockContext) -> None:
    """Run a block; an error ends it, and the chart receives it."""
    try:
        for step in steps:
            step(session)
    except ReportedError:
        return
    except DataError as error:
        session.fail(error)
    except RecursionError:
        session.fail(DataError("the data is nested too deep"))


def _changed(value: Any, path: list[str], new: Any) -> Any:
    if not path:
        return new
    if not isinstance(value, dict):
        raise DataError(f"{value!r:.40} has no `{path[0]}`")
    return {**value, path[0]: _changed(value.get(path[0]), path[1:], new)}


def seconds_of(value: Any) -> float:
    """The seconds of a delay such as ``1.5s``.

    Raises:
        DataError: it is not a delay.
    """
    if value == 0 or (isinstance(value, str) and value.strip() == "0"):
        return 0.0
    found = _DELAY.fullmatch(value) if isinstance(value, str) else None
    seconds = float(found[1]) * _SECONDS[found[2]] if found else math.inf
    if not math.isfinite(seconds):
        raise DataError(f"`{value}` is not a delay")
    return seconds


def is_delay(text: str) -> bool:
    """Whether a text is a delay."""
    try:
        seconds_of(text)
    except DataError:
        return False
    return True


def _check_processor(kind: Any) -> None:
    if kind not in PROCESSORS:
        raise DataError(f"there is no event processor `{kind}`")


def _route(target: Any, session: str, reachable: Collection[str]) -> str | None:
    """Where an event goes: ``#_internal``, to another session, or None for the chart's own queue of external events."""
    if target in ("", None, f"#_scxml_{session}"):
        return None
    if target == _INTERNAL or target in reachable:
        return str(target)
    if isinstance(target, str) and target.startswith("#_"):
        raise CommunicationError(f"`{target}` cannot be reached")
    raise DataError(f"`{target}` is not a target")
