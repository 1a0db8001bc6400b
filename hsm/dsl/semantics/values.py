"""Declared values, named expressions, and the names of types in messages."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum, StrEnum

from hsm.dsl.syntax import ast
from hsm.model.diagnostics import Place
from hsm.model.expressions import Expression
from hsm.model.rewriting import parts_of
from hsm.model.types import BOOLEAN, INTEGER, NUMBER, QUANTITY_NAMES, Boolean, Enumeration, Integer, Quantity, Type
from hsm.model.values import dataclass

SIMPLE_TYPES: dict[str, Type] = {"bool": BOOLEAN, "int": INTEGER}
"""The types that are not enumerations, by name."""
SIMPLE_TYPES.update((name, quantity) for quantity, name in QUANTITY_NAMES.items())


OTHER_TYPES = {
    **dict.fromkeys(("float", "double", "real"), "number"),
    **dict.fromkeys(("integer", "long", "uint"), "int"),
    **dict.fromkeys(("boolean", "Bool"), "bool"),
    **dict.fromkeys(("duration", "seconds"), "time"),
    **dict.fromkeys(("distance", "meters"), "length"),
}
"""Names of types in other languages, and their names here."""

OTHER_UNITS = {
    **dict.fromkeys(("sec", "secs", "second", "seconds"), "s"),
    **dict.fromkeys(("msec", "millisecond", "milliseconds"), "ms"),
    **dict.fromkeys(("minute", "minutes"), "min"),
    **dict.fromkeys(("meter", "meters", "metre", "metres"), "m"),
    **dict.fromkeys(("degree", "degrees"), "deg"),
    **dict.fromkeys(("radian", "radians"), "rad"),
}
"""Other names of units, and their names here."""


@dataclass(frozen=True, slots=True)
class Declared:
    """A variable or a parameter of the machine, or what an instance exposes.

    Attributes:
        type: its type.
        constant: it keeps its value while the machine runs.
        place: where it is declared.
        owner: the instance that it belongs to and that can change it; None for the machine's own.
    """

    type: Type
    constant: bool
    place: Place
    owner: str | None = None


@dataclass(slots=True)
class Definition:
    """A named expression.

    Attributes:
        node: its syntax.
        place: where its name is declared.
        value: the typed expression, once it was analysed; None if an error was reported.
        state: how far it is analysed.
    """

    node: ast.Expression
    place: Place
    value: Expression | None = None
    state: DefinitionVisit | None = None


class DefinitionVisit(Enum):
    """How far a definition is analysed."""

    OPEN = "open"
    DONE = "done"


def size_of(expression: Expression) -> int:
    """How many parts an expression has."""
    return sum(1 for _ in parts_of(expression))


def meant(name: str, others: Mapping[str, str]) -> str | None:
    """The question whether a word from another language was meant."""
    return f"did you mean `{others[name]}`?" if name in others else None


def listed(intro: str, names: Mapping[str, object]) -> str:
    """Names in a sentence."""
    return f"{intro} {', '.join(names) or 'none'}"


def type_of_enumeration(enumeration: type[StrEnum]) -> Enumeration:
    """The type of an enumeration of Python."""
    return Enumeration(enumeration.__name__, tuple(member.value for member in enumeration))


def as_quantity(kind: Type) -> Quantity:
    """A numeric type as a quantity: whole numbers count as plain ones."""
    return kind if isinstance(kind, Quantity) else NUMBER


def comparable(left: Type, right: Type) -> bool:
    """Whether values of two types can be compared."""
    numeric = (Integer, Quantity)
    if isinstance(left, numeric) and isinstance(right, numeric):
        return as_quantity(left) == as_quantity(right)
    return left == right


def in_words(kind: Type) -> str:
    """A type in a sentence."""
    match kind:
        case Boolean():
            return "a condition (bool)"
        case Integer():
            return "a whole number (int)"
        case Enumeration():
            return f"a {kind}"
        case Quantity():
            if kind == NUMBER:
                return "a plain number"
            article = "an" if str(kind)[0] in "aeiou" else "a"
            return f"{article} {kind} in {kind.si_unit}" if kind in QUANTITY_NAMES else f"a {kind}"


def joined(left: Expression, right: Expression) -> Place | None:
    """From the beginning of one expression to the end of another."""
    if left.place is None or right.place is None:
        return None
    return Place(left.place.file, left.place.line, left.place.column, right.place.end_line, right.place.end_column)
