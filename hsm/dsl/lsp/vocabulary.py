"""What can be named in a file: what it declares, what it imports, and its library."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import replace

from hsm.dsl.lsp.describe import first_line, holds_text, outcomes_text, signature, type_text
from hsm.dsl.lsp.document import Document
from hsm.dsl.lsp.entries import Entry, SymbolKind
from hsm.dsl.semantics.symbols import HISTORY
from hsm.dsl.semantics.typing import FUNCTIONS
from hsm.dsl.syntax import ast
from hsm.dsl.syntax.tokens import Token
from hsm.model.chart import StateKind
from hsm.model.registry import Parameter
from hsm.model.types import BOOLEAN, QUANTITY_NAMES, UNITS, Enumeration

_LOGIC = re.compile(r"[<>!]|==|\b(?:and|or|not|in)\b")
"""What only a condition has."""
_TYPES = ("bool", "int", *QUANTITY_NAMES.values())


def units() -> Iterator[Entry]:
    """The units of numbers."""
    yield from (Entry(one.name, SymbolKind.UNIT, str(one.quantity)) for one in UNITS.values())


def everything(document: Document) -> Iterator[Entry]:
    """All names that the file can use."""
    yield from values(document)
    yield from activities(document)
    yield from actions(document)
    yield from states(document)
    yield from events(document)
    yield from types(document)
    yield from _properties(document)
    yield from _only_compared(document)


def _only_compared(document: Document) -> Iterator[Entry]:
    """What is written in special places only: how instances end, and what properties ask of activities."""
    finals = {
        final: name
        for name, symbol in document.table.states.items()
        if symbol.instance is not None and (inner := document.imported(str(symbol.instance.name))) is not None
        for final in _finals(inner)
    }
    yield from (Entry(final, SymbolKind.VALUE, f"outcome of {name}") for final, name in finals.items())
    yield from (Entry(one, SymbolKind.VALUE, "bool") for one in ("true", "false"))
    yield Entry("none", SymbolKind.VALUE, "the outcome of an instance that has not ended")
    yield Entry("doing", SymbolKind.FUNCTION, "doing(ACTIVITY)", "Whether some active state runs an activity.")
    yield Entry("holding", SymbolKind.FUNCTION, "holding(THING)", "Whether the activity of an active state holds it.")
    held = dict.fromkeys(thing for one in document.library.activities.values() for thing in one.holds)
    yield from (Entry(thing, SymbolKind.VALUE, "held by activities") for thing in held)


def values(document: Document) -> Iterator[Entry]:
    """Completions inside an expression."""
    yield from variables(document)
    yield from _exposed(document)
    for one in document.library.signals.values():
        call = signature(one.name, one.parameters, empty="")
        yield Entry(
            one.name,
            SymbolKind.SIGNAL,
            f"{call} : {type_text(one.type)}",
            one.doc,
            _call_snippet(one.name, one.parameters) if one.parameters else "",
            one.type,
        )
    for constant in document.library.constants.values():
        yield Entry(constant.name, SymbolKind.VALUE, type_text(constant.type), constant.doc, type=constant.type)
    for name in document.library.enumerations:
        kind = document.type_named(name)
        members = kind.members if isinstance(kind, Enumeration) else ()
        yield from (Entry(member, SymbolKind.VALUE, name, type=kind) for member in members)
    for name in FUNCTIONS:
        yield Entry(name, SymbolKind.FUNCTION, type=BOOLEAN if name == "in" else None)


def variables(document: Document) -> Iterator[Entry]:
    """What the file declares for expressions."""
    for line in document.table.root.lines:
        match line:
            case ast.ParameterLine(name, kind):
                yield _declared_value(document, name, kind, SymbolKind.PARAMETER)
            case ast.VariableLine(name, kind):
                yield _declared_value(document, name, kind, SymbolKind.VARIABLE)
            case ast.DefinitionLine(name):
                detail = _declared_text(document, name, "").removeprefix(" = ")
                kind_of_value = BOOLEAN if _LOGIC.search(detail) else None
                doc = document.tree.comment_above(name.line)
                yield Entry(str(name), SymbolKind.DEFINITION, detail, doc, type=kind_of_value)
            case ast.EnumerationLine(name, members):
                known = document.type_named(str(name))
                yield from (Entry(str(one), SymbolKind.VALUE, str(name), type=known) for one in members)


def _declared_value(document: Document, name: Token, kind: Token, role: SymbolKind) -> Entry:
    detail = _declared_text(document, name, str(kind))
    doc = document.tree.comment_above(name.line)
    return Entry(str(name), role, detail, doc, type=document.type_named(str(kind)))


def _exposed(document: Document) -> Iterator[Entry]:
    """The variables that instances expose, and their outcomes."""
    for name, symbol in document.table.states.items():
        inner = document.imported(str(symbol.instance.name)) if symbol.instance is not None else None
        if inner is None:
            continue
        shown = {str(one) for line in inner.table.root.lines if isinstance(line, ast.ExposeLine) for one in line.names}
        for one in variables(inner):
            if one.label in shown:
                yield replace(one, label=f"{name}.{one.label}")
        finals = [one.name for one in inner.table.root.children if one.kind is StateKind.FINAL]
        if finals:
            yield Entry(f"{name}.outcome", SymbolKind.VARIABLE, f"none, {', '.join(finals)}")


def _declared_text(document: Document, name: Token, kind: str) -> str:
    """The type of a variable or parameter, and its value as it is written."""
    line = document.tree.lines[name.line - 1]
    value = line[name.end_column - 1 :].partition("#")[0].partition("=")[2].strip()
    return f"{kind} = {value}" if value else kind


def states(document: Document) -> Iterator[Entry]:
    """The states, and what remembers them."""
    for name, symbol in document.table.states.items():
        line = symbol.token.line if symbol.token is not None else None
        doc = document.tree.comment_above(line or 1)
        yield Entry(name, SymbolKind.STATE, symbol.kind.value, doc)
        if symbol.children or symbol.instance is not None:
            yield from (
                Entry(f"{name}.{suffix}", SymbolKind.STATE, kind.value, doc) for suffix, kind in HISTORY.items()
            )


def activities(document: Document) -> Iterator[Entry]:
    """The library's activities, as calls."""
    for one in document.library.activities.values():
        ends = f"{signature(one.name, one.parameters)} -> {outcomes_text(one)}; {holds_text(one)}"
        yield Entry(one.name, SymbolKind.ACTIVITY, ends, one.doc, _call_snippet(one.name, one.parameters))


def actions(document: Document) -> Iterator[Entry]:
    """The library's actions, as calls."""
    for one in document.library.actions.values():
        call = _call_snippet(one.name, one.parameters)
        yield Entry(one.name, SymbolKind.ACTION, signature(one.name, one.parameters), one.doc, call)


def events(document: Document) -> Iterator[Entry]:
    """What a transition may wait for by name: events of the file and of its library, and outcomes."""
    for line in document.table.root.lines:
        if isinstance(line, ast.EventLine):
            for event in line.events:
                yield _event(document, str(event.name), document.tree.comment_above(event.name.line))
    yield from (_event(document, one.name, one.doc) for one in document.library.events.values())
    for name in dict.fromkeys((*_outcomes(document), *_finals(document), "done", "fault")):
        yield Entry(name, SymbolKind.EVENT, "outcome")
    yield from (Entry(name, SymbolKind.EVENT, "raised event") for name in dict.fromkeys(_raised(document)))


def _raised(document: Document) -> Iterator[str]:
    """The events that the file raises and does not declare."""
    lines = [line for line in document.table.root.lines if isinstance(line, ast.EventLine)]
    declared = {str(event.name) for line in lines for event in line.events} | set(document.library.events)
    for symbol in document.table.all_states():
        for line in (*symbol.lines, *(() if symbol.initial is None else (symbol.initial,))):
            if isinstance(line, ast.TransitionLine | ast.EntryLine | ast.ExitLine | ast.InitialLine):
                raised = (str(one.event) for one in line.actions if isinstance(one, ast.RaiseSyntax))
                yield from (name for name in raised if name not in declared)


def _event(document: Document, name: str, doc: str) -> Entry:
    fields = document.fields(name)
    return Entry(name, SymbolKind.EVENT, f"event {signature(name, fields)}" if fields else "event", doc)


def _outcomes(document: Document) -> Iterator[str]:
    """The outcomes of the activities that the file names, and of the machines of which it has instances."""
    for symbol in document.table.all_states():
        if symbol.activity is not None:
            declared = document.library.activities.get(str(symbol.activity.call.name))
            yield from declared.outcomes if declared is not None else ()
        if symbol.instance is not None:
            inner = document.imported(str(symbol.instance.name))
            yield from _finals(inner) if inner is not None else ()


def _finals(document: Document) -> Iterator[str]:
    yield from (name for name, symbol in document.table.states.items() if symbol.kind is StateKind.FINAL)


def instance(document: Document, name: str) -> Entry:
    """An imported machine, with its parameters to fill in."""
    inner = document.imported(name)
    lines = () if inner is None else inner.table.root.lines
    listed = [one for one in lines if isinstance(one, ast.ParameterLine)]
    needed = [str(one.name) for one in listed if one.default is None]
    detail = ", ".join(f"{one.name} : {one.type}" for one in listed)
    filled = ", ".join(f"{one} = ${{{number}}}" for number, one in enumerate(needed, 1))
    return Entry(name, SymbolKind.MACHINE, f"{name}({detail})", snippet=f"{name}({filled})")


def types(document: Document) -> Iterator[Entry]:
    """The types of variables and parameters."""
    yield from (Entry(name, SymbolKind.TYPE) for name in _TYPES)
    for line in document.table.root.lines:
        if isinstance(line, ast.EnumerationLine):
            doc = document.tree.comment_above(line.name.line)
            yield Entry(str(line.name), SymbolKind.TYPE, ", ".join(map(str, line.members)), doc)
    for name, enumeration in document.library.enumerations.items():
        members = ", ".join(member.value for member in enumeration)
        yield Entry(name, SymbolKind.TYPE, members, first_line(enumeration.__doc__ or ""))


def _properties(document: Document) -> Iterator[Entry]:
    for line in document.table.root.lines:
        if isinstance(line, ast.PropertyLine):
            text = document.tree.lines[line.name.line - 1].partition(":")[2].partition("#")[0].strip()
            yield Entry(str(line.name), SymbolKind.PROPERTY, text, document.tree.comment_above(line.name.line))


def _call_snippet(name: str, parameters: Iterable[Parameter]) -> str:
    """A call with its required arguments to fill in."""
    needed = [one.name for one in parameters if one.required]
    return f"{name}({', '.join(f'{one} = ${{{number}}}' for number, one in enumerate(needed, 1))})"
