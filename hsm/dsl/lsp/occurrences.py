"""Every name in a file with its role: the basis of references, renaming and highlighting.

The syntax tree is walked once; a table gives the role of the tokens in each field of a node. A name in an expression
gets its role from its declaration: in the file first, then in the library.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from enum import Enum

from hsm.dsl.semantics.symbols import HISTORY, SymbolTable
from hsm.dsl.semantics.typing import FUNCTIONS
from hsm.dsl.syntax import ast
from hsm.dsl.syntax.tokens import Token
from hsm.model.registry import Library
from hsm.model.values import dataclass


class Role(Enum):
    """What a name represents; the values are the protocol's names of token types."""

    MACHINE = "namespace"
    STATE = "class"
    EVENT = "event"
    VARIABLE = "variable"
    PARAMETER = "parameter"
    SIGNAL = "property"
    ACTIVITY = "method"
    ACTION = "function"
    FUNCTION = "macro"
    ARGUMENT = "label"
    VALUE = "enumMember"
    TYPE = "type"
    PROPERTY = "interface"


@dataclass(frozen=True, slots=True)
class NameOccurrence:
    """A name at one place.

    Attributes:
        name: the name; of a state's history, the state's.
        role: what it represents.
        line: counted from 0.
        column: in characters, from 0.
        declares: whether it is declared here.
        owner: for an argument, the name of its signal, activity, action, event or machine.
    """

    name: str
    role: Role
    line: int
    column: int
    declares: bool = False
    owner: str = ""

    @property
    def end(self) -> int:
        """The column after its last character."""
        return self.column + len(self.name)


_DECLARED = {
    ("MachineLine", "name"): Role.MACHINE,
    ("ParameterLine", "name"): Role.PARAMETER,
    ("VariableLine", "name"): Role.VARIABLE,
    ("EventSyntax", "name"): Role.EVENT,
    ("DefinitionLine", "name"): Role.VARIABLE,
    ("EnumerationLine", "name"): Role.TYPE,
    ("EnumerationLine", "members"): Role.VALUE,
    ("StateBlock", "name"): Role.STATE,
    ("FinalLine", "name"): Role.STATE,
    ("PropertyLine", "name"): Role.PROPERTY,
    ("AssumptionLine", "name"): Role.PROPERTY,
}
_NAMED = {
    ("ImportLine", "name"): Role.MACHINE,
    ("ParameterLine", "type"): Role.TYPE,
    ("VariableLine", "type"): Role.TYPE,
    ("FieldSyntax", "type"): Role.TYPE,
    ("InitialLine", "target"): Role.STATE,
    ("ExposeLine", "names"): Role.VARIABLE,
    ("TargetSyntax", "names"): Role.STATE,
    ("TransitionLine", "names"): Role.EVENT,
    ("RaiseSyntax", "event"): Role.EVENT,
    ("CancelSyntax", "event"): Role.EVENT,
    ("AssignSyntax", "variable"): Role.VARIABLE,
    ("Named", "name"): Role.ARGUMENT,
}
CLAIM_FUNCTIONS = ("doing", "holding")
"""What only the conditions of properties ask."""
_CALLED = {"DoLine": Role.ACTIVITY, "StateBlock": Role.MACHINE, "actions": Role.ACTION, "RaiseSyntax": Role.EVENT}


def occurrences(tree: ast.File, table: SymbolTable, library: Library) -> list[NameOccurrence]:
    """All names of a file, in the order of its text."""
    walker = _Walker(table, library)
    found = [one for item in tree.items for one in walker.walk(item, "", "")]
    return sorted(found, key=lambda one: (one.line, one.column))


def names_in(node: object, table: SymbolTable, library: Library, within: str = "") -> Iterator[NameOccurrence]:
    """The names of a part of a syntax tree, for a text that is not a machine's file but names what one declares.

    Args:
        node: the part.
        table: the machine's states and imports.
        library: what the machine may name.
        within: the statement that a call is part of: ``DoLine`` for an activity, ``actions`` for an action,
            ``RaiseSyntax`` for an event; empty for an expression.
    """
    field = {"RaiseSyntax": "event"}.get(within, "")
    yield from _Walker(table, library).walk(node, within, field)


@dataclass(frozen=True, slots=True)
class _Walker:
    table: SymbolTable
    library: Library

    def walk(self, root: object, parent: str, field: str) -> Iterator[NameOccurrence]:
        """The names below a node; an explicit stack, since blocks may be nested deep."""
        pending: list[tuple[object, str, str, str]] = [(root, parent, field, "")]
        while pending:
            node, parent, field, owner = pending.pop()
            if isinstance(node, Token):
                yield from self._token(node, parent, field, owner)
            elif isinstance(node, tuple):
                pending.extend((one, parent, field, owner) for one in node)
            elif isinstance(node, ast.EventSyntax):
                yield from self._token(node.name, "EventSyntax", "name", "")
                for part in node.fields:
                    yield _occurrence(part.name, Role.ARGUMENT, declares=True, owner=str(node.name))
                    yield from self._token(part.type, "FieldSyntax", "type", "")
            elif isinstance(node, ast.RaiseSyntax | ast.SendSyntax):
                yield from self._call(node.data, "RaiseSyntax", "call")
                pending.extend((one, "CallSyntax", "arguments", str(node.event)) for one in node.data.arguments)
                if isinstance(node, ast.RaiseSyntax):
                    pending.append((node.delay, "RaiseSyntax", "delay", ""))
            elif isinstance(node, ast.CallSyntax):
                yield from self._call(node, parent, field)
                pending.extend((one, "CallSyntax", "arguments", str(node.name)) for one in node.arguments)
            elif is_dataclass(node):
                kind = type(node).__name__
                inherited = owner if kind == "Named" else ""
                pending.extend((getattr(node, one.name), kind, one.name, inherited) for one in fields(node))

    def _token(self, token: Token, parent: str, field: str, owner: str) -> Iterator[NameOccurrence]:
        key = (parent, field)
        if key in _DECLARED:
            yield _occurrence(token, _DECLARED[key], declares=True)
        elif key in _NAMED:
            role = _NAMED[key]
            if role is Role.EVENT and self._in_instance(token):
                yield from _parted(token, token.partition(".")[0], Role.STATE, role)
            else:
                yield _occurrence(token, self._declared_role(str(token), role), owner=owner)
        elif token.type == "NAME" and field not in ("keyword", "operator", "arrow", "closing"):
            yield from self._value(token, owner)

    def _value(self, token: Token, owner: str) -> Iterator[NameOccurrence]:
        """A name in an expression; one that nothing here declares may be an outcome or a thing that is held."""
        if self._in_instance(token):
            instance, _, part = token.partition(".")
            inside = Role.STATE if owner == "in" and part not in HISTORY else self._part_role(part)
            yield from _parted(token, instance, Role.STATE, inside)
            return
        role = Role.STATE if owner == "in" else self._value_role(str(token))
        if role is None and self._carried(token):
            yield from _parted(token, token.rpartition(".")[0], Role.EVENT, Role.ARGUMENT)
        elif role is not None or "." not in token:
            yield _occurrence(token, role or Role.VALUE)

    def _in_instance(self, name: str) -> bool:
        """Whether a name is of something in an instance or a member."""
        stem, dot, _ = name.partition(".")
        return bool(dot) and stem in self.table.states and self.table.states[stem].instance is not None

    def _part_role(self, part: str) -> Role:
        """What a name within a member or an instance represents."""
        if part in self.library.signals:
            return Role.SIGNAL
        return Role.ACTIVITY if part in self.library.activities else Role.VARIABLE

    def _carried(self, token: Token) -> bool:
        """Whether a name is a part of what an event carries."""
        event, _, part = token.rpartition(".")
        for line in self.table.root.lines:
            if isinstance(line, ast.EventLine):
                for one in line.events:
                    if one.name == event and any(field.name == part for field in one.fields):
                        return True
        declared = self.library.events.get(event)
        return declared is not None and any(field.name == part for field in declared.fields)

    def _call(self, node: ast.CallSyntax, parent: str, field: str) -> Iterator[NameOccurrence]:
        role = _CALLED.get(parent) or _CALLED.get(field)
        if role is None:
            name = str(node.name)
            role = Role.FUNCTION if name in (*FUNCTIONS, *CLAIM_FUNCTIONS) else Role.SIGNAL
        if role is not Role.MACHINE and self._in_instance(node.name):
            yield from _parted(node.name, node.name.partition(".")[0], Role.STATE, role)
        else:
            yield _occurrence(node.name, role)

    def _declared_role(self, name: str, role: Role) -> Role:
        """If a parameter is assigned by mistake, the role of its declaration wins."""
        return self._value_role(name) or role if role is Role.VARIABLE else role

    def _value_role(self, name: str) -> Role | None:
        for line in self.table.root.lines:
            match line:
                case ast.ParameterLine(declared) if declared == name:
                    return Role.PARAMETER
                case ast.VariableLine(declared) if declared == name:
                    return Role.VARIABLE
                case ast.DefinitionLine(declared) if declared == name:
                    return Role.VARIABLE
                case ast.EnumerationLine(members=members) if name in members:
                    return Role.VALUE
        if name in self.library.signals:
            return Role.SIGNAL
        if any(name == member.value for kind in self.library.enumerations.values() for member in kind):
            return Role.VALUE
        if name in self.library.activities:
            return Role.ACTIVITY
        return Role.STATE if name in self.table.states else None


def _parted(token: Token, owner: str, first: Role, second: Role) -> Iterator[NameOccurrence]:
    """An event and a part of what it carries, an instance and what is in it: they are written as one name."""
    part = token[len(owner) + 1 :]
    line, column = token.line - 1, token.column - 1
    yield NameOccurrence(owner, first, line, column)
    yield NameOccurrence(part, second, line, column + len(owner) + 1, owner=owner)


def _occurrence(token: Token, role: Role, *, declares: bool = False, owner: str = "") -> NameOccurrence:
    name = str(token)
    if role is Role.STATE:
        stem, _, suffix = name.rpartition(".")
        name = stem if suffix in HISTORY else name
    return NameOccurrence(name, role, token.line - 1, token.column - 1, declares, owner)
