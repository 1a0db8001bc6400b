"""The limits of variables, time-outs and parameters; a value beyond them is a fault of the machine."""

from __future__ import annotations

from math import isfinite

from hsm.engine.clock import nanoseconds
from hsm.model.types import LARGEST_INTEGER, Integer, Quantity, Type


class LimitError(ArithmeticError):
    """A value that a machine cannot hold; the message says why."""


def whole(value: int) -> int:
    """A whole number as it is.

    Raises:
        LimitError: it has more than 63 bits.
    """
    if -LARGEST_INTEGER - 1 <= value <= LARGEST_INTEGER:
        return value
    raise LimitError("a whole number has grown beyond 63 bits")


def finite(value: float) -> float:
    """A number as it is.

    Raises:
        LimitError: it is infinite or NaN.
    """
    if isfinite(value):
        return value
    raise LimitError(f"a variable cannot hold {value}")


def duration(value: float) -> int:
    """A duration in seconds as whole nanoseconds.

    Raises:
        LimitError: it is negative, infinite or NaN.
    """
    if isfinite(value) and value >= 0:
        return nanoseconds(value)
    raise LimitError(f"a duration cannot be {value:.10g} s")


def interval(value: float) -> int:
    """The time from one repetition to the next in seconds, as whole nanoseconds.

    Raises:
        LimitError: it is none, negative, infinite or NaN.
    """
    if found := duration(value):
        return found
    raise LimitError("`every` needs a duration of a nanosecond or more")


def reason_of(error: Exception) -> str:
    """Why a computation failed, in words that are the same in every version of Python."""
    match error:
        case LimitError():
            return str(error)
        case ZeroDivisionError():
            return "division by zero"
        case OverflowError():
            return "a number is too large"
        case _:
            return repr(error)


def following(deadline: int, now: int, step: int) -> int:
    """The first of the times that follow a deadline at equal distances, in nanoseconds, which is still to come."""
    return deadline + step * max(1, (now - deadline) // step + 1)


def within_limits(value: float, kind: Type) -> bool:
    """Whether a machine can hold a value of a type."""
    match kind:
        case Integer():
            return -LARGEST_INTEGER - 1 <= value <= LARGEST_INTEGER
        case Quantity():
            return isfinite(value)
        case _:
            return True
