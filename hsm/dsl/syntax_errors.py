"""What is wrong with a line that cannot be read, in the author's words."""

from __future__ import annotations

import re
from collections.abc import Set

from lark import Token

from hsm.diagnostics import Place
from hsm.dsl.lexer import STATEMENTS
from hsm.dsl.report import Report

_WORDS = {
    "NAME": "a name",
    "NUMBER": "a number",
    "COLON": "`:`",
    "EQUALS": "`=`",
    "ASSIGN": "`+=`",
    "LPAR": "`(`",
    "RPAR": "`)`",
    "IF": "`if`",
    "WHEN": "`when`",
    "ARROW": "`->`",
    "SLASH": "`/`",
    "COMMA": "`,`",
    "_NL": "the end of the line",
}
_NAMES = {
    **dict.fromkeys(("->", "=>", "initial"), "the name of a state"),
    **dict.fromkeys(("state", "parallel", "final"), "a name for the state"),
    **dict.fromkeys(("on", "raise"), "the name of an event"),
    "do": "the name of an activity",
    "machine": "a name for the machine",
    "import": "the name of a machine",
}
_WORD = re.compile(r"[A-Za-z_][\w.]*|[-=<>!+*/&|]+|\d[\d.]*|[^ ]")
_FOREIGN = {
    "&&": "write `and`",
    "&": "write `and`",
    "||": "write `or`",
    "|": "write `or`",
    "!": "write `not`",
    "else": "a second transition below the first one is the other case",
    ";": "one line, one thing",
    '"': "the language has no texts",
    "'": "the language has no texts",
    "-->": "write `->`",
}
_BEGINNINGS = {
    "if": "a condition is watched with `when`; behind a trigger stands `if`",
    "while": "there are no loops: what a state does goes on until it is left",
    "for": "there are no loops: what a state does goes on until it is left",
    "transition": "a transition begins with `on`, `when` or `after`",
    "goto": "a transition begins with `on`, `when` or `after`",
    "->": "a transition begins with `on`, `when` or `after`",
}
_OPERATORS = ("==", "!=", "<", "<=", ">", ">=", "+", "-", "*", "->", "=>")
_TRANSITIONS = ("on", "when", "after")


def report_line(report: Report, token: Token, expected: Set[str], line: str) -> None:
    """Say why a token cannot stand where it does.

    Args:
        report: where to.
        token: the first one that does not fit.
        expected: the kinds of token that would.
        line: the line that it stands on.
    """
    number, column = token.line or 1, token.column or 1
    before = line[: column - 1]
    match = _WORD.match(line, column - 1) if token.type != "_NL" else None
    word = match.group() if match is not None else ""
    place = Place(report.file, number, column, number, column + max(1, len(word)))
    if word and not before.strip():
        hint = _FOREIGN.get(word) or _BEGINNINGS.get(word) or report.guess(word, STATEMENTS).text
        report.add("E0101", place, f"no line begins with `{word}`", hint)
        return
    last = before.split()[-1] if before.split() else ""
    wanted = [text for name, text in _WORDS.items() if name in expected]
    if wanted and wanted[0] == _WORDS["NAME"]:
        wanted[0] = _NAMES.get(last, wanted[0])
    found = f"here is `{word}`" if word else "the line ends here"
    message = f"expected {_either(wanted)}, but {found}" if wanted else f"`{word}` cannot stand here"
    report.add("E0101", place, message, _hint(before.split(), word, expected))


def _hint(before: list[str], word: str, expected: Set[str]) -> str | None:
    """A way out of a mistake that is often made."""
    if word in _FOREIGN:
        return _FOREIGN[word]
    first = before[0] if before else ""
    text = " ".join(before)
    if word == ":" and first in ("state", "parallel"):
        return "a block needs no colon: it is what is indented below"
    if first == "do" and before[1:] == re.findall(r"^[\w.]+$", before[-1]) and "LPAR" in expected:
        return f"an activity is called: `do {before[-1]}()`"
    if first in ("entry", "exit") and len(before) == 1:
        return f"actions stand behind a slash: `{first} / ...`"
    if first in _TRANSITIONS and " / " in text and word in _OPERATORS:
        return "a division in a condition stands in parentheses; a bare slash begins the actions"
    if first in _TRANSITIONS and word == "=":
        return "compare with `==`"
    if first in _TRANSITIONS and word in ("<", "<=", ">", ">=", "==", "!="):
        return "join two comparisons with `and`"
    if first in _TRANSITIONS and "ARROW" in expected and word.isidentifier():
        return "a transition's target stands behind `->`"
    return None


def _either(words: list[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} or {words[-1]}"
