"""A machine's text under edit, as far as it can be understood.

Lines and columns count from 0, columns in characters; ``hsm.dsl.lsp.protocol`` turns them into the protocol's units.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property
from pathlib import Path

from hsm.dsl.loading import find_import
from hsm.dsl.lsp.occurrences import NameOccurrence, occurrences
from hsm.dsl.reporting.report import Report
from hsm.dsl.semantics.symbols import SymbolTable, collect_symbols
from hsm.dsl.semantics.values import SIMPLE_TYPES
from hsm.dsl.syntax import ast
from hsm.dsl.syntax.parser import BlockParser
from hsm.dsl.syntax.sources import read_text
from hsm.model.diagnostics import MachineError
from hsm.model.registry import Library, Parameter
from hsm.model.types import Enumeration, Type


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

    @property
    def machine(self) -> Document:
        """The machine that its names belong to: itself."""
        return self

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

    def before(self, line: int, column: int) -> str:
        """The part of a line that is before a column."""
        return self.tree.lines[line][:column] if line < len(self.tree.lines) else ""

    def parameters_of(self, called: str) -> tuple[Parameter, ...]:
        """What a signal, an activity, an action or an imported machine takes, or an event carries."""
        inner = self.imported(called)
        if inner is not None:
            return inner._typed(one for one in inner.table.root.lines if isinstance(one, ast.ParameterLine))
        tables = (self.library.signals, self.library.activities, self.library.actions)
        return next((table[called].parameters for table in tables if called in table), self.fields(called))

    def fields(self, event: str) -> tuple[Parameter, ...]:
        """What an event carries: one of the file, of what it imports, or of the library."""
        for line in self.table.root.lines:
            for declared in line.events if isinstance(line, ast.EventLine) else ():
                if declared.name == event and declared.fields:
                    return self._typed(declared.fields)
        for name in self.table.imports:
            inner = self.imported(name)
            if inner is not None and (found := inner.fields(event)):
                return found
        known = self.library.events.get(event)
        return () if known is None else tuple(Parameter(one.name, one.type) for one in known.fields)

    def _typed(self, declared: Iterable[ast.FieldSyntax | ast.ParameterLine]) -> tuple[Parameter, ...]:
        """Declared names with those types that are known."""
        types = [(str(one.name), self.type_named(str(one.type))) for one in declared]
        return tuple(Parameter(name, kind) for name, kind in types if kind is not None)

    def type_named(self, name: str) -> Type | None:
        """The type of this name: a simple one, an enumeration of the file or one of the library; None if unknown."""
        for line in self.table.root.lines:
            if isinstance(line, ast.EnumerationLine) and line.name == name:
                return Enumeration(name, tuple(map(str, line.members)))
        kind = self.library.enumerations.get(name)
        known = None if kind is None else Enumeration(name, tuple(one.value for one in kind))
        return SIMPLE_TYPES.get(name, known)
