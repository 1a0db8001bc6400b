"""Where a name is used, in its file and in others, and what a new name changes.

A name belongs to the file that declares it: a machine's parameters, outcomes, events and exposed variables are named in
the machines that import it, and everything in the scenarios about it. A question at such a place is about the
declaration.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Protocol

from hsm.dsl.loading import find_import
from hsm.dsl.lsp.document import Document
from hsm.dsl.lsp.navigation import block_end, instance_of, same_roles
from hsm.dsl.lsp.occurrences import NameOccurrence, Role
from hsm.dsl.syntax import ast
from hsm.dsl.syntax.lexer import RESERVED
from hsm.model.chart import StateKind

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_IN_FILE = {*Role} - {Role.MACHINE, Role.SIGNAL, Role.ACTIVITY, Role.ACTION, Role.FUNCTION}
"""What a file declares, and can rename."""


class NamingFile(Protocol):
    """A file that names what a machine declares: another machine, or scenarios about it."""

    @property
    def file(self) -> str:
        """Its name."""
        ...

    @property
    def lines(self) -> Sequence[str]:
        """Its text, line by line."""
        ...

    @property
    def occurrences(self) -> Sequence[NameOccurrence]:
        """The names in it."""
        ...

    @property
    def machine(self) -> Document | None:
        """The machine that its names belong to: itself, or the one that its scenarios are about."""
        ...


class RenameError(Exception):
    """A rename that is refused; the message says why."""


def occurrence(file: NamingFile, line: int, column: int) -> NameOccurrence | None:
    """The name at a position of a file."""
    here = (one for one in file.occurrences if one.line == line and one.column <= column <= one.end)
    return next(here, None)


def references(document: Document, line: int, column: int) -> list[NameOccurrence]:
    """All references in this file to what the name at a position means, including its declaration."""
    here = document.occurrence(line, column)
    return [] if here is None else _within(document, here)


def references_everywhere(
    file: NamingFile, line: int, column: int, others: Iterable[NamingFile]
) -> list[tuple[NamingFile, NameOccurrence]]:
    """All places of all files that mean what the name at a position means, those of the declaring file first.

    Args:
        file: where one asks.
        line: from 0.
        column: from 0.
        others: the files around it.
    """
    here = occurrence(file, line, column)
    if here is None:
        return []
    home, declared = _home(file, here)
    if home is None or declared is None:
        return [(file, one) for one in file.occurrences if _means_the_same(one, here)]
    known = {_key(one): one for one in (*others, file)}
    own = known.get(_key(home), home)  # as it is in the editor
    found: list[tuple[NamingFile, NameOccurrence]] = [(own, one) for one in _within(home, declared)]
    for key, other in known.items():
        if key != _key(home):
            found += [(other, one) for one in _elsewhere(home, declared, other)]
    return found


def rename(
    file: NamingFile, line: int, column: int, name: str, others: Iterable[NamingFile]
) -> list[tuple[NamingFile, NameOccurrence]]:
    """All places to change when what is at a position gets a new name.

    Raises:
        RenameError: no file declares what is there, the new name is invalid, or it is taken.
    """
    here = renamable(file, line, column)
    home, _ = _home(file, here)
    if not _NAME.fullmatch(name) or name in RESERVED:
        raise RenameError(f"`{name}` is not a name: use letters, digits and underscores, and no reserved word")
    if home is not None and (name in home.table.declared or name in home.library.signals):
        raise RenameError(f"`{name}` is already declared")
    return references_everywhere(file, line, column, others)


def renamable(file: NamingFile, line: int, column: int) -> NameOccurrence:
    """The name at a position, if a machine's file declares it.

    Raises:
        RenameError: it does not.
    """
    here = occurrence(file, line, column)
    if here is None:
        raise RenameError("there is no name here")
    home, declared = _home(file, here)
    known = home is not None and declared is not None and any(one.declares for one in _within(home, declared))
    if here.role not in _IN_FILE or not known:
        raise RenameError(f"`{here.name}` is not declared in this file")
    return here


def _key(file: NamingFile) -> Path:
    return Path(file.file).resolve()


# The declaration.


def _home(file: NamingFile, here: NameOccurrence) -> tuple[Document | None, NameOccurrence | None]:
    """The machine that declares what a name means, with a place of the name in it; None where none does."""
    machine = file.machine
    if machine is None:
        return None, None
    document: Document | None = machine
    role, owner = here.role, here.owner
    if owner in machine.table.imports and role is Role.ARGUMENT:
        document, role, owner = machine.imported(owner), Role.PARAMETER, ""
    elif owner in machine.table.states:
        document, owner = instance_of(machine, owner), ""
    elif role is Role.EVENT and not _declares_event(machine, here.name):
        inner = (machine.imported(name) for name in machine.table.imports)
        document = next((one for one in inner if one and _declares_event(one, here.name)), machine)
    if document is None:
        return None, None
    return document, _declaring(document, here.name, role, owner)


def _declares_event(document: Document, name: str) -> bool:
    found = _declaring(document, name, Role.EVENT, "")
    return found is not None and found.declares


def _declaring(document: Document, name: str, role: Role, owner: str) -> NameOccurrence | None:
    """A place in a machine where a name has a role, its declaration if it is there."""
    roles = same_roles(role)
    final = name in document.table.states and document.table.states[name].kind is StateKind.FINAL
    if role is Role.EVENT and final:
        roles = (Role.EVENT, Role.STATE)
    found = [one for one in document.occurrences if one.name == name and one.role in roles and one.owner == owner]
    return max(found, key=lambda one: one.declares, default=None)


def _within(document: Document, here: NameOccurrence) -> list[NameOccurrence]:
    """The places of the declaring file."""
    roles = same_roles(here.role)
    final = here.name in document.table.states and document.table.states[here.name].kind is StateKind.FINAL
    if final and here.role in (Role.STATE, Role.EVENT):
        roles = (Role.STATE, Role.EVENT)  # the name of a final state is an outcome, too
    return [
        one for one in document.occurrences if one.name == here.name and one.role in roles and one.owner == here.owner
    ]


# Other files.


def _elsewhere(home: Document, declared: NameOccurrence, other: NamingFile) -> Iterator[NameOccurrence]:
    """The places of another file that mean what a machine declares."""
    machine = other.machine
    if machine is None:
        return
    if machine is not other and _key(machine) == _key(home):
        yield from (one for one in other.occurrences if _means_the_same(one, declared))
        return
    for name in (one for one in machine.table.imports if _imports(machine, one, home)):
        lines = _instance_lines(machine, name) if machine is other else None
        for one in other.occurrences:
            if _of_import(machine, name, declared, one, lines):
                yield one


def _of_import(
    machine: Document, imported: str, declared: NameOccurrence, one: NameOccurrence, lines: set[int] | None
) -> bool:
    """Whether a name in a machine, or in the scenarios about it, means what the machine that it imports declares.

    Args:
        machine: the machine.
        imported: the name of the one that it imports.
        declared: a name of that.
        one: the name in question.
        lines: where the machine speaks of instances; None in scenarios, which may do so anywhere.
    """
    if one.name != declared.name and declared.role is not Role.MACHINE:
        return False
    instance = machine.table.states.get(one.owner)
    inside = instance is not None and instance.instance is not None and str(instance.instance.name) == imported
    match declared.role:
        case Role.MACHINE:
            return one.role is Role.MACHINE and one.name == imported
        case Role.PARAMETER:
            return one.role is Role.ARGUMENT and one.owner == imported
        case Role.STATE:
            outcome = one.role is Role.VALUE and _may_be_outcome(machine, imported, one.name)
            heard = one.role is Role.EVENT and (lines is None or one.line in lines or inside)
            return heard or outcome or (one.role is Role.STATE and inside)
        case Role.VARIABLE:
            return inside and one.role is Role.VARIABLE
        case Role.EVENT:
            return one.role is Role.EVENT
        case _:
            return False


def _may_be_outcome(machine: Document, imported: str, name: str) -> bool:
    """Whether a bare name can only be how an instance of an imported machine has ended."""
    calls = [one.instance for one in machine.table.all_states() if one.instance is not None]
    own = [line for line in machine.table.root.lines if isinstance(line, ast.EnumerationLine)]
    taken = {str(member) for line in own for member in line.members}
    taken |= {member.value for kind in machine.library.enumerations.values() for member in kind}
    return name not in taken and any(str(one.name) == imported for one in calls)


def _means_the_same(one: NameOccurrence, here: NameOccurrence) -> bool:
    return one.name == here.name and one.role in same_roles(here.role) and one.owner == here.owner


def _imports(other: Document, name: str, document: Document) -> bool:
    path = find_import(str(other.table.imports[name]), Path(other.file).parent, other.library)
    return path.resolve() == Path(document.file).resolve()


def _instance_lines(other: Document, machine: str) -> set[int]:
    """The lines of the states that are instances of a machine."""
    found: set[int] = set()
    for symbol in other.table.all_states():
        if symbol.instance is not None and str(symbol.instance.name) == machine and symbol.token is not None:
            first = symbol.token.line - 1
            found.update(range(first, block_end(other, first) + 1))
    return found
