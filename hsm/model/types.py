"""The types of the language's values, and the units that its quantities are written in."""

from __future__ import annotations

from decimal import Decimal, InvalidOperation
from enum import StrEnum
from fractions import Fraction
from math import copysign, inf
from typing import Annotated, Any, get_args, get_origin

from hsm.model.values import dataclass


@dataclass(frozen=True, slots=True)
class Boolean:
    """True or false."""

    def __str__(self) -> str:
        return "bool"


LARGEST_INTEGER = 2**63 - 1
"""The largest absolute value of a whole number in a machine."""


@dataclass(frozen=True, slots=True)
class Integer:
    """A whole number of at most 63 bits and a sign."""

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


_PI = Fraction("3.14159265358979323846264338327950288419716939937510")
_DEGREE = _PI / 180
_FAR = 400
"""Decimal places beyond the range of floats, with room for every unit."""


@dataclass(frozen=True, slots=True)
class Unit:
    """A unit: its quantity and its value in SI units.

    Used as an annotation in the registry: ``Annotated[float, UNITS["m/s"]]``; values are passed in SI units.

    Attributes:
        name: how it is written.
        quantity: the quantity that it measures.
        scale: its value in SI units, exactly; for a degree to fifty digits.
    """

    name: str
    quantity: Quantity
    scale: Fraction

    @property
    def factor(self) -> float:
        """Its value in SI units, as the nearest float."""
        return float(self.scale)


def si_value(number: str, unit: Unit | None = None) -> float:
    """The float that is nearest to the exact SI value of a decimal number with a unit: ``70 cm`` is ``0.7``.

    Args:
        number: a decimal number, such as ``-0.5`` or ``1e3``.
        unit: its unit; None for a plain number.

    Returns:
        The value, infinite where no float is that large.

    Raises:
        ValueError: it is not a decimal number.
    """
    nearest = float(number)
    try:
        exact = Decimal(number)
    except InvalidOperation:  # an exponent that is too large for a decimal number, and for a float too
        return nearest
    # Far outside the range of floats the exponent alone would make an enormous fraction.
    if unit is None or unit.scale == 1 or not exact or abs(exact.adjusted()) > _FAR:
        return nearest
    try:
        return float(Fraction(exact) * unit.scale)
    except OverflowError:
        return copysign(inf, nearest)


UNITS: dict[str, Unit] = {
    unit.name: unit
    for unit in (
        Unit("m", Quantity(length=1), Fraction(1)),
        Unit("cm", Quantity(length=1), Fraction(1, 100)),
        Unit("mm", Quantity(length=1), Fraction(1, 1000)),
        Unit("s", Quantity(time=1), Fraction(1)),
        Unit("ms", Quantity(time=1), Fraction(1, 1000)),
        Unit("min", Quantity(time=1), Fraction(60)),
        Unit("rad", Quantity(angle=1), Fraction(1)),
        Unit("deg", Quantity(angle=1), _DEGREE),
        Unit("m/s", Quantity(length=1, time=-1), Fraction(1)),
        Unit("cm/s", Quantity(length=1, time=-1), Fraction(1, 100)),
        Unit("rad/s", Quantity(angle=1, time=-1), Fraction(1)),
        Unit("deg/s", Quantity(angle=1, time=-1), _DEGREE),
        Unit("m/s^2", Quantity(length=1, time=-2), Fraction(1)),
        Unit("Hz", Quantity(time=-1), Fraction(1)),
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
