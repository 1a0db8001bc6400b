"""Values as a person writes them in a text: ``0.5 m/s``, ``90 deg``, ``true``, ``left``."""

from __future__ import annotations

import re
from enum import StrEnum
from math import isfinite
from typing import Any

from hsm.model.types import LARGEST_INTEGER, UNITS, Boolean, Enumeration, Integer, Quantity, Type, si_value

_NUMBER = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(\S*)\s*", re.ASCII)
_WHOLE = re.compile(r"\s*[-+]?\d{1,19}\s*", re.ASCII)


def value_of(text: str, kind: Type, enumeration: type[StrEnum] | None = None) -> Any:
    """The value that a text represents.

    Args:
        text: what is written; a number without a unit is in SI units.
        kind: the type that is wanted.
        enumeration: where the members of an enumeration come from; without one a value of it is its name.

    Raises:
        ValueError: it is not a value of that type; the message says what to write.
    """
    match kind:
        case Boolean():
            if text.strip().lower() not in ("true", "false"):
                raise ValueError("write true or false")
            return text.strip().lower() == "true"
        case Integer():
            if _WHOLE.fullmatch(text) is None or not -LARGEST_INTEGER - 1 <= int(text) <= LARGEST_INTEGER:
                raise ValueError(f"write a whole number up to {LARGEST_INTEGER}")
            return int(text)
        case Enumeration(_, members):
            if text.strip() not in members:
                raise ValueError(f"one of {', '.join(members)}")
            return text.strip() if enumeration is None else enumeration(text.strip())
        case Quantity():
            return _quantity(text, kind)


def _quantity(text: str, quantity: Quantity) -> float:
    units = [unit.name for unit in UNITS.values() if unit.quantity == quantity]
    way_out = f"write a number and one of {', '.join(units)}" if units else "write a plain number"
    written = _NUMBER.fullmatch(text)
    if written is None:
        raise ValueError(way_out)
    number, unit = written.groups()
    if not isfinite(float(number)):
        raise ValueError("this number is too large")
    if not unit:
        return float(number)
    if unit not in UNITS or UNITS[unit].quantity != quantity:
        raise ValueError(way_out)
    return si_value(number, UNITS[unit])
