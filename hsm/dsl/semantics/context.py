"""What all stages of a compilation share: the file, the registry, the report, the symbols."""

from __future__ import annotations

from hsm.dsl.reporting.report import Report
from hsm.dsl.semantics.symbols import SymbolTable
from hsm.dsl.semantics.typing import Scope
from hsm.dsl.syntax import ast
from hsm.dsl.syntax.ast import place_of
from hsm.dsl.syntax.tokens import Token
from hsm.model.diagnostics import Place
from hsm.model.registry import Library
from hsm.model.values import dataclass


@dataclass(frozen=True, slots=True)
class Context:
    """What all stages share.

    Attributes:
        tree: the file as read.
        library: the registry.
        report: where diagnostics go.
        symbols: the symbol table of the file.
        scope: the names that its expressions may use.
    """

    tree: ast.File
    library: Library
    report: Report
    symbols: SymbolTable
    scope: Scope

    def place(self, first: Token, last: Token | None = None) -> Place:
        """The place from a token to another, or of a single one."""
        return place_of(self.tree.name, first, last)

    def add(self, code: str, token: Token, message: str, suggestion: str | None = None) -> None:
        """Report a diagnostic at a token."""
        self.report.add(code, self.place(token), message, suggestion)

    def add_once(self, code: str, token: Token, message: str, suggestion: str | None = None) -> None:
        """Report an unknown name, together with its other places."""
        self.report.add_once(code, self.place(token), message, suggestion, subject=str(token))
