"""The names in a file of scenarios with their roles, as the machine that it is about declares them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from hsm.dsl.lsp.document import Document
from hsm.dsl.lsp.occurrences import NameOccurrence, Role, names_in
from hsm.dsl.reporting.report import Report
from hsm.dsl.syntax import ast
from hsm.dsl.syntax.tokens import Token
from hsm.testing.scenarios.lines import Performance, Reporting, ScenarioLine, Sending, Setting, read_lines

_PERFORMED = {
    "DOING": ("DoLine", Role.ACTIVITY),
    "CALLED": ("actions", Role.ACTION),
    "RAISED": ("RaiseSyntax", Role.EVENT),
    "SENT": ("RaiseSyntax", Role.EVENT),
}


def scenario_names(text: str, file: str, machine: Document) -> list[NameOccurrence]:
    """All names of the lines that can be read, in the order of the text.

    Args:
        text: the scenarios.
        file: their file.
        machine: what they are about.
    """
    names = _Names(machine)
    found = [one for line in read_lines(text, Report(file)) for one in names.of_line(line)]
    return sorted(found, key=lambda one: (one.line, one.column))


@dataclass(frozen=True, slots=True)
class _Names:
    machine: Document

    def of_line(self, line: ScenarioLine) -> Iterator[NameOccurrence]:
        if line.kind == "heading":
            yield _named(line.parts[0], Role.MACHINE)
        elif line.kind == "covered":
            yield _named(line.parts[0], Role.PROPERTY)
        elif line.kind in ("given", "step", "wait", "expect"):
            for part in line.parts:
                yield from self._of_part(part)

    def _of_part(self, part: object) -> Iterator[NameOccurrence]:
        match part:
            case Setting(subject, value):
                yield from self._of_expression(subject)
                if value is not None:
                    yield from self._of_expression(value)
            case Reporting(activity, outcome):
                yield from self._state(activity) or [_named(activity, Role.ACTIVITY)]
                if outcome is not None:
                    yield _named(outcome, Role.EVENT)
            case Sending(event):
                yield from self._performed(event, "RaiseSyntax", Role.EVENT)
            case Performance(keyword, what):
                yield from self._performed(what, *_PERFORMED[keyword.type])
            case tuple():
                for one in part:
                    yield from self._of_part(one)
            case _:
                yield from self._of_expression(part)

    def _performed(self, what: Token | ast.CallSyntax, within: str, role: Role) -> Iterator[NameOccurrence]:
        if isinstance(what, Token):
            yield _named(what, role)
        else:
            yield from names_in(what, self.machine.table, self.machine.library, within)

    def _of_expression(self, node: object) -> Iterator[NameOccurrence]:
        """The names of an expression; a state of an instance may be named in it by its own name or by both."""
        states = [one for token in _tokens(node) for one in self._state(token)]
        taken = {(one.line, one.column) for one in states}
        others = names_in(node, self.machine.table, self.machine.library)
        yield from (*states, *(one for one in others if (one.line, one.column) not in taken))

    def _state(self, token: Token) -> list[NameOccurrence]:
        """A state by its full name or its own; nothing where the name is not a state's."""
        name, states = str(token), self.machine.table.states
        if name in states:
            return [_named(token, Role.STATE)]
        instance, _, inner = name.rpartition(".")
        inside = [one for one in states if self._has_inside(one, inner or name)]
        if instance in inside:
            first = _named(token, Role.STATE)
            column = first.column + len(instance) + 1
            return [replace(first, name=instance), replace(first, name=inner, column=column, owner=instance)]
        return [replace(_named(token, Role.STATE), owner=inside[0])] if not instance and len(inside) == 1 else []

    def _has_inside(self, state: str, name: str) -> bool:
        call = self.machine.table.states[state].instance
        document = self.machine.imported(str(call.name)) if call is not None else None
        return document is not None and name in document.table.states


def _named(token: Token, role: Role) -> NameOccurrence:
    return NameOccurrence(str(token), role, token.line - 1, token.column - 1)


def _tokens(node: object) -> Iterator[Token]:
    """The names in an expression, those of calls and labels left out."""
    match node:
        case Token(type="NAME"):
            yield node
        case ast.UnarySyntax(operand=operand):
            yield from _tokens(operand)
        case ast.BinarySyntax(left=left, right=right):
            yield from (*_tokens(left), *_tokens(right))
        case ast.ChainSyntax(operands=operands):
            for one in operands:
                yield from _tokens(one)
