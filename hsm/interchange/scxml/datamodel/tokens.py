"""The tokens of data expressions."""

from __future__ import annotations

import re
from collections.abc import Collection

from hsm.model.values import dataclass


class InvalidExpressionError(ValueError):
    """No expression: evaluating it is an error of the chart, as the standard has it."""


class UnsupportedError(ValueError):
    """An expression that may mean something and is not in the subset; the message names what is not."""


@dataclass(frozen=True, slots=True)
class Lexeme:
    """A token: ``number``, ``text``, ``name`` or ``mark``, with its text or value."""

    kind: str
    value: str | float | int


_TOKEN = re.compile(
    r"""\s*(?:(?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)
    |(?P<text>'(?:[^'\\]|\\.)*'|"(?:[^"\\]|\\.)*")
    |(?P<name>[A-Za-z_$][A-Za-z0-9_$]*)
    |(?P<mark>>>>|===|!==|\.\.\.|==|!=|<=|>=|=>|<>|\+\+|--|\*\*|//|>>|<<|\?\?|\?\.(?![0-9])|:=|[-+*/%&|^]=|&&|\|\|
             |[-+*/%<>!?:.,()\[\]{}=;&|^~`]))""",
    re.VERBOSE | re.DOTALL,
)
_LEADING_ZERO = re.compile(r"0[0-9]")
_ESCAPE = re.compile(r"\\(x[0-9A-Fa-f]{2}|u[0-9A-Fa-f]{4}|.)", re.DOTALL)
_ESCAPES = {"n": "\n", "t": "\t", "r": "\r", "b": "\b", "f": "\f", "v": "\v", "\\": "\\", "'": "'", '"': '"'}
_LARGEST_WHOLE = 2**53
LONGEST_EXPRESSION = 10_000
"""The number of characters of the longest expression."""


def tokens_of(text: str, beyond: Collection[str]) -> list[Lexeme]:
    """The tokens of an expression.

    Args:
        text: the expression.
        beyond: the words and marks that mean something in its language and are not in the subset.

    Raises:
        InvalidExpressionError: a character begins no token.
        UnsupportedError: a token belongs to what is not in the subset.
    """
    if len(text) > LONGEST_EXPRESSION:
        raise UnsupportedError(f"an expression of more than {LONGEST_EXPRESSION} characters")
    found: list[Lexeme] = []
    at, text = 0, text.rstrip()
    while at < len(text):
        match = _TOKEN.match(text, at)
        if match is None:
            raise _nothing(text[at:].lstrip())
        kind, word = str(match.lastgroup), match[str(match.lastgroup)]
        if kind in ("name", "mark") and word in beyond:
            raise UnsupportedError(f"`{word}`")
        at = match.end()
        if kind in ("number", "name") and text[at : at + 1].isidentifier():
            raise UnsupportedError(f"`{word}{text[at]}`")  # 0x10, 1n, 1_000, or a letter that is not ASCII
        if kind == "number" and _LEADING_ZERO.match(word):
            raise UnsupportedError(f"the number `{word}`")
        if kind == "text" and found and at - len(word) > 0 and _is_joined(found[-1], text[at - len(word) - 1]):
            raise UnsupportedError(f"a text that follows `{found[-1].value}`")
        found.append(Lexeme(kind, _value(kind, word)))
    return found


def _is_joined(last: Lexeme, before: str) -> bool:
    """Whether a text continues the token before it: a second text, or a prefix such as Python's ``f``."""
    return last.kind == "text" or (last.kind == "name" and not before.isspace())


def _nothing(rest: str) -> ValueError:
    if rest[0].isalpha():
        return UnsupportedError(f"the letter `{rest[0]}`")
    return InvalidExpressionError(f"`{rest[:10].strip()}` begins nothing")


def _value(kind: str, word: str) -> str | float | int:
    if kind == "number":
        return int(word) if word.isdigit() and int(word[:17]) <= _LARGEST_WHOLE and len(word) < 17 else float(word)
    if kind == "text":
        return _ESCAPE.sub(_character, word[1:-1])
    return word


def _character(match: re.Match[str]) -> str:
    escape = match[1]
    if len(escape) > 1:
        return chr(int(escape[1:], 16))
    if escape not in _ESCAPES:
        raise UnsupportedError(f"the escape `\\{escape}`")
    return _ESCAPES[escape]
