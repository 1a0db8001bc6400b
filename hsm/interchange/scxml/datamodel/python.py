"""Expressions of the data model ``python``: Python's operators, with their meaning there."""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any, ClassVar

from hsm.interchange.scxml.datamodel.expressions import (
    DataError,
    Environment,
    Evaluate,
    Language,
    joined,
    owned,
    same_text,
)
from hsm.interchange.scxml.datamodel.tokens import InvalidExpressionError, Lexeme, UnsupportedError

_Compare = Callable[[Any, Any], bool]


def _alike(first: Any, second: Any) -> bool:
    if isinstance(first, str) and isinstance(second, str):
        return same_text(first, second)
    return bool(first == second)


def _ordered(compare: _Compare) -> _Compare:
    def ordered(first: Any, second: Any) -> bool:
        try:
            return compare(first, second)
        except TypeError as error:
            raise DataError(str(error)) from None

    return ordered


def _contained(part: Any, whole: Any) -> bool:
    try:
        return part in whole
    except TypeError as error:
        raise DataError(str(error)) from None


_COMPARE: dict[str, _Compare] = {
    "==": _alike,
    "!=": lambda first, second: not _alike(first, second),
    "<": _ordered(operator.lt),
    "<=": _ordered(operator.le),
    ">": _ordered(operator.gt),
    ">=": _ordered(operator.ge),
    "in": _contained,
    "not in": lambda part, whole: not _contained(part, whole),
    "is": operator.is_,
    "is not": operator.is_not,
}
_ARITHMETIC: dict[str, Callable[[Any, Any], Any]] = {
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
    "//": operator.floordiv,
    "%": operator.mod,
}


def _number(value: Any) -> int | float:
    """A number as it is, True as 1 and False as 0."""
    if isinstance(value, int | float):
        return value
    raise DataError(f"{value!r:.40} is not a number")


class PythonLanguage(Language):
    """Python's expressions, as far as they compute with plain data."""

    beyond = frozenset(
        {"lambda", "for", "await", "async", "yield", "**", ">>", "<<", "&", "|", "^", "~", ":=", "...", ";"}
        | {"+=", "-=", "*=", "/=", "%=", "&=", "|=", "^="}
    )
    constants: ClassVar[dict[str, Any]] = {"True": True, "False": False, "None": None}
    reserved = frozenset(
        {"and", "as", "assert", "break", "class", "continue", "def", "del", "elif", "else", "except", "finally", "from"}
        | {"global", "if", "import", "in", "is", "nonlocal", "not", "or", "pass", "raise", "return", "try", "while"}
        | {"with"}
    )
    functions: ClassVar[dict[str, Callable[..., Any]]] = {
        "hasattr": lambda owner, name: name in owned(owner, dict),
        "len": len,
        "str": str,
        "int": int,
        "float": float,
        "abs": abs,
        "round": round,
        "min": min,
        "max": max,
        "bool": bool,
    }
    methods: ClassVar[dict[str, Callable[..., Any]]] = {
        "get": lambda owner, name, default=None: owned(owner, dict).get(name, default),
        "startswith": lambda owner, text: owned(owner, str).startswith(text),
        "endswith": lambda owner, text: owned(owner, str).endswith(text),
        "upper": lambda owner: owned(owner, str).upper(),
        "lower": lambda owner: owned(owner, str).lower(),
        "strip": lambda owner: owned(owner, str).strip(),
    }

    @staticmethod
    def truth(value: Any) -> bool:
        """Everything but False, None, 0, and what is empty."""
        return bool(value)

    @staticmethod
    def computed(operator: str, first: Any, second: Any) -> Any:
        """Texts and lists are joined by ``+``; the rest is arithmetic.

        A text is joined with any value, where Python has an error: charts that were translated from ECMAScript do so.
        """
        if operator == "+":
            if isinstance(first, list) and isinstance(second, list):
                return first + second
            if isinstance(first, str) or isinstance(second, str):
                return str(first) + str(second)
            return _number(first) + _number(second)
        try:
            return _ARITHMETIC[operator](_number(first), _number(second))
        except (ZeroDivisionError, OverflowError) as error:
            raise DataError(str(error)) from None

    @staticmethod
    def member(owner: Any, name: Any) -> Any:
        """The value of a key, or the part at an index, which may count from the end."""
        if isinstance(owner, dict) and isinstance(name, str) and name in owner:
            return owner[name]
        if isinstance(owner, list | str) and isinstance(name, int) and -len(owner) <= name < len(owner):
            return owner[name]
        raise DataError(f"{owner!r:.40} has no `{name}`")

    @staticmethod
    def attribute(owner: Any, name: str) -> Any:
        """A field of an event or of an object."""
        if isinstance(owner, dict) and name in owner:
            return owner[name]
        raise DataError(f"{owner!r:.40} has no `{name}`")

    def choice(self, depth: int) -> Evaluate:
        """``A if CONDITION else B``, or what binds tighter."""
        then = self._disjunction(depth)
        if not self.take("if"):
            return then
        condition = self._disjunction(depth)
        self.expect("else")
        other = self.choice(self.deeper(depth))
        return lambda env: then(env) if condition(env) else other(env)

    def _disjunction(self, depth: int) -> Evaluate:
        first = self._conjunction(depth)
        while self.take("or"):
            first = joined(bool, first, self._conjunction(depth), conjunction=False)
        return first

    def _conjunction(self, depth: int) -> Evaluate:
        first = self._negation(depth)
        while self.take("and"):
            first = joined(bool, first, self._negation(depth), conjunction=True)
        return first

    def _negation(self, depth: int) -> Evaluate:
        if not self.take("not"):
            return self._comparison(depth)
        operand = self._negation(self.deeper(depth))
        return lambda env: not operand(env)

    def _comparison(self, depth: int) -> Evaluate:
        """A value, or a chain of comparisons, which must all hold."""
        operands, compares = [self.sum(depth)], []
        while name := self._comparing():
            compares.append(_COMPARE[name])
            operands.append(self.sum(depth))
        if not compares:
            return operands[0]

        def compare(env: Environment) -> bool:
            first = operands[0](env)
            for operand, holds in zip(operands[1:], compares, strict=True):
                second = operand(env)
                if not holds(first, second):
                    return False
                first = second
            return True

        return compare

    def _comparing(self) -> str | None:
        name = self.take("==", "!=", "<", "<=", ">", ">=", "in", "is", "not")
        if name == "not":
            self.expect("in")
            return "not in"
        if name == "is":
            negated = self.take("not")
            if not self.at("None", "True", "False"):
                raise UnsupportedError("`is` with something other than None, True or False")
            return "is not" if negated else "is"
        return name

    def unary(self, depth: int) -> Evaluate:
        """An operand with its signs."""
        sign = self.take("-", "+", "--", "++")
        if sign is None:
            return self.postfix(depth)
        operand = self.unary(self.deeper(depth))
        return (lambda env: -_number(operand(env))) if sign == "-" else lambda env: +_number(operand(env))

    def strange(self, token: Lexeme) -> ValueError:
        """Name ECMAScript's operators, which are not Python's."""
        if token.kind == "mark" and token.value in ("!", "?", "&&", "||", "===", "!=="):
            return InvalidExpressionError(f"`{token.value}` is not an operator of Python")
        return super().strange(token)
