"""Messages for lines that cannot be read, in the author's words."""

from __future__ import annotations

import re
from collections.abc import Set

from hsm.dsl.reporting.report import Report
from hsm.dsl.syntax.characters import advice, described, is_strange
from hsm.dsl.syntax.lexer import STATEMENTS
from hsm.dsl.syntax.tokens import Token
from hsm.model.diagnostics import Place

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
    "ADJUSTABLE": "`adjustable`",
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
_TARGET = re.compile(r"\s*[-=]>")
_RUN = re.compile(r"[^ #]*")
"""What is written without a blank: a strange character in it is the mistake, wherever it is noticed."""
_FOREIGN = {
    "&&": "write `and`",
    "&": "write `and`",
    "||": "write `or`",
    "|": "write `or`",
    "!": "write `not`",
    "is": "compare with `==`",
    "else": "write a second transition below the first one for the other case",
    ";": "write one statement on each line",
    '"': "strings are not supported; remove the quotes",
    "'": "strings are not supported; remove the quotes",
    "-->": "write `->`",
    "++": "write `+= 1`",
    "--": "write `-= 1`",
    "//": "a comment begins with `#`",
    "{": "a block needs no braces: indent its lines by four spaces",
    "}": "a block needs no braces: indent its lines by four spaces",
}
_DO = "write an activity after `do`, and an action after a slash"
_LOOP = "there are no loops: an activity runs until its state is left"
_TRANSITION = "a transition begins with `on`, `when` or `after`"
_DECLARATION = "write `var NAME : TYPE = VALUE`, or `param` for a value that does not change during a run"
_ONE_ACTIVITY = "a state has one activity: put the other one into another state, or into a region of a `parallel` state"
_BEGINNINGS = {
    "if": "begin a condition with `when`; use `if` only after a trigger",
    **dict.fromkeys(("elif", "elseif"), _FOREIGN["else"]),
    **dict.fromkeys(("while", "for"), _LOOP),
    **dict.fromkeys(("transition", "transitions", "goto", "->", "=>"), _TRANSITION),
    **dict.fromkeys(("-", "*"), "a line needs no bullet: remove it"),
    **dict.fromkeys(("const", "let", "int", "float", "bool"), _DECLARATION),
    **dict.fromkeys(("from", "include", "using"), "write `import` and the name of the machine: `import door`"),
    **dict.fromkeys(("onentry", "on_entry", "on_enter"), "write actions on entry as `entry / ...`"),
    **dict.fromkeys(("onexit", "on_exit", "on_leave"), "write actions on exit as `exit / ...`"),
    "always": "a transition without an event begins with `when`: `when true -> ...`",
    "[": "name the first state with `initial NAME`",
    **dict.fromkeys(("wait", "sleep", "timeout"), "wait in a state that a time-out leaves: `after 3 s -> ...`"),
    **dict.fromkeys(("pass", "..."), "a state may have no lines: leave this one out"),
    "end": "the indentation ends a block; `final NAME` ends the run",
}
_MISPLACED = {
    ("initial", "="): "leave out the `=`: `initial NAME`",
    ("initial", ":"): "leave out the colon: `initial NAME`",
    **dict.fromkeys((("state", ":"), ("parallel", ":")), "a block needs no colon: indent its lines by four spaces"),
    ("param", "adjustable"): "write a comma before it",
    ("var", ","): "only a parameter can be `adjustable`: a variable belongs to the machine",
}
"""What does not fit on a line that begins with a word, with a suggestion."""
_OPERATORS = ("==", "!=", "<", "<=", ">", ">=", "+", "-", "*", "->", "=>")
_TRANSITIONS = ("on", "when", "after")
_ASSIGNMENTS = ("=", "+=", "-=", "*=")
_UNIT = re.compile(r"[0-9] ?[A-Za-z]+/[A-Za-z]{1,3}$")
"""A number whose unit has a slash."""


def report_line(report: Report, token: Token, expected: Set[str], line: str) -> None:
    """Report why a token does not fit.

    Args:
        report: where to.
        token: the first one that does not fit.
        expected: the kinds of token that would.
        line: the line that it is on.
    """
    number, column = token.line, token.column
    run = _RUN.match(line, column - 1)
    strange = next((at for at in range(column - 1, run.end() if run else 0) if is_strange(line[at])), None)
    if strange is not None and token.type != "_NL":
        character = line[strange]
        place = Place(report.file, number, strange + 1, number, strange + 2)
        report.add("E0101", place, f"found {described(character)}", advice(character))
        return
    before = line[: column - 1]
    match = _WORD.match(line, column - 1) if token.type != "_NL" else None
    word = match.group() if match is not None else ""
    if word.startswith("/") and before.endswith("/"):
        column, before, word = column - 1, before[:-1], "//"
    place = Place(report.file, number, column, number, column + max(1, len(word)))
    if word and not before.strip():
        hint = _FOREIGN.get(word) or _BEGINNINGS.get(word) or report.guess(word, STATEMENTS).text
        rest = line[match.end() if match else 0 :]
        if hint is None and rest.startswith("("):
            hint = _DO
        if hint is None and rest.lstrip().startswith("-->"):
            hint = "write a transition inside its state: `on EVENT -> STATE`"
        if hint is None and _TARGET.match(rest):
            hint = f"a transition begins with its trigger: `on {word}` for an event, `when {word}` for a condition"
        _add(report, place, f"no line begins with `{word}`", hint, word)
        return
    last = before.split()[-1] if before.split() else ""
    wanted = [text for name, text in _WORDS.items() if name in expected]
    if wanted and wanted[0] == _WORDS["NAME"]:
        wanted[0] = _NAMES.get(last, wanted[0])
    found = f"`{word}`" if word else "the end of the line"
    message = f"expected {_either(wanted)}, found {found}" if wanted else f"{found} is not allowed here"
    _add(report, place, message, _hint(before.split(), word, expected), word)


def _add(report: Report, place: Place, message: str, hint: str | None, word: str) -> None:
    """Report a line; punctuation of other languages, which is on many lines, is reported once."""
    if word in _FOREIGN and hint == _FOREIGN[word]:
        report.add_once("E0101", place, message, hint, subject=hint)
    else:
        report.add("E0101", place, message, hint)


def _hint(before: list[str], word: str, expected: Set[str]) -> str | None:
    """A suggestion for a common mistake."""
    text = " ".join(before)
    if word == ">" and text.endswith("<"):
        return "write `!=`"
    if word in _FOREIGN:
        return _FOREIGN[word]
    first = before[0] if before else ""
    if first in _TRANSITIONS:
        return _hint_in_transition(first, text, word, expected)
    if first in STATEMENTS and len(before) == 2 and (named := _hint_in_name(text, before[1], word, expected)):
        return named
    if word == ")" and "_NL" in expected:
        return "remove `)`: no bracket is open"
    if first == "do":
        return _hint_in_do(before[1:], word, expected)
    if (first, word) in _MISPLACED:
        return _MISPLACED[first, word]
    if word == "=" and first in ("var", "param") and len(before) == 2:
        return f"give its type: `{text} : int = ...`"
    if first in ("property", "assume") and text.endswith(":"):
        return f"a claim begins with `always`, `never` or `after`: `{text} always ...`"
    if first in ("entry", "exit") and len(before) == 1:
        return f"write actions after a slash: `{first} / ...`"
    return None


def _hint_in_do(words: list[str], word: str, expected: Set[str]) -> str | None:
    """A suggestion for a mistake after ``do``."""
    if word == ":":
        return "give an argument by name with `=`: `drive(speed = 0.3 m/s)`" if words else "leave out the colon"
    if word in (",", "and", "then") and words and words[-1].endswith(")"):
        return _ONE_ACTIVITY
    if words == re.findall(r"^[\w.]+$", words[-1] if words else "") and "LPAR" in expected:
        return f"an activity needs parentheses: `do {words[-1]}()`"
    return None


def _hint_in_name(text: str, name: str, word: str, expected: Set[str]) -> str | None:
    """A suggestion for a mistake after the first word that follows a statement's own."""
    if text == "final state":
        return "`final NAME` already declares a state: leave out `state`"
    if text == "initial state":
        return f"write the name alone: `initial {word}`"
    if word == "-" and text.startswith("import "):
        return f"name the machine without a suffix: `import {name.partition('.')[0]}`"
    if word == "-":
        return "a name cannot contain a hyphen: use an underscore"
    if word.isidentifier() and name.isidentifier() and "_NL" in expected:
        return f"a name is one word: `{name}_{word}`"
    return None


def _hint_in_transition(first: str, text: str, word: str, expected: Set[str]) -> str | None:
    """A suggestion for a mistake on a line that begins with ``on``, ``when`` or ``after``."""
    if first == "on" and word == "or" and "->" not in text and " if " not in text:
        return "separate events with a comma: `on done, blocked`; put extra conditions after `if`"
    if first == "on" and word in ("and", "or", "when"):
        return "put extra conditions after `if`"
    if text in ("on timeout", "on time", "on after", "on timer"):
        return "a time-out is a trigger of its own: `after 3 s -> ...`"
    if text.endswith(("-> state", "=> state")):
        return f"write the name of the state alone: `-> {word}`"
    if word == ":":
        return "leave out the colon"
    if foreign := _hint_from_elsewhere(text, word, expected):
        return foreign
    divides = text.endswith(" /") and word[:1].isdigit()
    if divides or (" / " in text and word in _OPERATORS):
        return "put a division in parentheses; a bare slash begins the actions"
    if word in _ASSIGNMENTS and _UNIT.search(text):
        return "write a space before the slash that begins the actions: here it belongs to a unit"
    if word == "=":
        return "compare with `==`"
    if word in ("<", "<=", ">", ">=", "==", "!="):
        return "join two comparisons with `and`"
    if "ARROW" in expected and word.isidentifier():
        return "write the target after `->`"
    return None


def _hint_from_elsewhere(text: str, word: str, expected: Set[str]) -> str | None:
    """A suggestion for what other languages allow within a transition."""
    if word == "[" and "IF" in expected:
        return f"put a guard after `if`: `{text} if ...`"
    if word == "if" and "->" in text:
        return f"put the guard before the target: `{text.partition(' ->')[0]} if ... -> ...`"
    if word.startswith(("-", "=", ">")) and text.endswith(("->", "=>")):
        return "write `->`, or `=>` for a transition that leaves its own state"
    if word in ("not", "in"):
        return "compare with `==`, and join comparisons with `and` or `or`"
    if word in ("%", "**", "^") or (word == "*" and text.endswith("*")):
        return f"there is no such operator: compute the value in a signal of the library, or write it without `{word}`"
    if " / " in text and word == "==":
        return "assign with `=`"
    if word == "=" and "->" in text and " / " not in text:
        return "write actions after a slash: `-> state / tries = 0`"
    return None


def _either(words: list[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} or {words[-1]}"
