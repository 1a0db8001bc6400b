"""Expressions of a machine in ECMAScript, in SI numbers: what charts with a data model are written in."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from enum import Enum
from typing import Any

from hsm.model.chart import Call, Model
from hsm.model.expressions import (
    Active,
    Binary,
    Choice,
    EventValue,
    Expression,
    Literal,
    SignalValue,
    Unary,
    VariableValue,
)
from hsm.model.rewriting import actions_of, expressions_of, parts_of
from hsm.model.values import dataclass

RESERVED = frozenset({
    "In", "Math", "and", "arguments", "as", "async", "await", "break", "case", "catch", "class", "const",
    "continue", "debugger", "default", "delete", "do", "else", "enum", "eval", "export", "extends", "false",
    "finally", "for", "from", "function", "if", "implements", "import", "in", "instanceof", "interface", "is",
    "lambda", "let", "new", "None", "not", "null", "of", "or", "package", "private", "protected", "public",
    "return", "static", "super", "switch", "this", "throw", "True", "true", "try", "typeof", "undefined",
    "var", "void", "while", "with", "yield", "False",
})  # fmt: skip
"""Words that no piece of data can have as its name, in this language or in Python's."""

_OPERATORS = {"or": "||", "and": "&&", "==": "===", "!=": "!=="}
_BINDING = {"||": 1, "&&": 2, "===": 3, "!==": 3, "<": 4, "<=": 4, ">": 4, ">=": 4, "+": 5, "-": 5, "*": 6, "/": 6}
_UNARY, _ATOM = 7, 9


def has_words_for(model: Model) -> bool:
    """Whether everything that a machine computes can be said: it asks no signals and runs no actions of a registry."""
    computed = (*expressions_of(model), *(one.initial for one in model.variables))
    asks = any(isinstance(part, SignalValue) for one in computed for part in parts_of(one))
    return not asks and not any(isinstance(one, Call) for one in actions_of(model))


@dataclass(frozen=True, slots=True)
class EcmaScript:
    """Writes the expressions of one machine.

    Attributes:
        names: what the data is called, by the names of the machine's variables and parameters.
    """

    names: Mapping[str, str]

    @classmethod
    def of(cls, model: Model) -> EcmaScript:
        """The writer for a machine; dots become underscores, and a name that is taken gets one at its end."""
        found: dict[str, str] = {}
        for name in (*(one.name for one in model.parameters), *(one.name for one in model.variables)):
            made = name.replace(".", "_")
            while made in RESERVED or made in found.values():
                made += "_"
            found[name] = made
        return cls(found)

    def condition(self, expressions: Iterable[Expression]) -> str:
        """What holds if all of some conditions do."""
        parts = list(expressions)
        return self.value(parts[0]) if len(parts) == 1 else " && ".join(self._inside(one, 2) for one in parts)

    def value(self, expression: Expression) -> str:
        """An expression."""
        return self._bound(expression)[0]

    def name(self, variable: str) -> str:
        """What a variable or parameter is called."""
        return self.names[variable]

    def delay(self, duration: Expression) -> str:
        """A duration as the text that SCXML takes for a delay."""
        return f"({self.value(duration)}) + 's'"

    def _bound(self, expression: Expression) -> tuple[str, int]:
        """The text of an expression, and how tightly its outermost operator binds."""
        match expression:
            case Literal(value):
                text = _literal(value)
                return text, _UNARY if text.startswith("-") else _ATOM
            case EventValue(name):
                field = name.rpartition(".")[2]
                return f"_event.data['{field}']" if field in RESERVED else f"_event.data.{field}", _ATOM
            case VariableValue(name):
                return self.names[name], _ATOM
            case Active(state):
                return f"In('{state}')", _ATOM
            case Unary("abs", operand):
                return f"Math.abs({self.value(operand)})", _ATOM
            case Unary(operator, operand):
                return f"{'!' if operator == 'not' else operator}{self._inside(operand, _UNARY + 1)}", _UNARY
            case Binary("min" | "max" as function, left, right):
                return f"Math.{function}({self.value(left)}, {self.value(right)})", _ATOM
            case Binary(operator, left, right):
                sign = _OPERATORS.get(operator, operator)
                level = _BINDING[sign]
                return f"{self._inside(left, level)} {sign} {self._inside(right, level + 1)}", level
            case Choice(condition, then, otherwise):
                return f"{self._inside(condition, 1)} ? {self._inside(then, 1)} : {self._bound(otherwise)[0]}", 0
            case SignalValue(signal):
                raise ValueError(f"`{signal.name}` is a signal, which no chart can ask")

    def _inside(self, expression: Expression, level: int) -> str:
        text, binding = self._bound(expression)
        return text if binding >= level else f"({text})"


def _literal(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, Enum | str):
        return f"'{value.value if isinstance(value, Enum) else value}'"
    return repr(value)
