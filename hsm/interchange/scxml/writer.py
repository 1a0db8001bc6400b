"""From a model to SCXML text.

States, history, transitions, raised and sent events have their counterpart in SCXML. The rest is written so that other
tools can understand it: time-outs as events that are sent with a delay on entry and cancelled on exit, outcomes as
completions under the condition that their final state is reached, activities as ``invoke`` and one-shot actions as
elements of a namespace of their own. Variables, conditions and what events carry are ECMAScript, in SI numbers, if the
machine asks no signals and runs no actions of a registry; otherwise they are in this language.
"""

from __future__ import annotations

from collections.abc import Iterator
from decimal import Decimal
from xml.etree import ElementTree
from xml.sax.saxutils import escape

from hsm.interchange.scxml.ecmascript import EcmaScript, has_words_for
from hsm.interchange.scxml.elements import NAMESPACE
from hsm.interchange.scxml.own_words import OWN_DATA_MODEL, OwnWords, renamed
from hsm.model.chart import (
    Action,
    After,
    Assign,
    Call,
    Cancel,
    Emit,
    Every,
    Held,
    Model,
    On,
    Raise,
    Send,
    State,
    StateKind,
    Transition,
    TransitionKind,
    When,
)
from hsm.model.codes import finding
from hsm.model.diagnostics import MachineError
from hsm.model.expressions import Active, Binary, Expression, Literal
from hsm.model.topology import HISTORY
from hsm.model.types import BOOLEAN
from hsm.model.unparse import activity_text, call_text
from hsm.model.values import dataclass

OWN = "urn:maze-machine"
"""The namespace for features that SCXML lacks."""

_ESCAPES = {'"': "&quot;", "\n": "&#10;", "\r": "&#13;", "\t": "&#9;"}
_DEEPEST_INDENT = 100
"""What lies deeper is not indented further: the document would grow with the square of its depth."""

_TAGS = {
    StateKind.PARALLEL: "parallel",
    StateKind.FINAL: "final",
    StateKind.SHALLOW_HISTORY: "history",
    StateKind.DEEP_HISTORY: "history",
}


def write_text(model: Model) -> str:
    """The model as an SCXML document.

    Raises:
        MachineError: it is a chart with a data model, whose document is the only text of it.
    """
    if model.store is not None:
        place = model.states[0].place
        raise MachineError(
            [finding("E0905", place, "a chart with a data model cannot be exported", "keep its document")]
        )
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + "\n".join(_lines(_Writer.of(model).document())) + "\n"


def _lines(root: ElementTree.Element) -> Iterator[str]:
    """An element with its contents, one tag per line; Python's stack limits the depth of the library's own writer."""
    pending: list[tuple[int, ElementTree.Element | str]] = [(0, root)]
    while pending:
        depth, element = pending.pop()
        indent = "  " * min(depth, _DEEPEST_INDENT)
        if isinstance(element, str):
            yield f"{indent}</{element}>"
            continue
        attributes = "".join(f' {name}="{escape(value, _ESCAPES)}"' for name, value in element.items())
        yield f"{indent}<{element.tag}{attributes}{'>' if len(element) else ' />'}"
        if len(element):
            pending.append((depth, element.tag))
            pending.extend((depth + 1, child) for child in reversed(element))


@dataclass(frozen=True, slots=True)
class _Writer:
    """Writes one machine.

    Attributes:
        model: the machine.
        words: writes its expressions.
        data_model: in which language those are.
    """

    model: Model
    words: EcmaScript | OwnWords
    data_model: str

    @classmethod
    def of(cls, model: Model) -> _Writer:
        """The writer for a machine."""
        data = bool(model.variables or model.parameters or model.event_data)
        if has_words_for(model):
            return cls(model, EcmaScript.of(model), "ecmascript" if data else "null")
        return cls(model, OwnWords(), OWN_DATA_MODEL)

    def document(self) -> ElementTree.Element:
        """The whole document."""
        model = self.model
        root = ElementTree.Element(
            "scxml", {"xmlns": NAMESPACE, "xmlns:maze": OWN, "version": "1.0", "name": model.name}
        )
        root.set("datamodel", self.data_model)
        elements = [root]
        for state in model.states[1:]:
            tag = _TAGS.get(state.kind, "state")
            elements.append(ElementTree.SubElement(elements[state.parent], tag, id=state.name))
        self._write_data(root)
        for state, element in zip(model.states, elements, strict=True):
            self._write_state(state, element)
        return root

    def _write_data(self, root: ElementTree.Element) -> None:
        model, words = self.model, self.words
        if not model.variables and not model.parameters:
            return
        data = ElementTree.Element("datamodel")
        for parameter in model.parameters:
            made_of = model.derived.get(parameter.name, Literal(parameter.default, parameter.type))
            value = {} if parameter.required else {"expr": words.value(made_of)}
            ElementTree.SubElement(data, "data", {"id": words.name(parameter.name), **value})
        for variable in model.variables:
            known = variable.scope == 0 or isinstance(variable.initial, Literal)
            value = {"expr": words.value(variable.initial)} if known else {}
            ElementTree.SubElement(data, "data", {"id": words.name(variable.name), **value})
        root.insert(0, data)

    def _write_state(self, state: State, element: ElementTree.Element) -> None:
        front: list[ElementTree.Element] = []
        targets = " ".join(self.model.states[index].name for index in state.initial)
        if state.kind in HISTORY:
            element.set("type", "deep" if state.kind is StateKind.DEEP_HISTORY else "shallow")
            default = ElementTree.SubElement(element, "transition", target=targets)
            self._write_actions(default, state.initial_actions)
            return
        if state.initial_actions:
            initial = ElementTree.Element("initial")
            self._write_actions(ElementTree.SubElement(initial, "transition", target=targets), state.initial_actions)
            front.append(initial)
        elif targets and state.kind is StateKind.COMPOUND:
            element.set("initial", targets)
        own = [self.model.transitions[index] for index in state.transitions]
        front.extend(self._blocks(state, own))
        if state.activity is not None:
            call = activity_text(state.activity)
            front.append(ElementTree.Element("invoke", type=OWN, id=f"{state.name}.activity", src=call))
        for transition in own:
            front.extend(self._transition(state, transition))
        at = 1 if state.index == 0 and element.find("datamodel") is not None else 0
        for offset, one in enumerate(front):
            element.insert(at + offset, one)

    def _blocks(self, state: State, own: list[Transition]) -> list[ElementTree.Element]:
        entry, leave = ElementTree.Element("onentry"), ElementTree.Element("onexit")
        begun = [one for one in self.model.variables if one.scope == state.index and state.index > 0]
        self._write_actions(entry, tuple(Assign(one.name, one.initial) for one in begun))
        for transition in own:
            if isinstance(transition.trigger, After | Every):
                self._send_time_out(entry, state, transition, transition.trigger.duration)
                ElementTree.SubElement(leave, "cancel", sendid=_time_out(state, transition))
        self._write_actions(entry, state.entry)
        self._write_actions(leave, state.exit)
        return [block for block in (entry, leave) if len(block)]

    def _send_time_out(
        self, element: ElementTree.Element, state: State, transition: Transition, duration: Expression
    ) -> None:
        label = _time_out(state, transition)
        if isinstance(duration, Literal):
            when = {"delay": _delay(duration.value)}
        else:
            when = {"delayexpr": self.words.delay(duration)}
        ElementTree.SubElement(element, "send", {"event": label, "id": label, **when})

    def _transition(self, state: State, transition: Transition) -> Iterator[ElementTree.Element]:
        """A transition; one that waits for outcomes of its state waits for the completion besides."""
        conditions = [transition.trigger.condition] if isinstance(transition.trigger, When | Held) else []
        conditions += [transition.guard] if transition.guard is not None else []
        match transition.trigger:
            case On(names):
                plain = [one for one in dict.fromkeys(names) if one != "done" or self._may_report(state, "done")]
                if plain:
                    yield self._element(state, transition, " ".join(plain), conditions)
                for event, reached in self._completion(state, transition.trigger):
                    yield self._element(state, transition, event, [*reached, *conditions])
            case Every(duration):
                element = self._element(state, transition, _time_out(state, transition), conditions)
                again = ElementTree.Element("transition")
                self._send_time_out(again, state, transition, duration)
                element.insert(0, again[0])
                yield element
            case Held(_, duration):
                element = self._element(state, transition, "", conditions)
                element.set("maze:for", self.words.value(duration))
                yield element
            case After():
                yield self._element(state, transition, _time_out(state, transition), conditions)
            case _:
                yield self._element(state, transition, "", conditions)

    def _element(
        self, state: State, transition: Transition, event: str, conditions: list[Expression]
    ) -> ElementTree.Element:
        element = ElementTree.Element("transition")
        if event:
            element.set("event", event)
        if conditions:
            element.set("cond", self.words.condition(conditions))
        if transition.targets:
            element.set("target", " ".join(self.model.states[index].name for index in transition.targets))
            if transition.kind is TransitionKind.LOCAL and state.kind is StateKind.COMPOUND:
                element.set("type", "internal")
        self._write_actions(element, transition.actions)
        return element

    def _may_report(self, state: State, outcome: str) -> bool:
        """Whether an activity of a state, or of one inside it, can have this outcome."""
        inside = self.model.states[state.index : state.last + 1]
        return any(one.activity is not None and outcome in one.activity.activity.outcomes for one in inside)

    def _completion(self, state: State, trigger: On) -> Iterator[tuple[str, list[Expression]]]:
        """What SCXML calls the outcomes that a trigger waits for: the completion of a state, in a final state."""
        if trigger.prefix:
            return  # it was read from SCXML and has its names already
        if "done" in trigger.names and (self._finals(state) or state.kind is StateKind.PARALLEL):
            yield f"done.state.{state.name}", []
        for around in self.model.states[max(state.index, 1) : state.last + 1]:
            finals = self._finals(around)
            meant = [one for one in finals if one.own_name in trigger.names]
            if meant and not (around is state and "done" in trigger.names):
                reached: Expression = Active(meant[0].name)
                for one in meant[1:]:
                    reached = Binary("or", reached, Active(one.name), BOOLEAN)
                yield f"done.state.{around.name}", [] if len(meant) == len(finals) else [reached]

    def _finals(self, state: State) -> list[State]:
        return [self.model.states[one] for one in state.children if self.model.states[one].kind is StateKind.FINAL]

    def _write_data_of(self, element: ElementTree.Element, event: str, arguments: tuple[Expression, ...]) -> None:
        declared = self.model.data_of(event)
        fields = () if declared is None else declared.fields
        for field, argument in zip(fields, arguments, strict=True):
            ElementTree.SubElement(element, "param", name=field.name, expr=self.words.value(argument))

    def _write_actions(self, element: ElementTree.Element, actions: tuple[Action, ...]) -> None:
        for action in actions:
            match action:
                case Raise(event, arguments=()):
                    ElementTree.SubElement(element, "raise", event=event)
                case Raise(event, arguments=arguments):
                    # `raise` carries nothing in SCXML; an event that is sent to the session itself is the same.
                    sent = ElementTree.SubElement(element, "send", event=event, target="#_internal")
                    self._write_data_of(sent, event, arguments)
                case Send(event, delay, label, arguments=arguments):
                    given = {
                        "event": event,
                        **({"delay": _delay(delay)} if delay else {}),
                        **({"id": label} if label else {}),
                    }
                    self._write_data_of(ElementTree.SubElement(element, "send", given), event, arguments)
                case Emit(event, arguments=arguments):
                    self._write_data_of(ElementTree.SubElement(element, "maze:send", event=event), event, arguments)
                case Cancel(label):
                    ElementTree.SubElement(element, "cancel", sendid=label)
                case Assign(variable, value):
                    location = self.words.name(variable)
                    ElementTree.SubElement(element, "assign", location=location, expr=self.words.value(value))
                case Call(declared, arguments):
                    text = call_text(declared.name, declared.parameters, [renamed(one) for one in arguments])
                    ElementTree.SubElement(element, "maze:call", text=text)


def _time_out(state: State, transition: Transition) -> str:
    return f"after.{state.name}.{state.transitions.index(transition.index)}"


def _delay(seconds: float) -> str:
    """A duration as SCXML writes it: without an exponent."""
    return f"{Decimal(repr(seconds)):f}s"
