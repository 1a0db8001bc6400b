"""The syntax tree of one file, before names are resolved.

The leaves are tokens, which have line and column; a node that spans several has its first and last token.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import field
from typing import TypeAlias

from hsm.dsl.syntax.tokens import Token
from hsm.model.chart import StateKind
from hsm.model.diagnostics import Place
from hsm.model.values import dataclass

DEEPEST_EXPRESSION = 64
"""How deep an expression may be nested; even half of that is unreadable."""


@dataclass(frozen=True, slots=True)
class UnarySyntax:
    """``not x`` or ``-x``."""

    operator: Token
    operand: Expression
    depth: int


@dataclass(frozen=True, slots=True)
class BinarySyntax:
    """An arithmetic operation or a comparison."""

    operator: Token
    left: Expression
    right: Expression
    depth: int


@dataclass(frozen=True, slots=True)
class ChainSyntax:
    """Two or more operands joined by ``and``, or by ``or``."""

    operator: str
    operands: tuple[Expression, ...]
    depth: int


@dataclass(frozen=True, slots=True)
class Named:
    """``name = value`` among the arguments of a call."""

    name: Token
    value: Expression
    depth: int


@dataclass(frozen=True, slots=True)
class CallSyntax:
    """``name(arguments)``: a signal, an activity, an action, an instance, or one of the language's own functions."""

    name: Token
    arguments: tuple[Expression | Named, ...]
    closing: Token
    depth: int


@dataclass(frozen=True, slots=True)
class ChoiceSyntax:
    """``then if condition else otherwise``."""

    then: Expression
    condition: Expression
    otherwise: Expression
    depth: int


Expression: TypeAlias = Token | UnarySyntax | BinarySyntax | ChainSyntax | CallSyntax | ChoiceSyntax


@dataclass(frozen=True, slots=True)
class AssignSyntax:
    """``variable = value``, ``variable += value`` and the like."""

    variable: Token
    operator: Token
    value: Expression


@dataclass(frozen=True, slots=True)
class RaiseSyntax:
    """``raise event``, with what it carries as for a call, or ``raise event after duration``."""

    event: Token
    delay: Expression | None = None
    call: CallSyntax | None = None

    @property
    def data(self) -> CallSyntax:
        """What it carries, as a call of the event."""
        return CallSyntax(self.event, (), self.event, 1) if self.call is None else self.call


@dataclass(frozen=True, slots=True)
class SendSyntax:
    """``send event``, with what it carries as for a call."""

    event: Token
    call: CallSyntax | None = None

    @property
    def data(self) -> CallSyntax:
        """What it carries, as a call of the event."""
        return CallSyntax(self.event, (), self.event, 1) if self.call is None else self.call


@dataclass(frozen=True, slots=True)
class CancelSyntax:
    """``cancel event``."""

    event: Token


ActionSyntax: TypeAlias = AssignSyntax | RaiseSyntax | SendSyntax | CancelSyntax | CallSyntax


@dataclass(frozen=True, slots=True)
class MachineLine:
    """``machine NAME``."""

    name: Token


@dataclass(frozen=True, slots=True)
class ImportLine:
    """``import NAME``."""

    name: Token


@dataclass(frozen=True, slots=True)
class AdjustableSyntax:
    """``adjustable`` or ``adjustable(LEAST, MOST)`` after a parameter."""

    keyword: Token
    bounds: tuple[Expression, ...] = ()


@dataclass(frozen=True, slots=True)
class ParameterLine:
    """``param NAME : TYPE = VALUE, adjustable``."""

    name: Token
    type: Token
    default: Expression | None
    adjustable: AdjustableSyntax | None = None


@dataclass(frozen=True, slots=True)
class VariableLine:
    """``var NAME : TYPE = VALUE``."""

    name: Token
    type: Token
    initial: Expression


@dataclass(frozen=True, slots=True)
class FieldSyntax:
    """``NAME : TYPE`` in the parentheses of a declared event."""

    name: Token
    type: Token


@dataclass(frozen=True, slots=True)
class EventSyntax:
    """An event that is declared, with what it carries."""

    name: Token
    fields: tuple[FieldSyntax, ...] = ()


@dataclass(frozen=True, slots=True)
class EventLine:
    """``event NAME, NAME(FIELD : TYPE)``."""

    events: tuple[EventSyntax, ...]


@dataclass(frozen=True, slots=True)
class EnumerationLine:
    """``enum NAME = VALUE, VALUE``."""

    name: Token
    members: tuple[Token, ...]


@dataclass(frozen=True, slots=True)
class DefinitionLine:
    """``define NAME = EXPRESSION``."""

    name: Token
    value: Expression


@dataclass(frozen=True, slots=True)
class ExposeLine:
    """``expose NAME, NAME``."""

    names: tuple[Token, ...]


@dataclass(frozen=True, slots=True)
class InitialLine:
    """``initial NAME / actions``."""

    target: Token
    actions: tuple[ActionSyntax, ...]


@dataclass(frozen=True, slots=True)
class StateBlock:
    """A ``state``, an instance of a machine, a ``member`` or a ``parallel``, with what is indented below it.

    A state counts as atomic until a state inside it is seen.
    """

    name: Token
    kind: StateKind
    instance: CallSyntax | None
    items: tuple[Item, ...]
    member: bool = False


@dataclass(frozen=True, slots=True)
class FinalLine:
    """``final NAME``."""

    name: Token


@dataclass(frozen=True, slots=True)
class DoLine:
    """``do activity(arguments)``."""

    call: CallSyntax


@dataclass(frozen=True, slots=True)
class EntryLine:
    """``entry / actions``."""

    actions: tuple[ActionSyntax, ...]


@dataclass(frozen=True, slots=True)
class ExitLine:
    """``exit / actions``."""

    actions: tuple[ActionSyntax, ...]


@dataclass(frozen=True, slots=True)
class GuardSyntax:
    """``if condition``."""

    condition: Expression


@dataclass(frozen=True, slots=True)
class LastingSyntax:
    """``for duration``."""

    duration: Expression


@dataclass(frozen=True, slots=True)
class TargetSyntax:
    """``-> state`` or ``=> state``."""

    arrow: Token
    names: tuple[Token, ...]


@dataclass(frozen=True, slots=True)
class ActionsSyntax:
    """``/ action, action``."""

    actions: tuple[ActionSyntax, ...]


@dataclass(frozen=True, slots=True)
class TransitionLine:
    """A line that begins with ``on``, ``when``, ``else``, ``after``, ``every`` or ``defer``.

    Attributes:
        keyword: the word it begins with.
        names: the events of an ``on`` or ``defer``.
        operand: the condition of a ``when``, the duration of an ``after`` or ``every``.
        lasting: for how long the condition of a ``when`` must have held.
        guard: the condition after ``if``.
        target: where it goes.
        actions: the actions after the slash.
    """

    keyword: Token
    names: tuple[Token, ...] = ()
    operand: Expression | None = None
    lasting: Expression | None = None
    guard: Expression | None = None
    target: TargetSyntax | None = None
    actions: tuple[ActionSyntax, ...] = ()


@dataclass(frozen=True, slots=True)
class StayLine:
    """``stay`` or ``stay when condition``: no transition is wanted then."""

    keyword: Token
    condition: Expression | None = None


@dataclass(frozen=True, slots=True)
class PropertyLine:
    """``property NAME : CLAIM``.

    Attributes:
        name: the property's name.
        keyword: the first word of the claim.
        kind: ``never``, ``always``, ``recurrence``, ``response`` or ``precedence``.
        conditions: the claim's conditions, in order.
        within: its duration.
    """

    name: Token
    keyword: Token
    kind: str
    conditions: tuple[Expression, ...]
    within: Expression | None = None


@dataclass(frozen=True, slots=True)
class AssumptionLine(PropertyLine):
    """``assume NAME : CLAIM``."""


@dataclass(frozen=True, slots=True)
class BadLine:
    """A line that could not be read, or lines that are indented under one that has no block.

    Attributes:
        names: the names that are on it.
        declares: those that it may declare; None where it may declare anything.
        items: what is indented below it.
    """

    names: frozenset[str]
    declares: frozenset[str] | None
    items: tuple[Item, ...]


Item: TypeAlias = (
    MachineLine
    | ImportLine
    | ParameterLine
    | VariableLine
    | EventLine
    | EnumerationLine
    | DefinitionLine
    | ExposeLine
    | InitialLine
    | StateBlock
    | FinalLine
    | DoLine
    | EntryLine
    | ExitLine
    | TransitionLine
    | StayLine
    | PropertyLine
    | BadLine
)


@dataclass(frozen=True, slots=True)
class File:
    """One file as read.

    Attributes:
        name: the file's name, as diagnostics show it.
        items: its lines and blocks in order.
        lines: the text, line by line.
    """

    name: str
    items: tuple[Item, ...]
    lines: tuple[str, ...] = field(repr=False, default=())

    def comment_above(self, line: int) -> str:
        """The comment lines directly above a line (counted from 1), without their marks."""
        found: list[str] = []
        index = line - 2
        while index >= 0 and (text := self.lines[index].lstrip()).startswith("#"):
            found.append(text.lstrip("#").strip())
            index -= 1
        return "\n".join(reversed(found))


def imports_of(tree: File) -> Iterator[Token]:
    """The names of all imported machines, in order, including imports that are indented by mistake."""
    pending = list(reversed(tree.items))
    while pending:
        match pending.pop():
            case ImportLine(name):
                yield name
            case BadLine(items=items):
                pending.extend(reversed(items))


def depth_of(expression: Expression | Named) -> int:
    """How deep an expression is nested; a name or a number is not."""
    return 0 if isinstance(expression, Token) else expression.depth


def names_in(expression: Expression | Named) -> Iterator[str]:
    """All names in an expression, however deep it is."""
    pending: list[Expression | Named] = [expression]
    while pending:
        match pending.pop():
            case Token(value=name):
                yield name
            case UnarySyntax(operand=part) | Named(value=part):
                pending.append(part)
            case BinarySyntax(left=left, right=right):
                pending += (left, right)
            case ChainSyntax(operands=parts) | CallSyntax(arguments=parts):
                pending.extend(parts)
            case ChoiceSyntax(then, condition, otherwise):
                pending += (then, condition, otherwise)


def first_token(expression: Expression | Named) -> Token:
    """The leftmost token of an expression."""
    while not isinstance(expression, Token):
        match expression:
            case UnarySyntax(operator=token) | CallSyntax(name=token) | Named(name=token):
                return token
            case BinarySyntax(left=part):
                expression = part
            case ChainSyntax(operands=parts):
                expression = parts[0]
            case ChoiceSyntax(then=part):
                expression = part
    return expression


def last_token(expression: Expression | Named) -> Token:
    """The rightmost token of an expression."""
    while not isinstance(expression, Token):
        match expression:
            case CallSyntax(closing=token):
                return token
            case UnarySyntax(operand=part) | BinarySyntax(right=part) | Named(value=part):
                expression = part
            case ChainSyntax(operands=parts):
                expression = parts[-1]
            case ChoiceSyntax(otherwise=part):
                expression = part
    return expression


def place_of(file: str, first: Token, last: Token | None = None) -> Place:
    """The place from a token to another, or of a single one."""
    end = first if last is None else last
    line, column = first.line, first.column
    return Place(file, line, column, end.end_line or line, end.end_column or column + 1)
