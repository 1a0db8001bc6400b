"""The lowest and the highest of some values, with an answer for no values.

``argmin`` is compiled through and through, where ``min`` goes through Python and ``partition`` is slow: for the few
hundred values of a scan they take several times as long.
"""

from __future__ import annotations

import math

from perception.sweep import Floats


def lowest(values: Floats, otherwise: float = math.inf) -> float:
    """The lowest value; ``otherwise`` where there is none.

    Args:
        values: shape (n,), without NaN.
        otherwise: what to say of no values.
    """
    return values.item(values.argmin()) if len(values) else otherwise


def highest(values: Floats, otherwise: float = -math.inf, *, passed_over: int = 0) -> float:
    """The maximum after discarding the k highest values.

    Args:
        values: shape (n,), without NaN.
        otherwise: what to say where there are no more than those.
        passed_over: how many, a small number.
    """
    if len(values) <= passed_over:
        return otherwise
    if passed_over:
        values = values.copy()
    for _ in range(passed_over):
        values[values.argmax()] = -math.inf
    return values.item(values.argmax())
