"""Logical time: deadlines are whole nanoseconds, so that a duration is the same at any epoch.

Stamps come in as seconds in floats. Near today's date neighbouring floats are 240 ns apart: two stamps that are meant
to be five seconds apart may differ by less. A deadline therefore counts as reached up to two such spacings early.
"""

from __future__ import annotations

from math import floor, inf, ulp

SECOND = 1_000_000_000
"""Nanoseconds in a second."""

_SPACINGS = 2


def nanoseconds(seconds: float) -> int:
    """Seconds as whole nanoseconds, rounded to the nearest; exact up to that, however large they are."""
    whole = floor(seconds)
    return whole * SECOND + round((seconds - whole) * SECOND)


def seconds(nanoseconds: int) -> float:
    """Nanoseconds as seconds."""
    return nanoseconds / SECOND


def tolerance(time: float) -> int:
    """How many nanoseconds before it a deadline counts as reached at a stamp of this size, in seconds."""
    return 1 + round(_SPACINGS * ulp(time) * SECOND)


def reached(deadline: int, time: float) -> bool:
    """Whether a deadline in nanoseconds has come at a stamp in seconds."""
    return nanoseconds(time) + tolerance(time) >= deadline


def waking(deadlines: list[int]) -> float:
    """A stamp in seconds before which none of some deadlines has come; infinite without any."""
    if not deadlines:
        return inf
    earliest = seconds(min(deadlines))
    return earliest - 2 * seconds(tolerance(earliest))
