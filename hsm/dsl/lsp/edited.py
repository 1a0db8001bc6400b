"""A file in an editor, of whichever language: what the editor asks of every file, and a machine's answers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Protocol

from hsm.dsl.format.formatter import format_text
from hsm.dsl.lsp import completion, hovering, navigation
from hsm.dsl.lsp.document import Document
from hsm.dsl.lsp.entries import Entry, OpenCall
from hsm.dsl.lsp.navigation import Coloured, OutlineSymbol, Span
from hsm.dsl.lsp.occurrences import NameOccurrence
from hsm.dsl.lsp.references import NamingFile
from hsm.model.diagnostics import MachineError
from hsm.model.values import dataclass


class EditedFile(NamingFile, Protocol):
    """A file as it is in the editor; lines and columns count from 0, columns in characters."""

    def typed(self, line: int, column: int) -> str:
        """The part of a name that is before a position."""
        ...

    def completions(self, line: int, column: int) -> Sequence[Entry]:
        """Completions at a position."""
        ...

    def hover(self, line: int, column: int) -> Entry | None:
        """What is at a position."""
        ...

    def open_call(self, line: int, column: int) -> OpenCall | None:
        """The call around a position, while its brackets are open."""
        ...

    def definition(self, line: int, column: int) -> Span | None:
        """Where the name at a position is declared."""
        ...

    def outline(self) -> Sequence[OutlineSymbol]:
        """What it declares."""
        ...

    def folds(self) -> Iterator[tuple[int, int, bool]]:
        """First and last line of what can be folded; the third says whether it is a comment."""
        ...

    def colours(self) -> Sequence[Coloured]:
        """What is coloured, in the order of the text."""
        ...

    def formatted(self) -> str | None:
        """Its text in canonical form; None if it cannot be read."""
        ...


@dataclass(frozen=True, slots=True)
class MachineFile:
    """A machine's file in the editor.

    Attributes:
        machine: what is understood of it.
    """

    machine: Document

    @property
    def file(self) -> str:
        """Its name."""
        return self.machine.file

    @property
    def lines(self) -> Sequence[str]:
        """Its text, line by line."""
        return self.machine.lines

    @property
    def occurrences(self) -> Sequence[NameOccurrence]:
        """The names in it."""
        return self.machine.occurrences

    def typed(self, line: int, column: int) -> str:
        """The part of a name that is before a position."""
        return completion.typed(self.machine, line, column)

    def completions(self, line: int, column: int) -> Sequence[Entry]:
        """Completions at a position."""
        return completion.completions(self.machine, line, column)

    def hover(self, line: int, column: int) -> Entry | None:
        """What is at a position."""
        return hovering.hover(self.machine, line, column)

    def open_call(self, line: int, column: int) -> OpenCall | None:
        """The call around a position, while its brackets are open."""
        return hovering.open_call(self.machine, self.machine.before(line, column))

    def definition(self, line: int, column: int) -> Span | None:
        """Where the name at a position is declared."""
        return navigation.definition(self.machine, line, column)

    def outline(self) -> Sequence[OutlineSymbol]:
        """Declarations and states."""
        return navigation.outline(self.machine)

    def folds(self) -> Iterator[tuple[int, int, bool]]:
        """Blocks, and runs of comment lines."""
        return navigation.folds(self.machine)

    def colours(self) -> Sequence[Coloured]:
        """What is coloured, in the order of the text."""
        return navigation.colours(self.lines, self.occurrences, navigation.keywords("\n".join(self.lines)))

    def formatted(self) -> str | None:
        """Its text in canonical form; None if it cannot be read."""
        try:
            return format_text(self.machine.text)
        except MachineError:
            return None
