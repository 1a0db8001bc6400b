"""Filters of a scan's readings."""

from __future__ import annotations

import numpy as np

from perception.sweep import Floats


def moving_average(values: Floats, window: int) -> Floats:
    """The mean of each value and its neighbours; values that are not finite are left out and stay as they are.

    At the ends the window is cut off.

    Args:
        values: shape (n,).
        window: how many values, an odd number; one changes nothing.

    Raises:
        ValueError: the window is even or less than one.
    """
    if window < 1 or window % 2 == 0:
        raise ValueError(f"a moving average needs an odd window of at least 1, not {window}")
    values = np.asarray(values, dtype=np.float64)
    finite = np.isfinite(values)
    half = window // 2
    sums = np.concatenate(([0.0], np.where(finite, values, 0.0).cumsum()))
    counts = np.concatenate(([0], finite.cumsum()))
    first = np.clip(np.arange(len(values)) - half, 0, None)
    stop = np.clip(np.arange(len(values)) + half + 1, None, len(values))
    averages = (sums[stop] - sums[first]) / np.maximum(counts[stop] - counts[first], 1)
    return np.where(finite, averages, values)
