"""The lowest and the highest of some values, with a default for no values.

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
        otherwise: the result for no values.
    """
    return values.item(values.argmin()) if len(values) else otherwise


def highest(values: Floats, otherwise: float = -math.inf, *, passed_over: int = 0) -> float:
    """The maximum after discarding the k highest values.

    Args:
        values: shape (n,), without NaN.
        otherwise: the result if there are no other values.
        passed_over: how many, a small number.
    """
    if len(values) <= passed_over:
        return otherwise
    if passed_over:
        values = values.copy()
    for _ in range(passed_over):
        values[values.argmax()] = -math.inf
    return values.item(values.argmax())
