"""Expressions, triggers and actions in the author's words, for reports, drawings and explanations."""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import Enum
from typing import Any

from hsm.model.chart import (
    Action,
    ActivityCall,
    After,
    Assign,
    Call,
    Cancel,
    Defer,
    Else,
    Emit,
    Every,
    Execute,
    Held,
    On,
    Raise,
    Send,
    Trigger,
    When,
)
from hsm.model.expressions import Active, Binary, Choice, Expression, Literal, SignalValue, Unary, VariableValue
from hsm.model.registry import Parameter
from hsm.model.types import UNITS, Quantity, Type, si_value

_BINDING = {"or": 1, "and": 2, "not": 3, "==": 4, "!=": 4, "<": 4, "<=": 4, ">": 4, ">=": 4}
_BINDING |= {"+": 5, "-": 5, "*": 6, "/": 6}
_ATOM = 9
_DEGREES = {Quantity(angle=1): "deg", Quantity(angle=1, time=-1): "deg/s"}


def value_text(value: Any, kind: Type | None = None) -> str:
    """A value of the language as an author would write it; quantities carry their unit.

    Args:
        value: a bool, a number in SI units, a string or a member of an enumeration.
        kind: its type, which gives the unit.
    """
    if value is True or value is False:
        return "true" if value else "false"
    if isinstance(value, Enum):
        return str(value.value)
    if isinstance(kind, Quantity) and kind != Quantity():
        written, unit = _quantity_text(value, kind)
        return f"{written} {unit}" if unit in UNITS else f"{written} ({unit})"
    return _number_text(value) if isinstance(value, float) else str(value)


def shown_text(value: Any, kind: Type | None = None) -> str:
    """A value for a person to read: like `value_text`, with at most six significant digits."""
    return value_text(float(f"{value:.6g}") if isinstance(value, float) else value, kind)


def _quantity_text(value: float, kind: Quantity) -> tuple[str, str]:
    """A quantity and its unit: angles in degrees where they are written so in few digits."""
    degrees = _DEGREES.get(kind)
    if degrees is not None:
        written = f"{math.degrees(value):.10g}"
        if si_value(written, UNITS[degrees]) == value:
            return written, degrees
    return _number_text(value), kind.si_unit


def _number_text(value: float) -> str:
    """The shortest text that reads back as the same number."""
    written = f"{value:.10g}"
    return written if float(written) == value else repr(float(value))


def expression_text(expression: Expression) -> str:
    """An expression with as few parentheses as its meaning needs."""
    return _bound(expression)[0]


def _bound(expression: Expression) -> tuple[str, int]:
    """The text of an expression and how tightly its outermost operator binds."""
    match expression:
        case Literal(value, kind):
            return value_text(value, kind), _ATOM
        case VariableValue(name):
            return name, _ATOM
        case SignalValue(signal, arguments):
            return call_text(signal.name, signal.parameters, arguments), _ATOM
        case Active(state):
            return f"in({state})", _ATOM
        case Unary("abs", operand):
            return f"abs({expression_text(operand)})", _ATOM
        case Unary(operator, operand):
            level = _BINDING["not"] if operator == "not" else _BINDING["*"]
            space = " " if operator == "not" else ""
            return f"{operator}{space}{_inside(operand, level)}", level
        case Binary("min" | "max" as operator, left, right):
            return f"{operator}({expression_text(left)}, {expression_text(right)})", _ATOM
        case Binary(operator, left, right):
            level = _BINDING[operator]
            loose = level if level != _BINDING["=="] else level + 1
            tight = level if operator in ("and", "or") else level + 1
            return f"{_inside(left, loose)} {operator} {_inside(right, tight)}", level
        case Choice(condition, then, otherwise):
            return f"{_inside(then, 1)} if {_inside(condition, 1)} else {_bound(otherwise)[0]}", 0


def _inside(expression: Expression, level: int) -> str:
    text, binding = _bound(expression)
    return text if binding >= level else f"({text})"


def call_text(name: str, parameters: Sequence[Parameter], arguments: Sequence[Expression]) -> str:
    """A call as short as an author would write it: without the defaults, and required arguments without their names."""
    given = []
    for parameter, argument in zip(parameters, arguments, strict=False):
        if parameter.required:
            given.append(expression_text(argument))
        elif not (isinstance(argument, Literal) and argument.value == parameter.default):
            given.append(f"{parameter.name} = {expression_text(argument)}")
    return f"{name}({', '.join(given)})" if given else name


def activity_text(call: ActivityCall) -> str:
    """What a state does."""
    return call_text(call.activity.name, call.activity.parameters, call.arguments)


def trigger_text(trigger: Trigger, guard: Expression | None = None) -> str:
    """What a transition waits for, with its guard."""
    match trigger:
        case Defer(names):
            text = f"defer {', '.join(names)}"
        case On(names):
            text = f"on {', '.join(names)}"
        case Else():
            text = "else"
        case When(condition):
            text = f"when {expression_text(condition)}"
        case Held(condition, duration):
            text = f"when {expression_text(condition)} for {_inside(duration, 1)}"
        case After(duration):
            text = f"after {_inside(duration, 1)}"
        case Every(duration):
            text = f"every {_inside(duration, 1)}"
        case _:
            text = ""
    return " ".join(part for part in (text, f"if {expression_text(guard)}" if guard else "") if part)


def _with_arguments(event: str, arguments: Sequence[Expression]) -> str:
    return f"{event}({', '.join(map(expression_text, arguments))})" if arguments else event


def action_text(action: Action) -> str:
    """One action."""
    match action:
        case Assign(variable, Binary("+" | "-" | "*" | "/" as operator, VariableValue(name), value)) if (
            name == variable
        ):
            return f"{variable} {operator}= {expression_text(value)}"
        case Assign(variable, value):
            return f"{variable} = {expression_text(value)}"
        case Call(declared, arguments):
            return call_text(declared.name, declared.parameters, arguments)
        case Raise(event, arguments=arguments):
            return f"raise {_with_arguments(event, arguments)}"
        case Send(event, delay, arguments=arguments):
            sent = _with_arguments(event, arguments)
            return f"raise {sent} after {value_text(delay, Quantity(time=1))}" if delay else f"send {sent}"
        case Execute(text):
            return text
        case Emit(event, arguments=arguments):
            return f"send {_with_arguments(event, arguments)}"
        case Cancel(label):
            return f"cancel {label}"
