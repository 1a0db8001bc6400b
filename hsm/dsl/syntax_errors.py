"""What is wrong with a line that cannot be read, in the author's words."""

from __future__ import annotations

import re
from collections.abc import Set

from lark import Token

from hsm.diagnostics import Place
from hsm.dsl.codes import Report
from hsm.dsl.lexer import STATEMENTS

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
        hint = report.guess(word, STATEMENTS).text or _FOREIGN.get(word)
        report.add("E0101", place, f"no line begins with `{word}`", hint)
        return
    wanted = [text for name, text in _WORDS.items() if name in expected]
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
    if first == "do" and "LPAR" in expected:
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
        return f"a transition goes `-> {word}`"
    return None


def _either(words: list[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} or {words[-1]}"
