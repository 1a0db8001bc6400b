"""Typed expressions: what guards, arguments and assignments are made of. Frozen trees; nothing here evaluates them."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from typing import Any

from hsm.model.diagnostics import Place
from hsm.model.registry import SignalDeclaration
from hsm.model.types import BOOLEAN, Boolean, Type
from hsm.model.values import dataclass


@dataclass(frozen=True, slots=True)
class Literal:
    """A constant, in SI units; a member of an enumeration is the Python member itself."""

    value: Any
    type: Type
    place: Place | None = None


@dataclass(frozen=True, slots=True)
class VariableValue:
    """The value of a variable or parameter of the machine, by its full name (``door.timeout`` within an instance)."""

    name: str
    type: Type
    place: Place | None = None


@dataclass(frozen=True, slots=True)
class EventValue(VariableValue):
    """What the event that is handled carries, by the event's name and its own (``floor.number``)."""


@dataclass(frozen=True, slots=True)
class SignalValue:
    """The value of a signal in this step; its arguments are constants or parameters."""

    signal: SignalDeclaration
    arguments: tuple[Expression, ...] = ()
    place: Place | None = None

    @property
    def type(self) -> Type:
        """The signal's declared type."""
        return self.signal.type


@dataclass(frozen=True, slots=True)
class Computed(SignalValue):
    """A condition over the data of a chart.

    Attributes:
        compute: its value, given the signals of the step (which hold the data) and the active states.
    """

    compute: Callable[[Mapping[Any, Any], Collection[int]], bool] = lambda _memo, _active: False


@dataclass(frozen=True, slots=True)
class Active:
    """Whether a state, by its full name, is in the configuration (SCXML's ``In``)."""

    state: str
    place: Place | None = None

    @property
    def type(self) -> Boolean:
        """Always a boolean."""
        return BOOLEAN


@dataclass(frozen=True, slots=True)
class Unary:
    """``not x``, ``-x`` or ``abs(x)``."""

    operator: str
    operand: Expression
    type: Type
    place: Place | None = None


@dataclass(frozen=True, slots=True)
class Binary:
    """``and or == != < <= > >= + - * / min max``; ``and`` and ``or`` do not evaluate what cannot matter."""

    operator: str
    left: Expression
    right: Expression
    type: Type
    place: Place | None = None


@dataclass(frozen=True, slots=True)
class Choice:
    """``then if condition else otherwise``, of two numbers or names; only the one that is chosen is evaluated."""

    condition: Expression
    then: Expression
    otherwise: Expression
    type: Type
    place: Place | None = None


Expression = Literal | VariableValue | SignalValue | Active | Unary | Binary | Choice
