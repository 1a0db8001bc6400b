"""Values as whole numbers in the same order, so that thresholds of every type are of one kind.

A whole number is itself, ``false`` and ``true`` are 0 and 1, members of an enumeration are counted. Floats are counted
in their order, infinities included; NaN comes after the greatest, so that it is below no threshold. So a comparison
with a constant is exact, as the processor makes it.
"""

from __future__ import annotations

import math
import struct
from typing import Any

from hsm.model.types import LARGEST_INTEGER, Boolean, Enumeration, Integer, Quantity, Type

NOT_A_NUMBER = 0x7FF0000000000000 + 1
"""The ordinal of NaN."""

MOST = 10**30
"""The greatest whole number that is distinguished from greater ones, and with the other sign the least."""


def ordinal(value: Any, kind: Type) -> int:
    """The number of a value.

    Raises:
        ValueError: it is not a member of the enumeration.
    """
    match kind:
        case Boolean() | Integer():
            return int(value)
        case Enumeration(members=members):
            return members.index(str(value))
    return float_ordinal(float(value))


def float_ordinal(value: float) -> int:
    """The number of a float."""
    if math.isnan(value):
        return NOT_A_NUMBER
    bits: int = struct.unpack("<q", struct.pack("<d", value + 0.0))[0]
    return bits if bits >= 0 else -(bits & 0x7FFFFFFFFFFFFFFF)


def float_at(number: int) -> float:
    """The float of a number."""
    if number >= NOT_A_NUMBER:
        return math.nan
    bits = number if number >= 0 else -number | -0x8000000000000000
    found: float = struct.unpack("<d", struct.pack("<q", bits))[0]
    return found


def value_at(number: int, kind: Type) -> Any:
    """The value of a number; a member of an enumeration by its name."""
    match kind:
        case Boolean():
            return bool(number)
        case Integer():
            return number
        case Enumeration(members=members):
            return members[number]
    return float_at(number)


def domain(kind: Type, *, not_a_number: bool = True) -> tuple[int, int]:
    """The least and the greatest ordinal of a type."""
    match kind:
        case Boolean():
            return 0, 1
        case Integer():
            return -MOST, MOST
        case Enumeration(members=members):
            return 0, len(members) - 1
    infinity = float_ordinal(math.inf)
    return -infinity, NOT_A_NUMBER if not_a_number else infinity


def held(kind: Type) -> tuple[int, int]:
    """The least and the greatest ordinal of the values of a variable or parameter.

    Floats in it are finite, whole numbers have 63 bits.
    """
    match kind:
        case Quantity():
            infinity = float_ordinal(math.inf)
            return 1 - infinity, infinity - 1
        case Integer():
            return -LARGEST_INTEGER - 1, LARGEST_INTEGER
    return domain(kind)


def within(least: int, most: int, kind: Type) -> Any:
    """A value from an interval of ordinals that a person would choose: zero, or one with few digits."""
    if isinstance(kind, Boolean | Enumeration):
        return value_at(least, kind)
    if least <= 0 <= most:
        return value_at(0, kind)
    if isinstance(kind, Integer):
        return least if least > 0 else most
    return _rounded(least, min(most, NOT_A_NUMBER - 1))


def _rounded(least: int, most: int) -> float:
    """The float with the fewest digits in an interval, preferably well inside it."""
    if least > most:
        return math.nan
    low, high = max(float_at(least), -1e9), min(float_at(most), 1e9)
    if low > high:
        return float_at(least)
    if low == high:
        return low
    near = low + min((high - low) / 2, max(abs(low) * 0.1, 0.1)) if low >= 0 else max(high - 0.1, (low + high) / 2)
    for middle in (near, (low + high) / 2):
        for digits in range(1, 17):
            rounded = float(f"{middle:.{digits}g}")
            if low < rounded < high:
                return rounded
    return low
