"""What is wrong with a line that cannot be read, in the author's words."""

from __future__ import annotations

from collections.abc import Set

from lark import Token

from hsm.diagnostics import Place
from hsm.dsl.codes import did_you_mean

STATEMENTS = frozenset(
    {
        *("machine", "import", "param", "var", "event", "state", "parallel", "final", "initial"),
        *("do", "entry", "exit", "on", "when", "after"),
    }
)
"""The words that a line may begin with."""

_WORDS = {
    "NAME": "a name",
    "NUMBER": "a number",
    "ARROW": "`->`",
    "EQUALS": "`=`",
    "ASSIGN": "`+=`",
    "SLASH": "`/`",
    "IF": "`if`",
    "COMMA": "`,`",
    "COLON": "`:`",
    "LPAR": "`(`",
    "RPAR": "`)`",
    "_NL": "the end of the line",
}


def explain(token: Token, expected: Set[str], line: str, place: Place) -> tuple[str, Place, str, str | None]:
    """Code, place, message and suggestion for a token that cannot stand where it does."""
    words = line.split()
    first = words[0] if words else ""
    if token.type == "_NL":
        found, place = "the line ends", Place(place.file, place.line, place.column, place.line, place.column + 1)
    else:
        found = f"there is `{token}`"
    if line[: place.column - 1].strip() == "" and "STATE" in expected:
        text = f"no line begins with `{first}`"
        return "E0101", place, text, did_you_mean(first, STATEMENTS)
    wanted = [text for name, text in _WORDS.items() if name in expected]
    hope = f"expected {_either(wanted)}, but {found}" if wanted else f"unexpected: {found}"
    return "E0101", place, hope, None


def _either(words: list[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} or {words[-1]}"
