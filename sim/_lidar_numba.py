"""The projection of `sim.lidar` as machine code: the same operations for every hit, and so the same bits."""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

from sim.geometry import CLOSE, STRAIGHT

Ranges = NDArray[np.float64]
Vector = tuple[float, float]
ANGLE_ERROR = 3e-4
"""Upper limit of the error of `_rough_angle`, rad, well below `STRAIGHT`; it only widens the intervals of beams."""


@numba.njit(cache=True, inline="always")  # type: ignore[untyped-decorator, unused-ignore]
def _rough_angle(y: float, x: float) -> float:
    """The direction of (x, y) to within `ANGLE_ERROR`, several times as fast as atan2.

    A minimax polynomial of the arctangent on [0, 1] in odd powers up to seven, and symmetry.
    """
    larger, smaller = max(abs(x), abs(y)), min(abs(x), abs(y))
    if larger == 0.0:
        return 0.0
    ratio = smaller / larger
    square = ratio * ratio
    angle = ((-0.0464964749 * square + 0.15931422) * square - 0.327622764) * square * ratio + ratio
    if abs(y) > abs(x):
        angle = math.pi / 2 - angle
    if x < 0.0:
        angle = math.pi - angle
    return -angle if y < 0.0 else angle


@numba.njit(cache=True, inline="always")  # type: ignore[untyped-decorator, unused-ignore]
def _along_beam(u: Vector, a: Vector, b: Vector) -> float:
    """See `sim.lidar._along_beam`."""
    (ux, uy), (ax, ay), (bx, by) = u, a, b
    side_a, side_b = ux * ay - uy * ax, ux * by - uy * bx
    ahead_a, ahead_b = ux * ax + uy * ay, ux * bx + uy * by
    if side_a == side_b:
        return min(ahead_a if ahead_a >= 0.0 else math.inf, ahead_b if ahead_b >= 0.0 else math.inf)
    distance = ahead_a + side_a / (side_a - side_b) * (ahead_b - ahead_a)
    return distance if distance >= 0.0 else math.inf


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
    beam_x, beam_y = beams[0], beams[1]
    widening = ANGLE_ERROR / increment + 1.0
    nearness = np.zeros(count)
    nearest_close = np.full(count, np.inf)
    for index in range(len(segments)):
        dx, dy = segments[index, 0] - x, segments[index, 1] - y
        ax, ay = cos * dx + sin * dy, cos * dy - sin * dx
        dx, dy = segments[index, 2] - x, segments[index, 3] - y
        bx, by = cos * dx + sin * dy, cos * dy - sin * dx
        first, second = _rough_angle(ay, ax), _rough_angle(by, bx)
        low, high = min(first, second), max(first, second)
        wx, wy = bx - ax, by - ay
        area = ax * by - ay * bx
        close = area * area < CLOSE * CLOSE * (wx * wx + wy * wy)
        px, py = (0.0, 0.0) if close else (wy / area, -wx / area)
        if abs(high - low - math.pi) < STRAIGHT:
            low, high = -math.pi, math.pi
        elif high - low > math.pi:
            low, high = high, low + math.tau
        for turn in (-math.tau, 0.0, math.tau):
            start = (low + turn - angle_min) / increment - widening
            stop = (high + turn - angle_min) / increment + widening
            if stop < 0.0 or start > count - 1.0:
                continue
            begin, end = int(max(start, 0.0)), int(min(stop, count - 1.0)) + 1
            if close:
                for beam in range(begin, end):
                    ux, uy = beam_x[beam], beam_y[beam]
                    side_a, side_b = ux * ay - uy * ax, ux * by - uy * bx
                    if min(side_a, side_b) <= 0.0 <= max(side_a, side_b):
                        distance = _along_beam((ux, uy), (ax, ay), (bx, by))
                        nearest_close[beam] = min(nearest_close[beam], distance)
            else:
                for beam in range(begin, end):
                    ux, uy = beam_x[beam], beam_y[beam]
                    side_a, side_b = ux * ay - uy * ax, ux * by - uy * bx
                    inverse = ux * px + uy * py
                    crossed = ((side_a <= 0.0) & (side_b >= 0.0)) | ((side_a >= 0.0) & (side_b <= 0.0))
                    best = nearness[beam]
                    nearness[beam] = inverse if crossed & (inverse > best) else best
    ranges = np.empty(count)
    for beam in range(count):
        distance = min(1.0 / nearness[beam], nearest_close[beam])
        ranges[beam] = distance if distance <= reach else np.inf
    return ranges
