"""Exact laser ranges: each wall is projected onto the interval of beams that it subtends, and the nearest wall wins.

A beam hits a wall if the wall's ends lie on opposite sides of it. The side is computed from the end alone, so two walls
that share an end agree about it bit for bit, and no beam slips through where they touch. Intervals are widened by one
beam on both sides before that exact test; hence their rounding decides nothing.
"""

from __future__ import annotations

import importlib.util
import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from sim.maze import Segments
from transport.messages import Pose, ScanGeometry

Ranges = NDArray[np.float64]
Sensor = tuple[float, float, float, float]
Fan = tuple[float, float, float]
Kernel = Callable[[Segments, Sensor, Ranges, Fan], Ranges]


def project(segments: Segments, sensor: Sensor, beams: Ranges, fan: Fan) -> Ranges:
    """The distance along each beam to the nearest segment, by plain numpy.

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
    ranges = np.full(count, np.inf)
    dx, dy = segments[:, 0] - x, segments[:, 1] - y
    ax, ay = cos * dx + sin * dy, cos * dy - sin * dx
    dx, dy = segments[:, 2] - x, segments[:, 3] - y
    bx, by = cos * dx + sin * dy, cos * dy - sin * dx
    first, second = np.arctan2(ay, ax), np.arctan2(by, bx)
    low, high = np.minimum(first, second), np.maximum(first, second)
    over_the_back = high - low > math.pi
    low, high = np.where(over_the_back, high, low), np.where(over_the_back, low + math.tau, high)
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
        pax, pay, pbx, pby = ax[which], ay[which], bx[which], by[which]
        side_a, side_b = ux * pay - uy * pax, ux * pby - uy * pbx
        ahead_a, ahead_b = ux * pax + uy * pay, ux * pbx + uy * pby
        between = side_a - side_b
        along = between == 0.0
        distance = ahead_a + side_a / np.where(along, 1.0, between) * (ahead_b - ahead_a)
        ends_on = np.minimum(np.where(ahead_a >= 0.0, ahead_a, np.inf), np.where(ahead_b >= 0.0, ahead_b, np.inf))
        distance = np.where(along, ends_on, distance)
        hit = (np.minimum(side_a, side_b) <= 0.0) & (np.maximum(side_a, side_b) >= 0.0) & (distance >= 0.0)
        np.minimum.at(ranges, beam[hit], distance[hit])
    ranges[ranges > reach] = np.inf
    return ranges


def compiled() -> Kernel | None:
    """The same projection as machine code with the same bits, or None where numba is not installed."""
    if importlib.util.find_spec("numba") is None:
        return None
    from sim._lidar_numba import project as compiled_project  # noqa: PLC0415 - numba takes half a second to import

    return compiled_project


class Lidar:
    """A laser range finder without noise."""

    def __init__(self, geometry: ScanGeometry, mount: Pose | None = None, kernel: Kernel | None = None) -> None:
        """Args: the beams, the sensor's pose in the robot's frame, and the projection (the fastest one there is)."""
        self.geometry = geometry
        self.mount = mount or Pose()
        angles = geometry.angles()
        self._beams = np.stack([np.cos(angles), np.sin(angles)])
        self._fan = (geometry.angle_min, geometry.angle_increment, geometry.range_max)
        self._project = kernel or compiled() or project

    def ranges(self, segments: Segments, robot: Pose) -> Ranges:
        """Exact distances along the beams.

        Args:
            segments: what the beams can hit, shape (n, 4).
            robot: pose of the robot that carries the sensor.

        Returns:
            Metres, shape (beams,); infinity where nothing is hit within the largest range.
        """
        cos, sin = math.cos(robot.heading), math.sin(robot.heading)
        x = robot.x + cos * self.mount.x - sin * self.mount.y
        y = robot.y + sin * self.mount.x + cos * self.mount.y
        if self.mount.heading:
            heading = robot.heading + self.mount.heading
            cos, sin = math.cos(heading), math.sin(heading)
        return self._project(segments, (x, y, cos, sin), self._beams, self._fan)
