"""What an editor shows of a name, and of a call that is being written."""

from __future__ import annotations

from collections.abc import Iterable
from enum import Enum

from hsm.model.registry import Parameter
from hsm.model.types import Type
from hsm.model.values import dataclass


class SymbolKind(Enum):
    """What a word is."""

    KEYWORD = "keyword"
    STATE = "state"
    SIGNAL = "signal"
    ACTIVITY = "activity"
    ACTION = "action"
    EVENT = "event"
    VARIABLE = "variable"
    DEFINITION = "definition"
    PARAMETER = "parameter"
    PROPERTY = "property"
    ARGUMENT = "argument"
    FUNCTION = "function"
    VALUE = "value"
    TYPE = "type"
    UNIT = "unit"
    MACHINE = "machine"


@dataclass(frozen=True, slots=True)
class Entry:
    """Something that can be named.

    Attributes:
        label: the name.
        kind: its kind.
        detail: its type or its arguments, in one line.
        doc: its documentation.
        snippet: what is inserted instead of the name, with places to fill in, in the notation of editors; or empty.
        type: the type of its value; None if it has no value, or if the type is not known.
    """

    label: str
    kind: SymbolKind
    detail: str = ""
    doc: str = ""
    snippet: str = ""
    type: Type | None = None


@dataclass(frozen=True, slots=True)
class OpenCall:
    """A call that is being written.

    Attributes:
        name: what is called.
        doc: its documentation.
        parameters: what it takes.
        active: the position of the parameter that is being written; beyond the last, that of no parameter.
    """

    name: str
    doc: str
    parameters: tuple[Parameter, ...]
    active: int


def fitting(typed: str, possible: Iterable[Entry]) -> list[Entry]:
    """The candidates that contain the letters typed so far, each once."""
    return [one for one in dict.fromkeys(possible) if _fits(typed, one.label)]


def _fits(typed: str, label: str) -> bool:
    """Whether a label contains the typed letters in this order, as editors match them; dots separate words."""
    if "." in typed:
        return label.lower().startswith(typed.lower())
    letters = iter(label.lower())
    return all(letter in letters for letter in typed.lower())
