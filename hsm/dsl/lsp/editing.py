"""What an editor asks while a machine is written: completion, hover and signature help.

Lines and columns count from 0, columns in characters; ``hsm.dsl.lsp.server`` turns them into what the protocol counts.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property
from pathlib import Path

from lark import Token

from hsm.dsl.loading import find_import, importable, read_text
from hsm.dsl.lsp.describe import first_line, holds_text, outcomes_text, signature, type_text
from hsm.dsl.lsp.occurrences import NameOccurrence, Role, occurrences
from hsm.dsl.reporting.report import Report
from hsm.dsl.semantics.symbols import HISTORY, SymbolTable, collect_symbols
from hsm.dsl.semantics.typing import FUNCTIONS
from hsm.dsl.semantics.values import SIMPLE_TYPES
from hsm.dsl.syntax import ast
from hsm.dsl.syntax.lexer import STATEMENTS
from hsm.dsl.syntax.parser import BlockParser
from hsm.model.chart import StateKind
from hsm.model.diagnostics import MachineError
from hsm.model.registry import Library, Parameter
from hsm.model.types import QUANTITY_NAMES, UNITS, Enumeration, Type

_WORD = re.compile(r"[A-Za-z_][\w.]*")
_TYPES = ("bool", "int", *QUANTITY_NAMES.values())
_OPEN_CALL = re.compile(r"([A-Za-z_][\w.]*)\s*\(([^()]*)$")
_AWAITING = re.compile(r"\s*(?:on|defer)\s+([\w.]+\s*,\s*)*")
_SNIPPETS = {
    "state": "state ${1:name}\n    ${0}",
    "parallel": "parallel ${1:name}\n    state ${2:one}\n    state ${3:two}",
    "param": "param ${1:name} : ${2:type} = ${0:value}",
    "var": "var ${1:name} : ${2:type} = ${0:value}",
    "property": "property ${1:name} : never ${0:condition}",
    "on": "on ${1:done} -> ${0:state}",
    "when": "when ${1:condition} -> ${0:state}",
    "after": "after ${1:1 s} -> ${0:state}",
}


class SymbolKind(Enum):
    """What a word is."""

    KEYWORD = "keyword"
    STATE = "state"
    SIGNAL = "signal"
    ACTIVITY = "activity"
    ACTION = "action"
    EVENT = "event"
    VARIABLE = "variable"
    PARAMETER = "parameter"
    ARGUMENT = "argument"
    FUNCTION = "function"
    VALUE = "value"
    TYPE = "type"
    UNIT = "unit"
    MACHINE = "machine"


@dataclass(frozen=True, slots=True)
class Entry:
    """Something that can be named.

    Attributes:
        label: the name.
        kind: its kind.
        detail: its type or its arguments, in one line.
        doc: its documentation.
        snippet: what is inserted instead of the name, with places to fill in, in the notation of editors; or empty.
    """

    label: str
    kind: SymbolKind
    detail: str = ""
    doc: str = ""
    snippet: str = ""


@dataclass(frozen=True, slots=True)
class OpenCall:
    """A call that is being written.

    Attributes:
        name: what is called.
        doc: its documentation.
        parameters: what it takes.
        active: the position of the parameter that is being written; beyond the last, that of no parameter.
    """

    name: str
    doc: str
    parameters: tuple[Parameter, ...]
    active: int


_KINDS_OF = {
    Role.EVENT: (SymbolKind.EVENT,),
    Role.VARIABLE: (SymbolKind.VARIABLE, SymbolKind.PARAMETER),
    Role.PARAMETER: (SymbolKind.PARAMETER,),
    Role.SIGNAL: (SymbolKind.SIGNAL,),
    Role.ACTIVITY: (SymbolKind.ACTIVITY,),
    Role.ACTION: (SymbolKind.ACTION,),
    Role.FUNCTION: (SymbolKind.FUNCTION,),
    Role.VALUE: (SymbolKind.VALUE,),
    Role.TYPE: (SymbolKind.TYPE,),
    Role.PROPERTY: (SymbolKind.FUNCTION,),
}


class Document:
    """A text in an editor, analysed as far as possible. It is immutable: an edit makes a new one.

    Attributes:
        text: the text.
        file: its name.
        library: what its machine may name.
        tree: its syntax tree.
        unread: the diagnostics of lines that could not be read.
        table: its states and imports.
    """

    def __init__(self, text: str, file: str, library: Library, parser: BlockParser | None = None) -> None:
        """Args: the text, its name, what its machine may name, and who has read the text before it was edited."""
        self.text = text
        self.file = file
        self.library = library
        self.tree, findings = (parser or BlockParser()).parse(text, file)
        self.unread = tuple(findings)
        self.table: SymbolTable = collect_symbols(self.tree, Report(file, findings))

    @property
    def lines(self) -> Sequence[str]:
        """The text, line by line."""
        return self.tree.lines

    @cached_property
    def occurrences(self) -> list[NameOccurrence]:
        """All names of the file with their roles, in the order of the text."""
        return occurrences(self.tree, self.table, self.library)

    def occurrence(self, line: int, column: int) -> NameOccurrence | None:
        """The name at a position."""
        here = (one for one in self.occurrences if one.line == line and one.column <= column <= one.end)
        return next(here, None)

    def imported(self, name: str) -> Document | None:
        """The document of a machine that this one imports under a name; None where it cannot be read."""
        token = self.table.imports.get(name)
        if token is None:
            return None
        path = find_import(str(token), Path(self.file).parent, self.library)
        try:
            return Document(read_text(path), str(path), self.library)
        except MachineError:
            return None

    # Completion.

    def typed(self, line: int, column: int) -> str:
        """The part of a name that is before a position."""
        found = re.search(r"[A-Za-z_][\w.]*$", self._before(line, column))
        return found.group() if found else ""

    def completions(self, line: int, column: int) -> list[Entry]:
        """Completions at a position: everything that contains the letters typed so far, in this order."""
        text = self._before(line, column)
        if "#" in text:
            return []
        typed = self.typed(line, column)
        return fitting(typed, self._possible(text.removesuffix(typed)))

    def _before(self, line: int, column: int) -> str:
        return self.tree.lines[line][:column] if line < len(self.tree.lines) else ""

    def _possible(self, before: str) -> Iterator[Entry]:
        """Completions after the beginning of a line."""
        words = before.split()
        if not words:
            yield from (Entry(word, SymbolKind.KEYWORD, snippet=_SNIPPETS.get(word, "")) for word in sorted(STATEMENTS))
            return
        first, last = words[0], words[-1]
        called = _OPEN_CALL.search(before)
        if called is not None and first != "event":
            yield from self._inside_call(called[1], called[2])
        elif first == "initial" or re.search(r"[-=]>([^/]*,)?\s*$", before):
            yield from self._states()
        elif first == "do" and len(words) == 1:
            yield from self._activities()
        elif first == "import":
            names = dict.fromkeys(importable(Path(self.file), self.library))
            yield from (Entry(name, SymbolKind.MACHINE) for name in names)
        elif first in ("param", "var", "event") and last == ":":
            yield from self._types()
        elif first in ("state", "parallel", "final", "machine", "event", "param", "var") and "=" not in words:
            return
        elif first == "state":
            yield from (self._instance(name) for name in self.table.imports)
        elif re.search(r"\d\s*$", before):
            yield from self.units()
        elif (
            last in ("raise", "cancel", "send")
            or first == "defer"
            or (first == "on" and re.fullmatch(r"\s*on\s+([\w.]+\s*,\s*)*", before))
        ):
            yield from self._events()
        elif re.search(r"/\s*$|/.*,\s*$", before):
            yield from (Entry(word, SymbolKind.KEYWORD) for word in ("raise", "send", "cancel"))
            yield from (*self._actions(), *self._variables())
        else:
            yield from self._carried(words[1] if first == "on" and len(words) > 1 else "")
            yield from self._values()

    def _carried(self, event: str) -> Iterator[Entry]:
        """What an event carries, as a transition that waits for it alone may read it."""
        for one in self._fields(event):
            yield Entry(f"{event}.{one.name}", SymbolKind.VARIABLE, type_text(one.type))

    def _inside_call(self, called: str, written: str) -> Iterator[Entry]:
        """Completions inside the brackets of a call: its arguments by name, and values of the expected type."""
        if called == "in":
            yield from self._states()
            return
        parameters = self.parameters_of(called)
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
        if due is None or not isinstance(due.type, Enumeration):
            yield from (one for one in self._values() if due is None or one.kind is not SymbolKind.VALUE)
            return
        yield from (Entry(member, SymbolKind.VALUE, str(due.type)) for member in due.type.members)
        yield from (one for one in self._variables() if one.detail.partition(" ")[0] == str(due.type))

    def units(self) -> Iterator[Entry]:
        """The units of numbers."""
        yield from (Entry(one.name, SymbolKind.UNIT, str(one.quantity)) for one in UNITS.values())

    def named(self, name: str) -> Entry | None:
        """What a name of the machine means anywhere in the file; a state can also be named by its last part."""
        full = [one for one in self.table.states if one == name or one.rpartition(".")[2] == name]
        found = next((one for one in self.everything() if one.label == name and one.kind is not SymbolKind.STATE), None)
        return self._state_entry(full[0]) if full else found

    def parameters_of(self, called: str) -> tuple[Parameter, ...]:
        """What a signal, an activity or an action takes, or an event carries."""
        tables = (self.library.signals, self.library.activities, self.library.actions)
        return next((table[called].parameters for table in tables if called in table), self._fields(called))

    def _fields(self, event: str) -> tuple[Parameter, ...]:
        """What an event carries: one of the file, of what it imports, or of the library."""
        for line in self.table.root.lines:
            for declared in line.events if isinstance(line, ast.EventLine) else ():
                if declared.name == event and declared.fields:
                    types = [(str(one.name), self._type_named(str(one.type))) for one in declared.fields]
                    return tuple(Parameter(name, kind) for name, kind in types if kind is not None)
        for name in self.table.imports:
            inner = self.imported(name)
            if inner is not None and (found := inner._fields(event)):
                return found
        known = self.library.events.get(event)
        return () if known is None else tuple(Parameter(one.name, one.type) for one in known.fields)

    def _type_named(self, name: str) -> Type | None:
        for line in self.table.root.lines:
            if isinstance(line, ast.EnumerationLine) and line.name == name:
                return Enumeration(name, tuple(map(str, line.members)))
        kind = self.library.enumerations.get(name)
        known = None if kind is None else Enumeration(name, tuple(one.value for one in kind))
        return SIMPLE_TYPES.get(name, known)

    # Hovering and calls.

    def hover(self, line: int, column: int) -> Entry | None:
        """What is at a position."""
        here = self.occurrence(line, column)
        if here is None:
            word = self._word(line, column)
            unit = UNITS.get(word)
            return None if unit is None else Entry(word, SymbolKind.UNIT, str(unit.quantity))
        if here.role is Role.STATE:
            return self._state_entry(here.name)
        if here.role is Role.ARGUMENT:
            found = next((one for one in self.parameters_of(here.owner) if one.name == here.name), None)
            return None if found is None else Entry(here.name, SymbolKind.ARGUMENT, type_text(found.type))
        if here.role is Role.MACHINE:
            return self._machine_entry(here.name)
        kinds = _KINDS_OF[here.role]
        name = f"{here.owner}.{here.name}" if here.owner in self.table.states else here.name
        return next((one for one in self.everything() if one.label == name and one.kind in kinds), None)

    def call(self, line: int, column: int) -> OpenCall | None:
        """The call around a position, while its brackets are open."""
        called = _OPEN_CALL.search(self._before(line, column))
        if called is None:
            return None
        entry = next((one for one in self.everything() if one.label == called[1]), None)
        parameters = self.parameters_of(called[1])
        if not parameters:
            return None
        last = called[2].rpartition(",")[2]
        label = re.match(r"\s*([A-Za-z_]\w*)\s*=(?!=)", last)
        names = [one.name for one in parameters]
        active = names.index(label[1]) if label is not None and label[1] in names else called[2].count(",")
        return OpenCall(called[1], entry.doc if entry is not None else "", parameters, active)

    def _word(self, line: int, column: int) -> str:
        text = self.tree.lines[line] if line < len(self.tree.lines) else ""
        found = (one for one in _WORD.finditer(text.partition("#")[0]) if one.start() <= column <= one.end())
        return next((one.group() for one in found), "")

    def _state_entry(self, name: str) -> Entry | None:
        """A state with its transitions: those that leave it, and those that lead to it."""
        entry = next((one for one in self._states() if one.label == name), None)
        if entry is None:
            return None
        leaving, leading = [], []
        for symbol in self.table.all_states():
            for item in symbol.lines:
                if not isinstance(item, ast.TransitionLine):
                    continue
                text = self.tree.lines[(item.keyword.line or 1) - 1].strip()
                targets = () if item.target is None else item.target.names
                if symbol.name == name:
                    leaving.append(f"- `{text}`")
                if any(str(one).removesuffix(".history").removesuffix(".deep_history") == name for one in targets):
                    leading.append(f"- {symbol.name or self.table.root.name}: `{text}`")
        parts = [entry.doc, *_listed("out", leaving), *_listed("in", leading)]
        return replace(entry, doc="\n\n".join(part for part in parts if part))

    def _machine_entry(self, name: str) -> Entry | None:
        document = self.imported(name.rpartition(".")[2])
        if document is None:
            heading = self.table.heading
            own = heading is not None and str(heading.name) == name
            doc = self.tree.comment_above(heading.name.line or 1) if own and heading is not None else ""
            return Entry(name, SymbolKind.MACHINE, doc=doc) if own else None
        heading = document.table.heading
        doc = document.tree.comment_above(heading.name.line or 1) if heading is not None else ""
        return Entry(name, SymbolKind.MACHINE, document.file, doc)

    # What there is.

    def everything(self) -> Iterator[Entry]:
        """All names that the file can use."""
        yield from self._values()
        yield from self._activities()
        yield from self._actions()
        yield from self._states()
        yield from self._events()
        yield from self._types()
        yield from self._properties()

    def _values(self) -> Iterator[Entry]:
        """Completions inside an expression."""
        yield from self._variables()
        yield from self._exposed()
        for one in self.library.signals.values():
            call = signature(one.name, one.parameters, empty="")
            yield Entry(
                one.name,
                SymbolKind.SIGNAL,
                f"{call} : {type_text(one.type)}",
                one.doc,
                _call_snippet(one.name, one.parameters) if one.parameters else "",
            )
        for constant in self.library.constants.values():
            yield Entry(constant.name, SymbolKind.VALUE, type_text(constant.type), constant.doc)
        for name, enumeration in self.library.enumerations.items():
            yield from (Entry(member.value, SymbolKind.VALUE, name) for member in enumeration)
        yield from (Entry(name, SymbolKind.FUNCTION) for name in FUNCTIONS)

    def _variables(self) -> Iterator[Entry]:
        for line in self.table.root.lines:
            match line:
                case ast.ParameterLine(name, kind):
                    detail = self._declared_text(name, str(kind))
                    yield Entry(str(name), SymbolKind.PARAMETER, detail, self.tree.comment_above(name.line or 1))
                case ast.VariableLine(name, kind):
                    detail = self._declared_text(name, str(kind))
                    yield Entry(str(name), SymbolKind.VARIABLE, detail, self.tree.comment_above(name.line or 1))

                case ast.DefinitionLine(name):
                    detail = self._declared_text(name, "").removeprefix(" = ")
                    yield Entry(str(name), SymbolKind.VARIABLE, detail, self.tree.comment_above(name.line or 1))
                case ast.EnumerationLine(name, members):
                    yield from (Entry(str(one), SymbolKind.VALUE, str(name)) for one in members)

    def _exposed(self) -> Iterator[Entry]:
        """The variables that instances expose, and their outcomes."""
        for name, symbol in self.table.states.items():
            inner = self.imported(str(symbol.instance.name)) if symbol.instance is not None else None
            if inner is None:
                continue
            shown = {
                str(one) for line in inner.table.root.lines if isinstance(line, ast.ExposeLine) for one in line.names
            }
            for one in inner._variables():
                if one.label in shown:
                    yield replace(one, label=f"{name}.{one.label}")
            finals = [one.name for one in inner.table.root.children if one.kind is StateKind.FINAL]
            if finals:
                yield Entry(f"{name}.outcome", SymbolKind.VARIABLE, f"none, {', '.join(finals)}")

    def _declared_text(self, name: Token, kind: str) -> str:
        """The type of a variable or parameter, and its value as it is written."""
        line = self.tree.lines[(name.line or 1) - 1]
        value = line[(name.end_column or 1) - 1 :].partition("#")[0].partition("=")[2].strip()
        return f"{kind} = {value}" if value else kind

    def _states(self) -> Iterator[Entry]:
        for name, symbol in self.table.states.items():
            line = symbol.token.line if symbol.token is not None else None
            doc = self.tree.comment_above(line or 1)
            yield Entry(name, SymbolKind.STATE, symbol.kind.value, doc)
            if symbol.children or symbol.instance is not None:
                yield from (
                    Entry(f"{name}.{suffix}", SymbolKind.STATE, kind.value, doc) for suffix, kind in HISTORY.items()
                )

    def _activities(self) -> Iterator[Entry]:
        for one in self.library.activities.values():
            ends = f"{signature(one.name, one.parameters)} -> {outcomes_text(one)}; {holds_text(one)}"
            yield Entry(one.name, SymbolKind.ACTIVITY, ends, one.doc, _call_snippet(one.name, one.parameters))

    def _actions(self) -> Iterator[Entry]:
        for one in self.library.actions.values():
            call = _call_snippet(one.name, one.parameters)
            yield Entry(one.name, SymbolKind.ACTION, signature(one.name, one.parameters), one.doc, call)

    def _events(self) -> Iterator[Entry]:
        for line in self.table.root.lines:
            if isinstance(line, ast.EventLine):
                for event in line.events:
                    yield self._event(str(event.name), self.tree.comment_above(event.name.line or 1))
        yield from (self._event(one.name, one.doc) for one in self.library.events.values())
        for name in dict.fromkeys((*self._outcomes(), *self._finals(), "done", "fault")):
            yield Entry(name, SymbolKind.EVENT, "outcome")

    def _event(self, name: str, doc: str) -> Entry:
        fields = self._fields(name)
        return Entry(name, SymbolKind.EVENT, f"event {signature(name, fields)}" if fields else "event", doc)

    def _outcomes(self) -> Iterator[str]:
        """The outcomes of the activities that the file names, and of the machines of which it has instances."""
        for symbol in self.table.all_states():
            if symbol.activity is not None:
                declared = self.library.activities.get(str(symbol.activity.call.name))
                yield from declared.outcomes if declared is not None else ()
            if symbol.instance is not None:
                inner = self.imported(str(symbol.instance.name))
                yield from inner._finals() if inner is not None else ()

    def _finals(self) -> Iterator[str]:
        yield from (name for name, symbol in self.table.states.items() if symbol.kind is StateKind.FINAL)

    def _instance(self, name: str) -> Entry:
        """An imported machine, with its parameters to fill in."""
        document = self.imported(name)
        lines = () if document is None else document.table.root.lines
        listed = [one for one in lines if isinstance(one, ast.ParameterLine)]
        needed = [str(one.name) for one in listed if one.default is None]
        detail = ", ".join(f"{one.name} : {one.type}" for one in listed)
        filled = ", ".join(f"{one} = ${{{number}}}" for number, one in enumerate(needed, 1))
        return Entry(name, SymbolKind.MACHINE, f"{name}({detail})", snippet=f"{name}({filled})")

    def _types(self) -> Iterator[Entry]:
        yield from (Entry(name, SymbolKind.TYPE) for name in _TYPES)
        for line in self.table.root.lines:
            if isinstance(line, ast.EnumerationLine):
                doc = self.tree.comment_above(line.name.line or 1)
                yield Entry(str(line.name), SymbolKind.TYPE, ", ".join(map(str, line.members)), doc)
        for name, enumeration in self.library.enumerations.items():
            values = ", ".join(member.value for member in enumeration)
            yield Entry(name, SymbolKind.TYPE, values, first_line(enumeration.__doc__ or ""))

    def _properties(self) -> Iterator[Entry]:
        for line in self.table.root.lines:
            if isinstance(line, ast.PropertyLine):
                text = self.tree.lines[(line.name.line or 1) - 1].partition(":")[2].partition("#")[0].strip()
                yield Entry(str(line.name), SymbolKind.FUNCTION, text, self.tree.comment_above(line.name.line or 1))


def fitting(typed: str, possible: Iterable[Entry]) -> list[Entry]:
    """The candidates that contain the letters typed so far, each once."""
    return [one for one in dict.fromkeys(possible) if _fits(typed, one.label)]


def _fits(typed: str, label: str) -> bool:
    """Whether a label contains the typed letters in this order, as editors match them; dots separate words."""
    if "." in typed:
        return label.lower().startswith(typed.lower())
    letters = iter(label.lower())
    return all(letter in letters for letter in typed.lower())


def _call_snippet(name: str, parameters: Iterable[Parameter]) -> str:
    """A call with its required arguments to fill in."""
    needed = [one.name for one in parameters if one.required]
    return f"{name}({', '.join(f'{one} = ${{{number}}}' for number, one in enumerate(needed, 1))})"


def _listed(title: str, lines: list[str]) -> list[str]:
    return [f"{title}:\n" + "\n".join(lines)] if lines else []
