"""The tokens of data expressions."""

from __future__ import annotations

import re

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
    |(?P<mark>===|!==|==|!=|<=|>=|=>|\+\+|--|[-+*/%]=|&&|\|\||[-+*/%<>!?:.,()\[\]{}=]))""",
    re.VERBOSE,
)
_STRANGE = frozenset({"=>", "++", "--", "+=", "-=", "*=", "/=", "%="})
_KEYWORDS = frozenset(
    {"function", "new", "lambda", "for", "import", "class", "while", "await", "async", "yield", "delete"}
    | {"this", "void", "switch", "try", "throw", "do"}
)
_ESCAPES = {"n": "\n", "t": "\t", "r": "\r", "0": "\0"}
LONGEST_EXPRESSION = 10_000
"""The number of characters of the longest expression."""


def tokens_of(text: str) -> list[Lexeme]:
    """The tokens of an expression.

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
            raise InvalidExpressionError(f"`{text[at : at + 10].strip()}` begins nothing")
        kind, word = str(match.lastgroup), match[str(match.lastgroup)]
        if word in _STRANGE or (kind == "name" and word in _KEYWORDS):
            raise UnsupportedError(f"`{word}`")
        found.append(Lexeme(kind, _value(kind, word)))
        at = match.end()
    return found


def _value(kind: str, word: str) -> str | float | int:
    if kind == "number":
        return int(word) if word.isdigit() and len(word) < 16 else float(word)
    if kind == "text":
        return re.sub(r"\\(.)", lambda match: _ESCAPES.get(match[1], match[1]), word[1:-1], flags=re.DOTALL)
    return word
