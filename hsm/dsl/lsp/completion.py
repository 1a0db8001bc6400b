"""What could be written at a place of a file."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from hsm.dsl.loading import importable
from hsm.dsl.lsp import vocabulary
from hsm.dsl.lsp.describe import type_text
from hsm.dsl.lsp.document import Document
from hsm.dsl.lsp.entries import Entry, SymbolKind, fitting
from hsm.dsl.lsp.hovering import OPEN_CALL
from hsm.dsl.semantics.symbols import HISTORY
from hsm.dsl.syntax.lexer import STATEMENTS
from hsm.model.types import BOOLEAN, Boolean, Enumeration, Type

_SNIPPETS = {
    "state": "state ${1:name}\n    ${0}",
    "parallel": "parallel ${1:name}\n    state ${2:one}\n    state ${3:two}",
    "param": "param ${1:name} : ${2:type} = ${0:value}",
    "var": "var ${1:name} : ${2:type} = ${0:value}",
    "property": "property ${1:name} : never ${0:condition}",
    "assume": "assume ${1:name} : always ${0:condition}",
    "on": "on ${1:done} -> ${0:state}",
    "when": "when ${1:condition} -> ${0:state}",
    "after": "after ${1:1 s} -> ${0:state}",
}


_KNOWN_LATER = (SymbolKind.SIGNAL, SymbolKind.VARIABLE, SymbolKind.DEFINITION)
"""What an initial value cannot be made of: it is known before the machine runs."""


def typed(document: Document, line: int, column: int) -> str:
    """The part of a name that is before a position."""
    found = re.search(r"[A-Za-z_][\w.]*$", document.before(line, column))
    return found.group() if found else ""


def completions(document: Document, line: int, column: int) -> list[Entry]:
    """Completions at a position, the likeliest first: all that contain the letters typed so far, in this order."""
    text = document.before(line, column)
    if "#" in text:
        return []
    begun = typed(document, line, column)
    return fitting(begun, _possible(document, text.removesuffix(begun)))


def _possible(document: Document, before: str) -> Iterator[Entry]:
    """Completions after the beginning of a line."""
    words = before.split()
    if not words:
        yield from (Entry(word, SymbolKind.KEYWORD, snippet=_SNIPPETS.get(word, "")) for word in sorted(STATEMENTS))
        return
    first, last = words[0], words[-1]
    called = OPEN_CALL.search(before)
    if called is not None and first != "event":
        yield from _inside_call(document, called[1], called[2])
    elif first == "initial" or re.search(r"[-=]>([^/]*,)?\s*$", before):
        yield from vocabulary.states(document)
    elif first == "do" and len(words) == 1:
        yield from vocabulary.activities(document)
    elif first == "import":
        names = dict.fromkeys(importable(Path(document.file), document.library))
        yield from (Entry(name, SymbolKind.MACHINE) for name in names)
    elif first in ("param", "var", "event") and last == ":":
        yield from vocabulary.types(document)
    elif first in ("state", "parallel", "final", "machine", "event", "param", "var") and (
        "=" not in words or last.endswith(",")
    ):
        yield from [Entry("adjustable", SymbolKind.KEYWORD)] if first == "param" and last.endswith(",") else ()
    elif first == "state":
        yield from (vocabulary.instance(document, name) for name in document.table.imports)
    elif re.search(r"\d\s*$", before):
        yield from vocabulary.units()
    elif (
        last in ("raise", "cancel", "send")
        or first == "defer"
        or (first == "on" and re.fullmatch(r"\s*on\s+([\w.]+\s*,\s*)*", before))
    ):
        yield from vocabulary.events(document)
    elif re.search(r"/\s*$|/.*,\s*$", before):
        yield from (Entry(word, SymbolKind.KEYWORD) for word in ("raise", "send", "cancel"))
        yield from vocabulary.actions(document)
        yield from (one for one in vocabulary.variables(document) if one.kind is SymbolKind.VARIABLE)
    else:
        yield from _carried(document, words[1] if first == "on" and len(words) > 1 else "")
        possible = _beginning(document, _assigned(document, before))
        initial = first in ("param", "var")
        yield from (one for one in possible if not initial or one.kind not in _KNOWN_LATER)


def _carried(document: Document, event: str) -> Iterator[Entry]:
    """What an event carries, as a transition that waits for it alone may read it."""
    for one in document.fields(event):
        yield Entry(f"{event}.{one.name}", SymbolKind.VARIABLE, type_text(one.type), type=one.type)


def _assigned(document: Document, before: str) -> Type | None:
    """The type of the parameter or variable whose value begins where a line ends; None where none does."""
    declared = re.fullmatch(r"\s*(?:param|var)\s+\w+\s*:\s*(\w+)\s*=\s*", before)
    if declared is not None:
        return document.type_named(declared[1])
    assigned = re.search(r"/(?:.*,)?\s*(\w+)\s*=\s*$", before)
    if assigned is None:
        return None
    known = {one.label: one.type for one in vocabulary.variables(document)}
    return known.get(assigned[1])


def _beginning(document: Document, due: Type | None) -> list[Entry]:
    """Names with which an expression of a type may begin, those of that very type first; all where it is not known."""
    possible = list(vocabulary.values(document))
    if isinstance(due, Enumeration):
        return [one for one in possible if one.type == due or one.kind is SymbolKind.DEFINITION]
    if due is not None and due != BOOLEAN:
        possible = [one for one in possible if not isinstance(one.type, Boolean | Enumeration)]
    return sorted(possible, key=lambda one: due is not None and one.type != due)


def _inside_call(document: Document, called: str, written: str) -> Iterator[Entry]:
    """Completions inside the brackets of a call: its arguments by name, and values of the expected type."""
    if called == "in":
        histories = tuple(f".{suffix}" for suffix in HISTORY)
        yield from (one for one in vocabulary.states(document) if not one.label.endswith(histories))
        return
    parameters = document.parameters_of(called)
    last = written.rpartition(",")[2]
    label = re.fullmatch(r"\s*([A-Za-z_]\w*)\s*=\s*", last)
    if label is None and not last.strip():
        given = set(re.findall(r"([A-Za-z_]\w*)\s*=(?!=)", written))
        for one in parameters:
            if one.name not in given:
                yield Entry(f"{one.name} = ", SymbolKind.ARGUMENT, type_text(one.type))
    position = written.count(",")
    due = next((one for one in parameters if label is not None and one.name == label[1]), None)
    if label is None and position < len(parameters):
        due = parameters[position]
    yield from _beginning(document, None if due is None else due.type)
