"""The types of the language's values, and the units that its quantities are written in."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated, Any, get_args, get_origin


@dataclass(frozen=True, slots=True)
class Boolean:
    """True or false."""

    def __str__(self) -> str:
        return "bool"


@dataclass(frozen=True, slots=True)
class Integer:
    """A whole number."""

    def __str__(self) -> str:
        return "int"


@dataclass(frozen=True, slots=True)
class Quantity:
    """A real number with a dimension: the exponents of metre, second and radian; all zero for a plain number."""

    length: int = 0
    time: int = 0
    angle: int = 0

    def __mul__(self, other: Quantity) -> Quantity:
        return Quantity(self.length + other.length, self.time + other.time, self.angle + other.angle)

    def __truediv__(self, other: Quantity) -> Quantity:
        return Quantity(self.length - other.length, self.time - other.time, self.angle - other.angle)

    def __str__(self) -> str:
        return QUANTITY_NAMES.get(self) or f"number in {self.si_unit}"

    @property
    def si_unit(self) -> str:
        """The SI unit of a value of this type, ``1`` for a plain number."""
        powers = (("m", self.length), ("s", self.time), ("rad", self.angle))
        above = [_power(unit, exponent) for unit, exponent in powers if exponent > 0]
        below = [_power(unit, -exponent) for unit, exponent in powers if exponent < 0]
        if not above and below == ["s"]:
            return "Hz"
        return "/".join(["*".join(above) or "1", *below])


def _power(unit: str, exponent: int) -> str:
    return unit if exponent == 1 else f"{unit}^{exponent}"


@dataclass(frozen=True, slots=True)
class Enumeration:
    """One of several names, declared in Python as a ``StrEnum``; at run time a value is the member itself."""

    name: str
    members: tuple[str, ...]

    def __str__(self) -> str:
        return self.name


Type = Boolean | Integer | Quantity | Enumeration

BOOLEAN = Boolean()
INTEGER = Integer()
NUMBER = Quantity()

QUANTITY_NAMES: dict[Quantity, str] = {
    NUMBER: "number",
    Quantity(length=1): "length",
    Quantity(time=1): "time",
    Quantity(angle=1): "angle",
    Quantity(length=1, time=-1): "speed",
    Quantity(angle=1, time=-1): "turn_rate",
    Quantity(time=-1): "frequency",
    Quantity(length=1, time=-2): "acceleration",
}
"""The names under which the language knows its quantities."""


@dataclass(frozen=True, slots=True)
class Unit:
    """A unit: the quantity it measures and how many SI units it is.

    Used as an annotation in the registry: ``Annotated[float, UNITS["m/s"]]``; values are handed over in SI units.
    """

    name: str
    quantity: Quantity
    factor: float


UNITS: dict[str, Unit] = {
    unit.name: unit
    for unit in (
        Unit("m", Quantity(length=1), 1.0),
        Unit("cm", Quantity(length=1), 0.01),
        Unit("mm", Quantity(length=1), 0.001),
        Unit("s", Quantity(time=1), 1.0),
        Unit("ms", Quantity(time=1), 0.001),
        Unit("min", Quantity(time=1), 60.0),
        Unit("rad", Quantity(angle=1), 1.0),
        Unit("deg", Quantity(angle=1), math.pi / 180),
        Unit("m/s", Quantity(length=1, time=-1), 1.0),
        Unit("cm/s", Quantity(length=1, time=-1), 0.01),
        Unit("rad/s", Quantity(angle=1, time=-1), 1.0),
        Unit("deg/s", Quantity(angle=1, time=-1), math.pi / 180),
        Unit("m/s^2", Quantity(length=1, time=-2), 1.0),
        Unit("Hz", Quantity(time=-1), 1.0),
    )
}

Length = Annotated[float, UNITS["m"]]
Duration = Annotated[float, UNITS["s"]]
Angle = Annotated[float, UNITS["rad"]]
Speed = Annotated[float, UNITS["m/s"]]
TurnRate = Annotated[float, UNITS["rad/s"]]


def type_of(annotation: Any) -> Type:
    """The language's type for a Python annotation.

    Raises:
        TypeError: the annotation is none of bool, int, float, ``Annotated[float, Unit]`` and a ``StrEnum``.
    """
    if get_origin(annotation) is Annotated:
        units = [extra for extra in get_args(annotation)[1:] if isinstance(extra, Unit)]
        if len(units) == 1:
            return units[0].quantity
    simple: dict[Any, Type] = {bool: BOOLEAN, int: INTEGER, float: NUMBER}
    if annotation in simple:
        return simple[annotation]
    if isinstance(annotation, type) and issubclass(annotation, StrEnum):
        return Enumeration(annotation.__name__, tuple(member.value for member in annotation))
    raise TypeError(f"{annotation!r} has no counterpart in the language: use bool, int, float, a unit or a StrEnum")
