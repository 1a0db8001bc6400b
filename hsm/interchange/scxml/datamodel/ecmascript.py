"""Expressions of the data model ``ecmascript``: ECMAScript's operators, with their meaning there.

The data of a chart is plain, so that it can be saved: ``null`` and ``undefined`` are one value, and lists and objects
are equal where they hold the same.

Source: ECMA-262, ECMAScript Language Specification, chapter 7 (conversions and comparisons) and chapter 13.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from decimal import Decimal
from typing import Any, ClassVar

from hsm.interchange.scxml.datamodel.expressions import (
    DataError,
    Evaluate,
    Language,
    finite,
    joined,
    owned,
    same_text,
    undeclared,
)
from hsm.interchange.scxml.datamodel.tokens import InvalidExpressionError, Lexeme, UnsupportedError

_LARGEST_WHOLE = 2**53
_DECIMAL = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_CLASSES: dict[str, tuple[type, ...]] = {"Array": (list,), "Object": (list, dict)}


def _whole(value: float) -> int | float:
    """A number, as a whole number where it is one that is exact."""
    if isinstance(value, float) and value.is_integer() and 0 < abs(value) <= _LARGEST_WHOLE:
        return int(value)
    return float(value) if isinstance(value, int) and abs(value) > _LARGEST_WHOLE else value


def _truth(value: Any) -> bool:
    if isinstance(value, float) and math.isnan(value):
        return False
    return isinstance(value, list | dict) or bool(value)


def _to_number(value: Any) -> int | float:
    """The conversion ToNumber; a text that is not a number gives NaN."""
    if isinstance(value, bool):
        return int(value)
    if isinstance(value, int | float):
        return value
    if isinstance(value, str):
        body = value.strip()
        return _whole(float(body)) if _DECIMAL.fullmatch(body) else math.nan if body else 0
    raise DataError(f"{value!r:.40} is not a number")


def _number_text(value: int | float) -> str:
    """The conversion of a number to text: the shortest digits, with an exponent from 1e21 on and below 1e-6."""
    _, digits, exponent = Decimal(repr(abs(value))).normalize().as_tuple()
    text, point = "".join(map(str, digits)), len(digits) + int(exponent)
    minus = "-" if value < 0 else ""
    if len(text) <= point <= 21:
        return minus + text.ljust(point, "0")
    if 0 < point <= 21:
        return f"{minus}{text[:point]}.{text[point:]}"
    if -6 < point <= 0:
        return f"{minus}0.{'0' * -point}{text}" if value else "0"
    fraction = f".{text[1:]}" if len(text) > 1 else ""
    return f"{minus}{text[0]}{fraction}e{point - 1:+d}"


def _text(value: Any) -> str:
    """The conversion ToString."""
    match value:
        case bool():
            return str(value).lower()
        case str():
            return value
        case int() | float():
            return _number_text(value)
        case list():
            return ",".join("" if one is None else _text(one) for one in value)
        case dict():
            return "[object Object]"
    raise DataError("null and undefined have no text of their own here")


def _kind(value: Any) -> str:
    """What ``typeof`` says of a value."""
    match value:
        case bool():
            return "boolean"
        case int() | float():
            return "number"
        case str():
            return "string"
    return "undefined" if value is None else "object"


def _loose(first: Any, second: Any) -> bool:
    """The operator ``==``."""
    if first is None or second is None:
        return first is second
    if isinstance(first, list | dict) and isinstance(second, list | dict):
        return first == second
    if isinstance(first, list | dict) or isinstance(second, list | dict):
        raise DataError("a list or object is not compared with another kind of value")
    if isinstance(first, str) and isinstance(second, str):
        return same_text(first, second)
    return _to_number(first) == _to_number(second)


def _strict(first: Any, second: Any) -> bool:
    """The operator ``===``."""
    return _kind(first) == _kind(second) and _loose(first, second)


def _ordered(compare: Callable[[Any, Any], bool]) -> Callable[[Any, Any], bool]:
    def ordered(first: Any, second: Any) -> bool:
        if isinstance(first, str) and isinstance(second, str):
            return compare(first, second)
        return compare(_to_number(first), _to_number(second))

    return ordered


def _contained(name: Any, owner: Any) -> bool:
    """The operator ``in``: whether an owner has a member of that name."""
    if isinstance(owner, dict):
        return _text(name) in owner
    if isinstance(owner, list):
        return name == "length" or (isinstance(name, int) and 0 <= name < len(owner))
    raise DataError(f"nothing is in {owner!r:.40}")


_COMPARE: dict[str, Callable[[Any, Any], bool]] = {
    "==": _loose,
    "!=": lambda first, second: not _loose(first, second),
    "===": _strict,
    "!==": lambda first, second: not _strict(first, second),
    "<": _ordered(lambda first, second: first < second),
    "<=": _ordered(lambda first, second: first <= second),
    ">": _ordered(lambda first, second: first > second),
    ">=": _ordered(lambda first, second: first >= second),
    "in": _contained,
}


def _concat(owner: Any, *others: Any) -> Any:
    if isinstance(owner, str):
        return owner + "".join(map(_text, others))
    return owned(owner, list) + [one for other in others for one in (other if isinstance(other, list) else [other])]


def _index(owner: Any, part: Any) -> int:
    if isinstance(owner, str):
        return owner.find(_text(part))
    return next((at for at, one in enumerate(owned(owner, list)) if _strict(one, part)), -1)


def _definite(value: Any) -> int | float:
    number = _to_number(value)
    if math.isnan(number):
        raise DataError(f"{value!r:.40} is not a number")
    return number


def _rounded(value: Any) -> int | float:
    number = _to_number(value)
    return _whole(float(math.floor(number + 0.5))) if abs(number) < _LARGEST_WHOLE else number


class EcmaScriptLanguage(Language):
    """ECMAScript's expressions, as far as they compute with plain data."""

    beyond = frozenset(
        {"=>", "++", "--", "+=", "-=", "*=", "/=", "%=", "&=", "|=", "^=", ";", "**", ">>>", ">>", "<<", "&", "|"}
        | {"^", "~", "?.", "??", "...", "`", "//"}
        | {"function", "new", "class", "await", "async", "yield", "delete", "this", "void", "import", "super"}
    )
    constants: ClassVar[dict[str, Any]] = {"true": True, "false": False, "null": None, "undefined": None}
    reserved = frozenset(
        {"break", "case", "catch", "const", "continue", "debugger", "default", "do", "else", "enum", "export"}
        | {"extends", "finally", "for", "if", "in", "instanceof", "let", "return", "switch", "throw", "try", "typeof"}
        | {"var", "while", "with"}
    )
    functions: ClassVar[dict[str, Callable[..., Any]]] = {
        "String": _text,
        "Number": _to_number,
        "Boolean": _truth,
        "Math.abs": lambda value: abs(_to_number(value)),
        "Math.floor": lambda value: math.floor(_to_number(value)),
        "Math.ceil": lambda value: math.ceil(_to_number(value)),
        "Math.round": _rounded,
        "Math.min": lambda *values: min(map(_definite, values)),
        "Math.max": lambda *values: max(map(_definite, values)),
    }
    methods: ClassVar[dict[str, Callable[..., Any]]] = {
        "hasOwnProperty": lambda owner, name: _contained(name, owned(owner, dict, list)),
        "startsWith": lambda owner, text: owned(owner, str).startswith(_text(text)),
        "endsWith": lambda owner, text: owned(owner, str).endswith(_text(text)),
        "indexOf": _index,
        "includes": lambda owner, part: _index(owner, part) >= 0,
        "concat": _concat,
        "toString": _text,
    }

    truth = staticmethod(_truth)

    @staticmethod
    def computed(operator: str, first: Any, second: Any) -> Any:
        """Texts, lists and objects are joined as texts by ``+``; the rest is arithmetic of numbers."""
        if operator == "+" and any(isinstance(one, str | list | dict) for one in (first, second)):
            return _text(first) + _text(second)
        one, other = _to_number(first), _to_number(second)
        try:
            match operator:
                case "+":
                    return _whole(one + other)
                case "-":
                    return _whole(one - other)
                case "*":
                    return _whole(one * other)
                case "/":
                    return _whole(one / other)
            return _whole(math.fmod(one, other))
        except (ZeroDivisionError, OverflowError, ValueError):
            raise DataError("the number is not finite") from None

    @staticmethod
    def member(owner: Any, name: Any) -> Any:
        """The value of a key, the part at an index, or ``length``; undefined where there is none."""
        if isinstance(owner, dict):
            return owner.get(_text(name))
        if isinstance(owner, list | str):
            if name == "length":
                return len(owner)
            index = _whole(name) if isinstance(name, int | float) and not isinstance(name, bool) else None
            if isinstance(index, int):
                return owner[index] if 0 <= index < len(owner) else None
        raise DataError(f"{owner!r:.40} has no `{name}`")

    attribute = member

    def choice(self, depth: int) -> Evaluate:
        """``CONDITION ? A : B``, or what binds tighter."""
        first = self.left[0].kind if self.left else ""
        condition = self._disjunction(depth)
        if first == "name" and self.at("="):
            raise UnsupportedError("`=`, which assigns; `==` compares")
        if not self.take("?"):
            return condition
        then = self.choice(self.deeper(depth))
        self.expect(":")
        other, truth = self.choice(self.deeper(depth)), self.truth
        return lambda env: then(env) if truth(condition(env)) else other(env)

    def _disjunction(self, depth: int) -> Evaluate:
        first = self._conjunction(depth)
        while self.take("||"):
            first = joined(self.truth, first, self._conjunction(depth), conjunction=False)
        return first

    def _conjunction(self, depth: int) -> Evaluate:
        first = self._equality(depth)
        while self.take("&&"):
            first = joined(self.truth, first, self._equality(depth), conjunction=True)
        return first

    def _equality(self, depth: int) -> Evaluate:
        first = self._relation(depth)
        while name := self.take("==", "!=", "===", "!=="):
            first = _compared(_COMPARE[name], first, self._relation(depth))
        return first

    def _relation(self, depth: int) -> Evaluate:
        first = self.sum(depth)
        while name := self.take("<", "<=", ">", ">=", "in", "instanceof"):
            first = self._instance(first) if name == "instanceof" else _compared(_COMPARE[name], first, self.sum(depth))
        return first

    def _instance(self, operand: Evaluate) -> Evaluate:
        """Whether a value is a list (``Array``), or a list or an object (``Object``)."""
        name = str(self.left.pop(0).value) if self.left else ""
        if name not in _CLASSES:
            raise UnsupportedError(f"`instanceof {name}`")
        return lambda env: isinstance(operand(env), _CLASSES[name])

    def unary(self, depth: int) -> Evaluate:
        """An operand with the operators before it."""
        sign = self.take("!", "-", "+", "typeof")
        if sign is None:
            return self.postfix(depth)
        if sign == "typeof":
            return self._typeof(depth)
        operand, truth = self.unary(self.deeper(depth)), self.truth
        match sign:
            case "!":
                return lambda env: not truth(operand(env))
            case "-":
                return lambda env: finite(_whole(-float(_to_number(operand(env)))))
        return lambda env: finite(_to_number(operand(env)))

    def _typeof(self, depth: int) -> Evaluate:
        """The kind of a value; a name without data is not an error here."""
        before = self.left[:2]
        operand = self.unary(self.deeper(depth))
        name = str(before[0].value) if before and before[0].kind == "name" else None
        if name is None or name in self.constants or before[-1].value in (".", "[", "("):
            return lambda env: _kind(operand(env))
        return lambda env: "undefined" if undeclared(env, name) else _kind(operand(env))

    def named(self, name: str, depth: int) -> Evaluate:
        """Read what begins with a name."""
        if name == "Math":
            self.expect(".")
            name = f"Math.{self.left.pop(0).value}" if self.left else name
            if not self.at("("):
                raise UnsupportedError(f"`{name}`")
        return super().named(name, depth)

    def key(self, token: Lexeme) -> str:
        """The key of a pair: a name or a text."""
        return str(token.value) if token.kind == "name" else super().key(token)

    def strange(self, token: Lexeme) -> ValueError:
        """Name Python's words, which are not ECMAScript's."""
        if token.kind == "name" and token.value in ("and", "or", "not", "is"):
            return InvalidExpressionError(f"`{token.value}` is not an operator of ECMAScript")
        return super().strange(token)


def _compared(compare: Callable[[Any, Any], bool], left: Evaluate, right: Evaluate) -> Evaluate:
    return lambda env: compare(left(env), right(env))
