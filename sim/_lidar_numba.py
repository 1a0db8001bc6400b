"""The projection of `sim.lidar` as machine code: the same operations in the same order, hence the same bits."""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

Ranges = NDArray[np.float64]


@numba.njit(cache=True, error_model="numpy")  # type: ignore[untyped-decorator, unused-ignore]
def project(
    segments: Ranges,
    sensor: tuple[float, float, float, float],
    beams: Ranges,
    fan: tuple[float, float, float],
) -> Ranges:
    """The distance along each beam to the nearest segment; see `sim.lidar.project`."""
    x, y, cos, sin = sensor
    angle_min, increment, reach = fan
    count = beams.shape[1]
    ranges = np.full(count, np.inf)
    for index in range(len(segments)):
        dx, dy = segments[index, 0] - x, segments[index, 1] - y
        ax, ay = cos * dx + sin * dy, cos * dy - sin * dx
        dx, dy = segments[index, 2] - x, segments[index, 3] - y
        bx, by = cos * dx + sin * dy, cos * dy - sin * dx
        first, second = math.atan2(ay, ax), math.atan2(by, bx)
        low, high = min(first, second), max(first, second)
        if high - low > math.pi:
            low, high = high, low + math.tau
        for turn in (-math.tau, 0.0, math.tau):
            begin = int(max(math.floor((low + turn - angle_min) / increment), 0.0))
            end = int(min(math.ceil((high + turn - angle_min) / increment), count - 1.0))
            for beam in range(begin, end + 1):
                ux, uy = beams[0, beam], beams[1, beam]
                side_a, side_b = ux * ay - uy * ax, ux * by - uy * bx
                if min(side_a, side_b) > 0.0 or max(side_a, side_b) < 0.0:
                    continue
                ahead_a, ahead_b = ux * ax + uy * ay, ux * bx + uy * by
                between = side_a - side_b
                if between == 0.0:
                    distance = min(ahead_a if ahead_a >= 0.0 else math.inf, ahead_b if ahead_b >= 0.0 else math.inf)
                else:
                    distance = ahead_a + side_a / between * (ahead_b - ahead_a)
                if 0.0 <= distance < ranges[beam]:
                    ranges[beam] = distance
    for beam in range(count):
        if ranges[beam] > reach:
            ranges[beam] = np.inf
    return ranges
