"""The conditions that SCXML has without a data model: ``In('state')``, combined by and, or and not."""

from __future__ import annotations

import re

from hsm.model.diagnostics import Place
from hsm.model.expressions import Active, Binary, Expression, Literal, Unary
from hsm.model.types import BOOLEAN

_TOKEN = re.compile(
    r"""\s*(?:(?P<in>In\s*\(\s*(?P<quote>['"])(?P<state>[^'"]*)(?P=quote)\s*\))
    |(?P<constant>(?:true|false)\b)|(?P<not>!(?!=)|not\b)|(?P<and>&&|and\b)|(?P<or>\|\||or\b)|(?P<open>\()|(?P<close>\)))""",
    re.VERBOSE,
)
_DEPTH = 50


class ConditionError(ValueError):
    """A condition that needs a data model, or is invalid."""


def parse_condition(text: str, place: Place) -> Expression:
    """The expression of a ``cond`` attribute.

    Raises:
        ConditionError: it is not made of ``In('state')``, ``true``, ``false``, and, or, not and parentheses.
    """
    tokens = _tokens(text)
    expression, rest = _either(tokens, place, 0)
    if rest:
        raise ConditionError(f"`{text.strip()}` is more than one condition")
    return expression


_Token = tuple[str, str]


def _tokens(text: str) -> list[_Token]:
    found: list[_Token] = []
    at = 0
    text = text.rstrip()
    while at < len(text):
        match = _TOKEN.match(text, at)
        if match is None:
            raise ConditionError(f"`{text.strip()}` needs a data model")
        kind = next(name for name in ("in", "constant", "not", "and", "or", "open", "close") if match[name])
        found.append((kind, match["state"] if kind == "in" else match[kind]))
        at = match.end()
    return found


def _either(tokens: list[_Token], place: Place, depth: int) -> tuple[Expression, list[_Token]]:
    left, tokens = _both(tokens, place, depth)
    while tokens and tokens[0][0] == "or":
        right, tokens = _both(tokens[1:], place, depth)
        left = Binary("or", left, right, BOOLEAN, place)
    return left, tokens


def _both(tokens: list[_Token], place: Place, depth: int) -> tuple[Expression, list[_Token]]:
    left, tokens = _single(tokens, place, depth)
    while tokens and tokens[0][0] == "and":
        right, tokens = _single(tokens[1:], place, depth)
        left = Binary("and", left, right, BOOLEAN, place)
    return left, tokens


def _single(tokens: list[_Token], place: Place, depth: int) -> tuple[Expression, list[_Token]]:
    if depth > _DEPTH:
        raise ConditionError(f"it is nested more than {_DEPTH} deep")
    if not tokens:
        raise ConditionError("it ends where a condition is expected")
    (kind, text), rest = tokens[0], tokens[1:]
    if kind == "in":
        return Active(text, place), rest
    if kind == "constant":
        return Literal(text == "true", BOOLEAN, place), rest
    if kind == "not":
        operand, rest = _single(rest, place, depth + 1)
        return Unary("not", operand, BOOLEAN, place), rest
    if kind == "open":
        inner, rest = _either(rest, place, depth + 1)
        if rest and rest[0][0] == "close":
            return inner, rest[1:]
        raise ConditionError("a parenthesis is not closed")
    raise ConditionError(f"`{text}` is not a condition")
