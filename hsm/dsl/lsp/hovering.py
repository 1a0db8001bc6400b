"""What an editor asks of a place in a file: what is this, what does this call take."""

from __future__ import annotations

import re
from dataclasses import replace

from hsm.dsl.lsp import vocabulary
from hsm.dsl.lsp.describe import type_text
from hsm.dsl.lsp.document import Document
from hsm.dsl.lsp.entries import Entry, OpenCall, SymbolKind
from hsm.dsl.lsp.occurrences import Role
from hsm.dsl.syntax import ast
from hsm.model.types import UNITS

_WORD = re.compile(r"[A-Za-z_][\w.]*")
OPEN_CALL = re.compile(r"([A-Za-z_][\w.]*)\s*\(([^()]*)$")
"""The end of a text with a call whose bracket is open: what is called, and what is in the bracket so far."""
_KINDS_OF = {
    Role.EVENT: (SymbolKind.EVENT,),
    Role.VARIABLE: (SymbolKind.VARIABLE, SymbolKind.PARAMETER, SymbolKind.DEFINITION),
    Role.PARAMETER: (SymbolKind.PARAMETER,),
    Role.SIGNAL: (SymbolKind.SIGNAL,),
    Role.ACTIVITY: (SymbolKind.ACTIVITY,),
    Role.ACTION: (SymbolKind.ACTION,),
    Role.FUNCTION: (SymbolKind.FUNCTION,),
    Role.VALUE: (SymbolKind.VALUE,),
    Role.TYPE: (SymbolKind.TYPE,),
    Role.PROPERTY: (SymbolKind.PROPERTY,),
}


def hover(document: Document, line: int, column: int) -> Entry | None:
    """What is at a position."""
    here = document.occurrence(line, column)
    if here is None:
        word = _word(document, line, column)
        unit = UNITS.get(word)
        return None if unit is None else Entry(word, SymbolKind.UNIT, str(unit.quantity))
    if here.owner in document.table.states and here.role is not Role.ARGUMENT:
        exposed = (one for one in vocabulary.everything(document) if one.label == f"{here.owner}.{here.name}")
        call = document.table.states[here.owner].instance
        inner = None if call is None else document.imported(str(call.name))
        return next(exposed, None) or (None if inner is None else named(inner, here.name))
    if here.role is Role.STATE:
        return state_entry(document, here.name)
    if here.role is Role.ARGUMENT:
        taken = (*document.parameters_of(here.owner), *document.fields(here.owner))
        found = next((one for one in taken if one.name == here.name), None)
        return None if found is None else Entry(here.name, SymbolKind.ARGUMENT, type_text(found.type))
    if here.role is Role.MACHINE:
        return machine_entry(document, here.name)
    kinds = _KINDS_OF[here.role]
    return next((one for one in vocabulary.everything(document) if one.label == here.name and one.kind in kinds), None)


def open_call(document: Document, before: str) -> OpenCall | None:
    """The call whose brackets are open at the end of the beginning of a line."""
    called = OPEN_CALL.search(before)
    if called is None:
        return None
    entry = next((one for one in vocabulary.everything(document) if one.label == called[1]), None)
    parameters = document.parameters_of(called[1])
    if not parameters:
        return None
    last = called[2].rpartition(",")[2]
    label = re.match(r"\s*([A-Za-z_]\w*)\s*=(?!=)", last)
    names = [one.name for one in parameters]
    active = names.index(label[1]) if label is not None and label[1] in names else called[2].count(",")
    return OpenCall(called[1], entry.doc if entry is not None else "", parameters, active)


def _word(document: Document, line: int, column: int) -> str:
    text = document.tree.lines[line] if line < len(document.tree.lines) else ""
    found = (one for one in _WORD.finditer(text.partition("#")[0]) if one.start() <= column <= one.end())
    return next((one.group() for one in found), "")


def state_entry(document: Document, name: str) -> Entry | None:
    """A state with its transitions: those that leave it, and those that lead to it."""
    entry = next((one for one in vocabulary.states(document) if one.label == name), None)
    if entry is None:
        return None
    leaving, leading = [], []
    for symbol in document.table.all_states():
        for item in symbol.lines:
            if not isinstance(item, ast.TransitionLine):
                continue
            text = document.tree.lines[item.keyword.line - 1].strip()
            targets = () if item.target is None else item.target.names
            if symbol.name == name:
                leaving.append(f"- `{text}`")
            if any(str(one).removesuffix(".history").removesuffix(".deep_history") == name for one in targets):
                leading.append(f"- {symbol.name or document.table.root.name}: `{text}`")
    parts = [entry.doc, *_listed("out", leaving), *_listed("in", leading)]
    return replace(entry, doc="\n\n".join(part for part in parts if part))


def machine_entry(document: Document, name: str) -> Entry | None:
    """A machine: the one of the file, or an imported one."""
    inner = document.imported(name.rpartition(".")[2])
    if inner is None:
        heading = document.table.heading
        own = heading is not None and str(heading.name) == name
        doc = document.tree.comment_above(heading.name.line) if own and heading is not None else ""
        return Entry(name, SymbolKind.MACHINE, doc=doc) if own else None
    heading = inner.table.heading
    doc = inner.tree.comment_above(heading.name.line) if heading is not None else ""
    return Entry(name, SymbolKind.MACHINE, inner.file, doc)


def named(document: Document, name: str) -> Entry | None:
    """What a name of the machine means anywhere in the file; a state can also be named by its last part."""
    full = [one for one in document.table.states if one == name or one.rpartition(".")[2] == name]
    if full:
        return state_entry(document, full[0])
    others = (one for one in vocabulary.everything(document) if one.kind is not SymbolKind.STATE)
    return next((one for one in others if one.label == name), None)


def _listed(title: str, lines: list[str]) -> list[str]:
    return [f"{title}:\n" + "\n".join(lines)] if lines else []
