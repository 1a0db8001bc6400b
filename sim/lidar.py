"""Exact laser ranges: each wall is projected onto the interval of beams that it subtends, and the nearest wall wins.

A beam hits a wall if the wall's ends lie on opposite sides of it. The side is computed from the end alone, so two walls
that share an end agree about it bit for bit, and no beam slips through where they touch. Intervals are widened by a
beam on both sides before that exact test; hence their rounding decides nothing.

The reciprocal of the distance to a straight wall is linear in the beam's direction, so that the nearest wall is found
as the largest reciprocal without a division for every beam and wall. Walls whose line passes close to the sensor, where
that loses digits, are intersected with each beam instead.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from sim.geometry import CLOSE, STRAIGHT
from sim.maze import Segments
from transport.arithmetic import cos_sin, cosines_and_sines
from transport.compiled import compiled
from transport.messages import Pose, ScanGeometry

Ranges = NDArray[np.float64]
Vector = tuple[float, float]
Sensor = tuple[float, float, float, float]
BeamRange = tuple[float, float, float]
Kernel = Callable[[Segments, Sensor, Ranges, BeamRange], Ranges]


@compiled
def project(segments: Segments, sensor: Sensor, beams: Ranges, fan: BeamRange) -> Ranges:
    """The distance along each beam to the nearest segment.

    Args:
        segments: what the beams can hit, shape (n, 4).
        sensor: its position in metres, and cosine and sine of its heading.
        beams: cosine and sine of each beam's direction in the sensor's frame, shape (2, beams).
        fan: direction of the first beam and angle from one to the next, rad; a hit farther than the third number, m,
            counts as none.

    Returns:
        Distances in metres, shape (beams,); infinity where nothing is hit.
    """
    x, y, cos, sin = sensor
    angle_min, increment, reach = fan
    beam_x, beam_y = beams
    count = len(beam_x)
    nearness = np.zeros(count)
    nearest_close = np.full(count, np.inf)
    dx, dy = segments[:, 0] - x, segments[:, 1] - y
    ax, ay = cos * dx + sin * dy, cos * dy - sin * dx
    dx, dy = segments[:, 2] - x, segments[:, 3] - y
    bx, by = cos * dx + sin * dy, cos * dy - sin * dx
    # Their last bits may differ from processor to processor; which of these beams hit is decided by the sides below.
    first, second = np.arctan2(ay, ax), np.arctan2(by, bx)
    low, high = np.minimum(first, second), np.maximum(first, second)
    over_the_back = high - low > math.pi
    low, high = np.where(over_the_back, high, low), np.where(over_the_back, low + math.tau, high)
    straight = np.abs(high - low - math.pi) < STRAIGHT
    low, high = np.where(straight, -math.pi, low), np.where(straight, math.pi, high)
    wx, wy = bx - ax, by - ay
    area = ax * by - ay * bx
    close = area * area < CLOSE * CLOSE * (wx * wx + wy * wy)
    far_area = np.where(close, 1.0, area)
    px, py = wy / far_area, -wx / far_area
    for turn in (-math.tau, 0.0, math.tau):
        begin = np.maximum(np.floor((low + turn - angle_min) / increment), 0.0).astype(np.int64)
        end = np.minimum(np.ceil((high + turn - angle_min) / increment), count - 1.0).astype(np.int64)
        counts = np.maximum(end - begin + 1, 0)
        total = int(counts.sum())
        if total == 0:
            continue
        which = np.repeat(np.arange(len(segments)), counts)
        beam = np.arange(total) + np.repeat(begin - np.cumsum(counts) + counts, counts)
        ux, uy = beam_x[beam], beam_y[beam]
        side_a, side_b = ux * ay[which] - uy * ax[which], ux * by[which] - uy * bx[which]
        hit = (np.minimum(side_a, side_b) <= 0.0) & (np.maximum(side_a, side_b) >= 0.0)
        plain = hit & ~close[which]
        np.maximum.at(nearness, beam[plain], (ux * px[which] + uy * py[which])[plain])
        for index in np.flatnonzero(hit & close[which]).tolist():
            wall = which[index]
            distance = _along_beam((ux[index], uy[index]), (ax[wall], ay[wall]), (bx[wall], by[wall]))
            nearest_close[beam[index]] = min(nearest_close[beam[index]], distance)
    with np.errstate(divide="ignore"):
        ranges: Ranges = np.minimum(1.0 / nearness, nearest_close)
    ranges[ranges > reach] = np.inf
    return ranges


def _along_beam(u: Vector, a: Vector, b: Vector) -> float:
    """Where a beam in direction u from the origin meets the wall from a to b that is known to cross its line, m."""
    (ux, uy), (ax, ay), (bx, by) = u, a, b
    side_a, side_b = ux * ay - uy * ax, ux * by - uy * bx
    ahead_a, ahead_b = ux * ax + uy * ay, ux * bx + uy * by
    if side_a == side_b:
        return min(ahead_a if ahead_a >= 0.0 else math.inf, ahead_b if ahead_b >= 0.0 else math.inf)
    distance = ahead_a + side_a / (side_a - side_b) * (ahead_b - ahead_a)
    return distance if distance >= 0.0 else math.inf


class Lidar:
    """A laser range finder without noise."""

    def __init__(self, geometry: ScanGeometry, mount: Pose | None = None, kernel: Kernel | None = None) -> None:
        """Args: the beams, the sensor's pose in the robot's frame, and the projection (`project`)."""
        self.geometry = geometry
        self.mount = mount or Pose()
        angles = geometry.angles()
        self._beams = np.stack(cosines_and_sines(angles))
        self._fan = (geometry.angle_min, geometry.angle_increment, geometry.range_max)
        self._project = kernel or project

    def ranges(self, segments: Segments, robot: Pose) -> Ranges:
        """Exact distances along the beams.

        Args:
            segments: what the beams can hit, shape (n, 4).
            robot: pose of the robot that carries the sensor.

        Returns:
            Metres, shape (beams,); infinity where nothing is hit within the largest range.
        """
        cos, sin = cos_sin(robot.heading)
        x = robot.x + cos * self.mount.x - sin * self.mount.y
        y = robot.y + sin * self.mount.x + cos * self.mount.y
        if self.mount.heading:
            heading = robot.heading + self.mount.heading
            cos, sin = cos_sin(heading)
        return self._project(segments, (x, y, cos, sin), self._beams, self._fan)
