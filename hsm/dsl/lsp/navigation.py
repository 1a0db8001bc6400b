"""Where names are declared, how a file is structured, and how it is coloured.

Lines and columns count from 0, columns in characters.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Container, Iterable, Iterator, Sequence
from enum import Enum
from pathlib import Path
from typing import Any

from hsm.dsl.loading import find_import
from hsm.dsl.lsp.document import Document
from hsm.dsl.lsp.occurrences import NameOccurrence, Role
from hsm.dsl.semantics.symbols import StateSymbol
from hsm.dsl.syntax.parser import tokens_of
from hsm.model.values import dataclass

_COLOURS = re.compile(
    r"(?P<comment>#.*)|(?P<number>(?<![\w.])\d+(?:\.\d+)?(?:[eE][+-]?\d+)?)|(?P<name>[A-Za-z_][\w.]*)|(?P<operator>->|=>|[-+*/=<>!]+)"
)


@dataclass(frozen=True, slots=True)
class Span:
    """A stretch of a file."""

    file: str
    line: int
    column: int
    end_line: int
    end_column: int


@dataclass(frozen=True, slots=True)
class OutlineSymbol:
    """A declaration in the outline of a file, with those inside it.

    Attributes:
        name: its name.
        detail: what it is.
        role: what the name represents.
        place: the name.
        whole: the declaration with its block.
        children: the states inside it.
    """

    name: str
    detail: str
    role: Role
    place: Span
    whole: Span
    children: tuple[OutlineSymbol, ...] = ()


class Colour(Enum):
    """Coloured tokens other than names; the values are the protocol's names of token types."""

    KEYWORD = "keyword"
    COMMENT = "comment"
    NUMBER = "number"
    OPERATOR = "operator"


@dataclass(frozen=True, slots=True)
class Coloured:
    """A stretch of a line with its token type."""

    line: int
    column: int
    length: int
    kind: Role | Colour
    declares: bool = False


# Structure.


def block_end(document: Document, line: int) -> int:
    """The last line of the block that begins on a line: what is indented deeper, without trailing blank lines."""
    lines = document.tree.lines
    indentation = _indentation(lines[line]) if line < len(lines) else 0
    last = line
    for number in range(line + 1, len(lines)):
        text = lines[number].strip()
        if not text:
            continue
        if _indentation(lines[number]) <= indentation:
            break
        last = number
    return last


def state_around(document: Document, line: int) -> StateSymbol:
    """The innermost state whose block has a line; the root of the machine outside of all blocks."""
    begins = {(one.token.line - 1): one for one in document.table.all_states() if one.token is not None}
    around = [first for first in begins if first <= line <= block_end(document, first)]
    return begins[max(around)] if around else document.table.root


def outline(document: Document) -> list[OutlineSymbol]:
    """The tree of declarations and states."""
    made: dict[int, list[OutlineSymbol]] = {}
    declared = [_declaration(document, one) for one in document.occurrences if one.declares and one.role in _TOP]
    for symbol in reversed(document.table.all_states()):
        inner = tuple(reversed(made.pop(id(symbol), [])))
        if symbol.parent is None:
            return [*declared, *inner]
        if symbol.token is not None:
            line, column = symbol.token.line - 1, symbol.token.column - 1
            place = Span(document.file, line, column, line, column + len(symbol.token))
            whole = _whole(document, line)
            detail = f"instance of {symbol.instance.name}" if symbol.instance is not None else symbol.kind.value
            made.setdefault(id(symbol.parent), []).append(
                OutlineSymbol(symbol.name, detail, Role.STATE, place, whole, inner)
            )
    return declared


_TOP = (Role.PARAMETER, Role.VARIABLE, Role.EVENT, Role.PROPERTY)


def _declaration(document: Document, one: NameOccurrence) -> OutlineSymbol:
    place = span(document, one)
    return OutlineSymbol(one.name, one.role.name.lower(), one.role, place, _whole(document, one.line))


def _whole(document: Document, line: int) -> Span:
    last = block_end(document, line)
    lines = document.tree.lines
    return Span(document.file, line, _indentation(lines[line]), last, len(lines[last]))


def folds(document: Document) -> Iterator[tuple[int, int, bool]]:
    """First and last line of each block and of each group of comment lines, and whether it is a comment."""
    lines = document.tree.lines
    for symbol in document.table.all_states():
        if symbol.token is not None and symbol.parent is not None:
            first = symbol.token.line - 1
            if (last := block_end(document, first)) > first:
                yield first, last, False
    start: int | None = None
    for number, text in enumerate((*lines, "")):
        comment = text.lstrip().startswith("#")
        if comment and start is None:
            start = number
        elif not comment and start is not None:
            if number - start > 1:
                yield start, number - 1, True
            start = None


def span(document: Document, one: NameOccurrence) -> Span:
    """Where a name is."""
    return Span(document.file, one.line, one.column, one.line, one.end)


def _indentation(text: str) -> int:
    return len(text) - len(text.lstrip(" "))


# Declarations and uses.


def definition(document: Document, line: int, column: int) -> Span | None:
    """Where the name at a position is declared: in this file, in an imported machine, or in Python."""
    here = document.occurrence(line, column)
    if here is None:
        return None
    if here.role is Role.MACHINE:
        return _machine(document, here.name)
    if here.role is Role.ARGUMENT and here.owner in document.table.imports:
        inner = document.imported(here.owner)
        return None if inner is None else _declared(inner, here.name, (Role.PARAMETER,))
    if here.role is Role.ARGUMENT:
        declared = (one for one in document.occurrences if one.declares and one.role is Role.ARGUMENT)
        carried = (span(document, one) for one in declared if (one.owner, one.name) == (here.owner, here.name))
        return next(carried, None) or _python(document, here.owner)
    if here.role is Role.EVENT:
        return _event(document, here.name) or _ended(document, line, here.name)
    if here.owner in document.table.states:
        inner = instance_of(document, here.owner)
        return None if inner is None else _declared(inner, here.name, (Role.VARIABLE,))
    own = _declared(document, here.name, same_roles(here.role))
    if own is not None:
        return own
    return _python(document, here.name)


def declaration(document: Document, name: str) -> Span | None:
    """Where a name of a machine is declared, for the files that name it: a state by its own name too."""
    states = [one for one in document.table.states if one == name or one.rpartition(".")[2] == name]
    if states:
        return _declared(document, states[0], (Role.STATE,))
    own = _declared(document, name, (Role.VARIABLE, Role.PARAMETER, Role.EVENT, Role.PROPERTY))
    return own or _event(document, name) or _python(document, name)


def same_roles(role: Role) -> tuple[Role, ...]:
    """The roles of names that may mean the same as one of a role."""
    both = (Role.VARIABLE, Role.PARAMETER)
    return both if role in both else (role,)


def instance_of(document: Document, state: str) -> Document | None:
    """The machine that a state is an instance of."""
    call = document.table.states[state].instance
    return None if call is None else document.imported(str(call.name))


def _declared(document: Document, name: str, roles: tuple[Role, ...]) -> Span | None:
    found = (one for one in document.occurrences if one.declares and one.name == name and one.role in roles)
    return next((span(document, one) for one in found), None)


def _machine(document: Document, name: str) -> Span | None:
    token = document.table.imports.get(name.rpartition(".")[2])
    if token is None:
        heading = document.table.heading
        own = heading is not None and str(heading.name) == name
        return _declared(document, name, (Role.MACHINE,)) if own else None
    path = find_import(str(token), Path(document.file).parent, document.library)
    return Span(str(path), 0, 0, 0, 0) if path.is_file() else None


def _event(document: Document, name: str) -> Span | None:
    """An event or a final state of the file, or of an imported machine."""
    own = _declared(document, name, (Role.EVENT,)) or _declared(document, name, (Role.STATE,))
    if own is not None:
        return own
    for imported in document.table.imports:
        inner = document.imported(imported)
        if inner is not None and (found := _event(inner, name)) is not None:
            return found
    return None


def _ended(document: Document, line: int, outcome: str) -> Span | None:
    """The Python source of the activity that has an outcome: of the state around a line, or of one inside it."""
    activities = (document.library.activities.get(name) for name in _activities(state_around(document, line)))
    return next(
        (_python(document, one.name) for one in activities if one is not None and outcome in one.outcomes), None
    )


def _activities(state: StateSymbol) -> Iterator[str]:
    if state.activity is not None:
        yield str(state.activity.call.name)
    for child in state.children:
        yield from _activities(child)


def written(declared: Any) -> Any:
    """The function or class that is in the source; newer versions of ``inspect.unwrap`` leave classes as they are."""
    while (wrapped := getattr(declared, "__wrapped__", None)) is not None:
        declared = wrapped
    return declared


def _python(document: Document, name: str) -> Span | None:
    """The Python source of a signal, an activity, an action or an enumeration."""
    library = document.library
    source: Any = None
    if name in library.signals:
        source = library.signals[name].function
    elif name in library.activities:
        source = library.activities[name].factory
    elif name in library.actions:
        source = library.actions[name].function
    elif name in library.enumerations:
        source = library.enumerations[name]
    try:
        original = written(source)
        file, (_, first) = inspect.getsourcefile(original), inspect.getsourcelines(original)
    except (TypeError, OSError):
        return None
    return None if file is None else Span(file, max(first - 1, 0), 0, max(first - 1, 0), 0)


# Colours.


def keywords(text: str) -> set[tuple[int, int]]:
    """Line and column of each keyword of a machine's text."""
    found = (one for one in tokens_of(text) if one.isidentifier() and one.type == one.upper())
    return {(one.line - 1, one.column - 1) for one in found}


def colours(lines: Sequence[str], names: Iterable[NameOccurrence], known: Container[tuple[int, int]]) -> list[Coloured]:
    """Names by their role, and keywords, comments, numbers and operators, in the order of the text.

    Args:
        lines: the text, line by line.
        names: the names in it.
        known: line and column of each keyword.
    """
    named = {(one.line, one.column): one for one in names}
    found: list[Coloured] = []
    for number, text in enumerate(lines):
        for match in _COLOURS.finditer(text):
            word, column = match.group(), match.start()
            occurrence = named.get((number, column))
            kind: Role | Colour | None = None
            if occurrence is not None:
                kind = occurrence.role
            elif match.lastgroup == "name":
                kind = Colour.KEYWORD if (number, column) in known else None
            elif match.lastgroup is not None:
                kind = Colour(match.lastgroup)
            if kind is not None:
                length = len(word) if occurrence is None else len(occurrence.name)
                found.append(Coloured(number, column, length, kind, occurrence is not None and occurrence.declares))
            part = None if occurrence is None else named.get((number, occurrence.end + 1))
            if part is not None and part.end <= match.end():
                found.append(Coloured(number, part.column, len(part.name), part.role))
    return found
