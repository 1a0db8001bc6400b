"""From a model to SCXML text.

States, history, transitions, raised and sent events have their counterpart in SCXML. The rest is written so that other
tools can understand it: conditions and assignments as this language's expressions in ``cond`` and ``expr``, time-outs
as events that are sent with a delay on entry and cancelled on exit, outcomes as completions under the condition that
their final state is reached, activities as ``invoke`` and one-shot actions as elements of a namespace of their own.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from xml.etree import ElementTree
from xml.sax.saxutils import escape

from hsm.interchange.scxml.elements import NAMESPACE
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
from hsm.model.expressions import EventValue, Expression, Literal
from hsm.model.rewriting import rewrite_expression
from hsm.model.topology import HISTORY
from hsm.model.unparse import activity_text, call_text, expression_text

OWN = "urn:maze-machine"
"""The namespace for features that SCXML lacks."""

_IN = re.compile(r"\bin\(([\w.-]+)\)")

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
    root = ElementTree.Element("scxml", {"xmlns": NAMESPACE, "xmlns:maze": OWN, "version": "1.0", "name": model.name})
    root.set("datamodel", "maze-machine" if model.variables or model.parameters or model.event_data else "null")
    elements = [root]
    for state in model.states[1:]:
        elements.append(ElementTree.SubElement(elements[state.parent], _TAGS.get(state.kind, "state"), id=state.name))
    _write_data(model, root)
    for state, element in zip(model.states, elements, strict=True):
        _write_state(model, state, element)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + "\n".join(_lines(root)) + "\n"


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


def _write_data(model: Model, root: ElementTree.Element) -> None:
    if not model.variables and not model.parameters:
        return
    data = ElementTree.Element("datamodel")
    for parameter in model.parameters:
        made_of = model.derived.get(parameter.name, Literal(parameter.default, parameter.type))
        value = {} if parameter.required else {"expr": expression_text(made_of)}
        ElementTree.SubElement(data, "data", {"id": parameter.name, **value})
    for variable in model.variables:
        ElementTree.SubElement(data, "data", id=variable.name, expr=expression_text(variable.initial))
    root.insert(0, data)


def _write_state(model: Model, state: State, element: ElementTree.Element) -> None:
    front: list[ElementTree.Element] = []
    targets = " ".join(model.states[index].name for index in state.initial)
    if state.kind in HISTORY:
        element.set("type", "deep" if state.kind is StateKind.DEEP_HISTORY else "shallow")
        default = ElementTree.SubElement(element, "transition", target=targets)
        _write_actions(model, default, state.initial_actions)
        return
    if state.initial_actions:
        initial = ElementTree.Element("initial")
        _write_actions(model, ElementTree.SubElement(initial, "transition", target=targets), state.initial_actions)
        front.append(initial)
    elif targets and state.kind is StateKind.COMPOUND:
        element.set("initial", targets)
    own = [model.transitions[index] for index in state.transitions]
    front.extend(_blocks(model, state, own))
    if state.activity is not None:
        call = activity_text(state.activity)
        front.append(ElementTree.Element("invoke", type=OWN, id=f"{state.name}.activity", src=call))
    for transition in own:
        front.extend(_transition(model, state, transition))
    at = 1 if state.index == 0 and element.find("datamodel") is not None else 0
    for offset, one in enumerate(front):
        element.insert(at + offset, one)


def _blocks(model: Model, state: State, own: list[Transition]) -> list[ElementTree.Element]:
    entry, leave = ElementTree.Element("onentry"), ElementTree.Element("onexit")
    for transition in own:
        if isinstance(transition.trigger, After | Every):
            _send_time_out(entry, state, transition, transition.trigger.duration)
            ElementTree.SubElement(leave, "cancel", sendid=_time_out(state, transition))
    _write_actions(model, entry, state.entry)
    _write_actions(model, leave, state.exit)
    return [block for block in (entry, leave) if len(block)]


def _send_time_out(element: ElementTree.Element, state: State, transition: Transition, duration: Expression) -> None:
    label = _time_out(state, transition)
    if isinstance(duration, Literal):
        when = {"delay": f"{duration.value!r}s"}
    else:
        when = {"delayexpr": expression_text(duration)}
    ElementTree.SubElement(element, "send", {"event": label, "id": label, **when})


def _time_out(state: State, transition: Transition) -> str:
    return f"after.{state.name}.{state.transitions.index(transition.index)}"


def _transition(model: Model, state: State, transition: Transition) -> Iterator[ElementTree.Element]:
    """A transition; one that waits for outcomes of its state waits for the completion besides."""
    conditions = [transition.trigger.condition] if isinstance(transition.trigger, When | Held) else []
    conditions += [transition.guard] if transition.guard is not None else []
    texts = [_condition(_text(one)) for one in conditions]
    match transition.trigger:
        case On(names):
            plain = [one for one in dict.fromkeys(names) if one != "done" or _may_report(model, state, "done")]
            if plain:
                yield _element(model, state, transition, " ".join(plain), texts)
            for event, condition in _completion(model, state, transition.trigger):
                yield _element(model, state, transition, event, [*condition, *texts])
        case Every(duration):
            element = _element(model, state, transition, _time_out(state, transition), texts)
            again = ElementTree.Element("transition")
            _send_time_out(again, state, transition, duration)
            element.insert(0, again[0])
            yield element
        case Held(_, duration):
            element = _element(model, state, transition, "", texts)
            element.set("maze:for", expression_text(duration))
            yield element
        case After():
            yield _element(model, state, transition, _time_out(state, transition), texts)
        case _:
            yield _element(model, state, transition, "", texts)


def _element(
    model: Model, state: State, transition: Transition, event: str, conditions: list[str]
) -> ElementTree.Element:
    element = ElementTree.Element("transition")
    if event:
        element.set("event", event)
    if conditions:
        joined = " and ".join(f"({text})" for text in conditions)
        element.set("cond", joined if len(conditions) > 1 else conditions[0])
    if transition.targets:
        element.set("target", " ".join(model.states[index].name for index in transition.targets))
        if transition.kind is TransitionKind.LOCAL and state.kind is StateKind.COMPOUND:
            element.set("type", "internal")
    _write_actions(model, element, transition.actions)
    return element


def _condition(text: str) -> str:
    return _IN.sub(r"In('\1')", text)


def _may_report(model: Model, state: State, outcome: str) -> bool:
    """Whether an activity of a state, or of one inside it, can have this outcome."""
    inside = model.states[state.index : state.last + 1]
    return any(one.activity is not None and outcome in one.activity.activity.outcomes for one in inside)


def _completion(model: Model, state: State, trigger: On) -> Iterator[tuple[str, list[str]]]:
    """SCXML's form of the outcomes that a trigger waits for: the state's completion, in one of its final states."""
    if trigger.prefix:
        return  # it was read from SCXML and has its names already
    if "done" in trigger.names and (_finals(model, state) or state.kind is StateKind.PARALLEL):
        yield f"done.state.{state.name}", []
    for around in model.states[max(state.index, 1) : state.last + 1]:
        finals = _finals(model, around)
        meant = [one for one in finals if one.own_name in trigger.names]
        if meant and not (around is state and "done" in trigger.names):
            reached = " or ".join(f"In('{one.name}')" for one in meant)
            yield f"done.state.{around.name}", [] if len(meant) == len(finals) else [reached]


def _finals(model: Model, state: State) -> list[State]:
    return [model.states[one] for one in state.children if model.states[one].kind is StateKind.FINAL]


def _text(expression: Expression) -> str:
    """An expression; what an event carries goes by SCXML's name."""
    return expression_text(_renamed(expression))


def _renamed(expression: Expression) -> Expression:
    """An expression with SCXML's names for what the event carries."""

    def renamed(part: Expression) -> Expression:
        name = part.name.rpartition(".")[2] if isinstance(part, EventValue) else ""
        return replace(part, name=f"_event.data.{name}") if isinstance(part, EventValue) else part

    return rewrite_expression(expression, renamed)


def _write_data_of(model: Model, element: ElementTree.Element, event: str, arguments: tuple[Expression, ...]) -> None:
    declared = model.data_of(event)
    fields = () if declared is None else declared.fields
    for field, argument in zip(fields, arguments, strict=True):
        ElementTree.SubElement(element, "param", name=field.name, expr=_text(argument))


def _write_actions(model: Model, element: ElementTree.Element, actions: tuple[Action, ...]) -> None:
    for action in actions:
        match action:
            case Raise(event, arguments=()):
                ElementTree.SubElement(element, "raise", event=event)
            case Raise(event, arguments=arguments):
                # `raise` carries nothing in SCXML; an event that is sent to the session itself is the same.
                sent = ElementTree.SubElement(element, "send", event=event, target="#_internal")
                _write_data_of(model, sent, event, arguments)
            case Send(event, delay, label, arguments=arguments):
                given = {
                    "event": event,
                    **({"delay": f"{delay!r}s"} if delay else {}),
                    **({"id": label} if label else {}),
                }
                _write_data_of(model, ElementTree.SubElement(element, "send", given), event, arguments)
            case Emit(event, arguments=arguments):
                _write_data_of(model, ElementTree.SubElement(element, "maze:send", event=event), event, arguments)
            case Cancel(label):
                ElementTree.SubElement(element, "cancel", sendid=label)
            case Assign(variable, value):
                ElementTree.SubElement(element, "assign", location=variable, expr=_text(value))
            case Call(declared, arguments):
                text = call_text(declared.name, declared.parameters, [_renamed(one) for one in arguments])
                ElementTree.SubElement(element, "maze:call", text=text)
