"""Diagnostics: what is wrong, where, and how to fix it; values that a program can sort, print and export."""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum

from hsm.model.values import dataclass


class Severity(IntEnum):
    """How much a diagnostic matters: only an error keeps a machine from being built."""

    NOTE = 1
    WARNING = 2
    ERROR = 3


@dataclass(frozen=True, slots=True, order=True)
class Place:
    """A stretch of a source file; lines and columns count from 1, the end column is one past the last character."""

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
    """One diagnostic.

    Attributes:
        code: stable code with a section of its own in the reference, such as ``E0201``.
        severity: whether the machine can still be built.
        message: the reason in the author's words.
        place: where; None where it concerns no place in a file.
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
    """A machine that cannot be built; it has all diagnostics, at least one an error."""

    def __init__(self, diagnostics: Sequence[Diagnostic]) -> None:
        self.diagnostics: tuple[Diagnostic, ...] = tuple(diagnostics)
        super().__init__("\n".join(map(str, self.diagnostics)))
