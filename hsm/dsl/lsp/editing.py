"""What an editor asks while a machine is written: what could stand here, what is this, where is it declared.

Lines and columns count from 0, columns in characters; ``hsm.dsl.lsp.server`` turns them into what the protocol counts.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

from lark import Token

from hsm.dsl.loading import SUFFIX
from hsm.dsl.lsp.describe import first_line, holds_text, outcomes_text, signature, type_text
from hsm.dsl.reporting.report import Report
from hsm.dsl.semantics.symbols import HISTORY, SymbolTable, collect_symbols
from hsm.dsl.semantics.typing import FUNCTIONS
from hsm.dsl.syntax import ast
from hsm.dsl.syntax.ast import place_of
from hsm.dsl.syntax.lexer import STATEMENTS
from hsm.dsl.syntax.parser import parse
from hsm.model.chart import StateKind
from hsm.model.diagnostics import Place
from hsm.model.registry import Library
from hsm.model.types import QUANTITY_NAMES, UNITS

_WORD = re.compile(r"[A-Za-z_][\w.]*")
_TYPES = ("bool", "int", *QUANTITY_NAMES.values())


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
        kind: what it is.
        detail: its type or its arguments, in one line.
        doc: what it is for.
    """

    label: str
    kind: SymbolKind
    detail: str = ""
    doc: str = ""


@dataclass(frozen=True, slots=True)
class Symbol:
    """A state in the outline of a file, with the states inside it."""

    name: str
    kind: StateKind
    place: Place
    children: tuple[Symbol, ...] = ()


class Document:
    """A text under edit, as far as it can be understood."""

    def __init__(self, text: str, file: str, library: Library) -> None:
        self.file = file
        self.library = library
        self.tree, findings = parse(text, file)
        self.table: SymbolTable = collect_symbols(self.tree, Report(file, findings))

    def completions(self, line: int, column: int) -> list[Entry]:
        """What could stand at a position, whatever of it is written already."""
        text = self.tree.lines[line][:column] if line < len(self.tree.lines) else ""
        if "#" in text:
            return []
        written = re.search(r"[A-Za-z_][\w.]*$|$", text)
        return list(self._possible(text[: written.start()] if written else text))

    def hover(self, line: int, column: int) -> Entry | None:
        """What stands at a position."""
        word = self._word(line, column)
        if word is None:
            return None
        return next((one for one in self._everything() if one.label == word.value), None)

    def definition(self, line: int, column: int) -> Place | None:
        """Where the name at a position is declared; of an imported machine, its file."""
        word = self._word(line, column)
        if word is None:
            return None
        name = word.value.removesuffix(".history").removesuffix(".deep_history")
        if name in self.table.imports:
            path = Path(self.file).parent.joinpath(*self.table.imports[name].split(".")).with_suffix(SUFFIX)
            return Place(str(path), 1, 1, 1, 1)
        token = self.table.declared.get(name)
        return None if token is None else place_of(self.file, token)

    def symbols(self) -> list[Symbol]:
        """The states, as they lie in one another."""
        made: dict[int, list[Symbol]] = {}
        for symbol in reversed(self.table.all_states()):
            inner = tuple(reversed(made.pop(id(symbol), [])))
            if symbol.parent is not None and symbol.token is not None:
                entry = Symbol(symbol.name, symbol.kind, place_of(self.file, symbol.token), inner)
                made.setdefault(id(symbol.parent), []).append(entry)
            elif symbol.parent is None:
                return list(inner)
        return []

    def _word(self, line: int, column: int) -> Token | None:
        text = self.tree.lines[line] if line < len(self.tree.lines) else ""
        for match in _WORD.finditer(text.partition("#")[0]):
            if match.start() <= column <= match.end():
                return Token("NAME", match.group(), 0, line + 1, match.start() + 1, line + 1, match.end() + 1)
        return None

    def _possible(self, before: str) -> Iterator[Entry]:
        """What could stand behind the beginning of a line."""
        words = before.split()
        if not words:
            yield from (Entry(word, SymbolKind.KEYWORD) for word in sorted(STATEMENTS))
            return
        first, last = words[0], words[-1]
        called = re.search(r"([A-Za-z_][\w.]*)\s*\([^()]*$", before)
        if called is not None:
            yield from self._arguments(called[1])
            yield from self._values()
        elif first == "initial" or re.search(r"[-=]>([^/]*,)?\s*$", before):
            yield from self._states()
        elif first == "do" and len(words) == 1:
            yield from self._activities()
        elif first == "import":
            yield from self._machines()
        elif first in ("param", "var") and last == ":":
            yield from self._types()
        elif first in ("state", "parallel", "final", "machine", "event", "param", "var") and "=" not in words:
            return
        elif first == "state":
            yield from (Entry(name, SymbolKind.MACHINE) for name in self.table.imports)
        elif re.search(r"\d\s*$", before):
            yield from (Entry(one.name, SymbolKind.UNIT, str(one.quantity)) for one in UNITS.values())
        elif last == "raise" or (first == "on" and re.fullmatch(r"\s*on\s+([\w.]+\s*,\s*)*", before)):
            yield from self._events()
        elif re.search(r"/\s*$|/.*,\s*$", before):
            yield from (Entry("raise", SymbolKind.KEYWORD), *self._actions(), *self._variables())
        else:
            yield from self._values()

    def _everything(self) -> Iterator[Entry]:
        yield from self._values()
        yield from self._activities()
        yield from self._actions()
        yield from self._states()
        yield from self._events()
        yield from self._types()
        yield from (Entry(one.name, SymbolKind.UNIT, str(one.quantity)) for one in UNITS.values())

    def _values(self) -> Iterator[Entry]:
        """What an expression is made of."""
        yield from self._variables()
        for one in self.library.signals.values():
            call = signature(one.name, one.parameters, empty="")
            yield Entry(one.name, SymbolKind.SIGNAL, f"{call} : {type_text(one.type)}", one.doc)
        for name, enumeration in self.library.enumerations.items():
            yield from (Entry(member.value, SymbolKind.VALUE, name) for member in enumeration)
        yield from (Entry(name, SymbolKind.FUNCTION) for name in FUNCTIONS)

    def _variables(self) -> Iterator[Entry]:
        for line in self.table.root.lines:
            match line:
                case ast.ParameterLine(name, kind):
                    yield Entry(str(name), SymbolKind.PARAMETER, str(kind), self.tree.comment_above(name.line or 1))
                case ast.VariableLine(name, kind):
                    yield Entry(str(name), SymbolKind.VARIABLE, str(kind), self.tree.comment_above(name.line or 1))

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
            yield Entry(one.name, SymbolKind.ACTIVITY, ends, one.doc)

    def _actions(self) -> Iterator[Entry]:
        for one in self.library.actions.values():
            yield Entry(one.name, SymbolKind.ACTION, signature(one.name, one.parameters), one.doc)

    def _events(self) -> Iterator[Entry]:
        yield from (Entry(one.name, SymbolKind.EVENT, "event", one.doc) for one in self.library.events.values())
        outcomes = dict.fromkeys(
            outcome
            for symbol in self.table.all_states()
            if symbol.activity is not None
            for outcome in self._outcomes(str(symbol.activity.call.name))
        )
        finals = (name for name, symbol in self.table.states.items() if symbol.kind is StateKind.FINAL)
        for name in dict.fromkeys((*outcomes, *finals, "done", "fault")):
            yield Entry(name, SymbolKind.EVENT, "outcome")

    def _outcomes(self, activity: str) -> Iterable[str]:
        declared = self.library.activities.get(activity)
        return declared.outcomes if declared is not None else ()

    def _arguments(self, called: str) -> Iterator[Entry]:
        tables = (self.library.signals, self.library.activities, self.library.actions)
        for table in tables:
            declared = table.get(called)
            for one in declared.parameters if declared is not None else ():
                yield Entry(f"{one.name} = ", SymbolKind.ARGUMENT, type_text(one.type))

    def _types(self) -> Iterator[Entry]:
        yield from (Entry(name, SymbolKind.TYPE) for name in _TYPES)
        for name, enumeration in self.library.enumerations.items():
            values = ", ".join(member.value for member in enumeration)
            yield Entry(name, SymbolKind.TYPE, values, first_line(enumeration.__doc__ or ""))

    def _machines(self) -> Iterator[Entry]:
        folder = Path(self.file).parent
        for path in sorted(folder.glob(f"*{SUFFIX}")):
            if path.name != Path(self.file).name:
                yield Entry(path.name.removesuffix(SUFFIX), SymbolKind.MACHINE)
