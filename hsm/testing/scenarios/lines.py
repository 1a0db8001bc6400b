"""The lines of a .maze-test file, before names are resolved.

The file is read line by line, so that one invalid line hides no other.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import lark
from lark import Lark
from lark.exceptions import UnexpectedInput

from hsm.dsl.reporting.report import Report
from hsm.dsl.syntax import ast
from hsm.dsl.syntax.ast import place_of
from hsm.dsl.syntax.parser import TreeBuilder, grammar_text
from hsm.dsl.syntax.tokens import Token
from hsm.model.diagnostics import Place
from hsm.model.values import dataclass

_WORDS = {
    "_NL": "the end of the line", "NAME": "a name", "NUMBER": "a number", "EQUALS": "`=`", "COMMA": "`,`",
    "COVERS": "`covers`", "REQUIREMENT": "the name of a requirement",
    "REPORTS": "`reports`", "FAILS": "`fails`", "WITHIN": "`within`", "LPAR": "`(`", "RPAR": "`)`",
}  # fmt: skip
_BREAKS = re.compile(r"\n+")
_BEGINNINGS = ("test", "tick", "requirement", "property", "scenario", "covers", "given", "when", "after", "expect")
_OUTER = ("heading", "tick", "requirement", "covered", "scenario")


@dataclass(frozen=True, slots=True)
class ScenarioLine:
    """One line of the file.

    Attributes:
        kind: name of its rule.
        parts: what is in it.
        place: its first to its last character.
    """

    kind: str
    parts: tuple[Any, ...]
    place: Place


@dataclass(frozen=True, slots=True)
class Setting:
    """A signal or parameter that is given a value: that of an expression, or true, or false."""

    subject: Token | ast.CallSyntax
    value: ast.Expression | None
    negated: bool = False


@dataclass(frozen=True, slots=True)
class Reporting:
    """An activity that ends, with an outcome or by failing."""

    activity: Token
    outcome: Token | None


@dataclass(frozen=True, slots=True)
class Sending:
    """An event from outside, with what it carries as for a call."""

    event: Token | ast.CallSyntax


@dataclass(frozen=True, slots=True)
class Performance:
    """``doing rotate(90 deg)`` or ``called door.remember``."""

    keyword: Token
    what: Token | ast.CallSyntax
    negated: bool


class _LineBuilder(TreeBuilder):
    """Makes the parts of a line; the parts of expressions are made as in a machine's file."""

    def test_line(self, parts: list[Any]) -> tuple[str, tuple[Any, ...]]:
        found: tuple[str, tuple[Any, ...]] = parts[0]
        return found

    def setting(self, parts: list[Any]) -> Setting:
        negated = isinstance(parts[0], Token) and parts[0].type == "NOT"
        signal, *equals = parts[negated:]
        return Setting(signal, equals[-1] if equals else None, negated)

    def report(self, parts: list[Any]) -> Reporting:
        return Reporting(*parts)

    def failure(self, parts: list[Any]) -> Reporting:
        return Reporting(parts[0], None)

    def sending(self, parts: list[Any]) -> Sending:
        return Sending(*parts)

    def performed(self, parts: list[Any]) -> Performance:
        return Performance(parts[-2], parts[-1], negated=len(parts) == 3)

    def within(self, parts: list[Any]) -> tuple[str, tuple[Any, ...]]:
        return "within", tuple(parts)


for _kind in (*_OUTER, "covers", "given", "step", "wait", "expect"):
    setattr(_LineBuilder, _kind, lambda _, parts, kind=_kind: (kind, tuple(parts)))


class _OwnTokens:
    """Has a line's builder build the values of lark's rules, with our tokens in place of lark's."""

    def __getattr__(self, rule: str) -> Callable[[list[Any]], Any]:
        build: Callable[[list[Any]], Any] = getattr(_BUILDER, rule)
        return lambda parts: build([_own(one) if isinstance(one, lark.Token) else one for one in parts])


_BUILDER = _LineBuilder()


def _own(token: lark.Token) -> Token:
    line, column = token.line or 1, token.column or 1
    return Token(token.type, str(token), (line, column, token.end_line or line, token.end_column or column))


@cache
def _parser() -> Lark:
    own = Path(__file__).with_name("scenario.lark").read_text(encoding="utf-8")
    builder: Any = _OwnTokens()
    return Lark(
        f"{grammar_text()}\n{own}", parser="lalr", start="test_line", transformer=builder, maybe_placeholders=False
    )


def read_lines(text: str, report: Report) -> Iterator[ScenarioLine]:
    """The valid lines; the others are reported. A comma at the end joins the next line."""
    pending, begin, last = "", 0, 0
    for number, raw in enumerate(text.split("\n"), 1):
        content = raw.partition("#")[0].rstrip()
        if not content.strip():
            continue
        begin = begin if pending else number
        pending += ("\n" * (number - last) if pending else "") + content
        last = number
        if content.endswith(","):
            continue
        line = _line(pending, begin, report)
        pending = ""
        if line is not None:
            yield line


def _line(text: str, number: int, report: Report) -> ScenarioLine | None:
    column = len(text) - len(text.lstrip()) + 1
    last = text.rsplit("\n", maxsplit=1)[-1]
    end = number + text.count("\n")
    place = Place(report.file, number, column, end, len(last) + 1)
    try:
        # Breaks between joined lines are marked, so that the parser skips them; line breaks before the line give
        # its tokens their places.
        joined = " " * (column - 1) + _BREAKS.sub("\f\\g<0>", text.lstrip())
        found: Any = _parser().parse("\n" * (number - 1) + joined + "\n")
    except UnexpectedInput as error:
        _explain(error, text, place, report)
        return None
    kind, parts = found
    if (column > 1) == (kind in _OUTER):
        wanted = "is indented under its scenario" if column == 1 else "begins at the margin"
        report.add("E0105", place, f"a line that begins with `{text.split(maxsplit=1)[0]}` {wanted}")
    return ScenarioLine(kind, parts, place)


def _explain(error: UnexpectedInput, text: str, place: Place, report: Report) -> None:
    words = text.split()
    token = getattr(error, "token", None)
    ends = token is None or token.type in ("_NL", "$END")
    if (error.column or 0) <= place.column and words[0] not in _BEGINNINGS:
        hint = report.guess(words[0], _BEGINNINGS).text or f"lines begin with {', '.join(_BEGINNINGS)}"
        report.add(
            "E0101", replace(place, end_column=place.column + len(words[0])), f"no line begins with `{words[0]}`", hint
        )
        return
    expected = getattr(error, "accepts", None) or getattr(error, "expected", None) or ()
    wanted = [said for name, said in _WORDS.items() if name in expected]
    found = "the end of the line" if ends else f"`{token}`"
    message = f"found {found}"
    if wanted:
        message = f"expected {', '.join(wanted[:-1])}{' or ' if len(wanted) > 1 else ''}{wanted[-1]}, found {found}"
    if token is not None and not ends:
        place = place_of(report.file, _own(token))
    report.add("E0101", place, message)


def name_of(subject: Token | ast.CallSyntax) -> Token:
    """The name in what is alone or is a call."""
    return subject if isinstance(subject, Token) else subject.name


def text_of(node: ast.Expression | ast.Named) -> str:
    """An expression as it was written, in one line."""
    match node:
        case Token():
            return str(node)
        case ast.UnarySyntax(operator, operand):
            return f"{operator}{' ' if operator == 'not' else ''}{text_of(operand)}"
        case ast.BinarySyntax(operator, left, right):
            return f"{text_of(left)} {operator} {text_of(right)}"
        case ast.ChainSyntax(operator, operands):
            return f" {operator} ".join(
                f"({text_of(one)})" if isinstance(one, ast.ChainSyntax) else text_of(one) for one in operands
            )
        case ast.ChoiceSyntax(then, condition, otherwise):
            return f"({text_of(then)} if {text_of(condition)} else {text_of(otherwise)})"
        case ast.Named(name, value):
            return f"{name} = {text_of(value)}"
        case ast.CallSyntax(name, arguments):
            return f"{name}({', '.join(map(text_of, arguments))})"
