"""Diagnostics: what is wrong, where, and how to fix it; values that a program can sort, print and export."""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum

from hsm.model.values import dataclass


class Severity(IntEnum):
    """The severity of a diagnostic: only an error prevents a machine from being built."""

    NOTE = 1
    WARNING = 2
    ERROR = 3


@dataclass(frozen=True, slots=True, order=True)
class Place:
    """A range in a source file; lines and columns count from 1, and the end column is one past the last character."""

    file: str
    line: int
    column: int
    end_line: int
    end_column: int

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:{self.column}"


@dataclass(frozen=True, slots=True)
class Related:
    """A second place that explains a diagnostic, such as a first declaration."""

    place: Place
    message: str


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """A diagnostic of the checker.

    Attributes:
        code: stable code, such as ``E0201``; each has a section in the reference.
        severity: whether the machine can still be built.
        message: the reason in the author's words.
        place: its place in a file; None if it has none.
        suggestion: how to fix it, such as ``did you mean `turn_left`?``.
        related: further places.
    """

    code: str
    severity: Severity
    message: str
    place: Place | None = None
    suggestion: str | None = None
    related: tuple[Related, ...] = ()

    def __str__(self) -> str:
        place = f"{self.place}: " if self.place else ""
        hint = f" ({self.suggestion})" if self.suggestion else ""
        return f"{place}{self.severity.name.lower()} {self.code}: {self.message}{hint}"


class MachineError(Exception):
    """The machine cannot be built; the exception has all diagnostics, at least one of which is an error."""

    def __init__(self, diagnostics: Sequence[Diagnostic]) -> None:
        self.diagnostics: tuple[Diagnostic, ...] = tuple(diagnostics)
        super().__init__("\n".join(map(str, self.diagnostics)))
