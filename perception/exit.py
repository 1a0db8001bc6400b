"""Whether the robot has left the maze: nothing ahead, and the posts of the exit behind its rear."""

from __future__ import annotations

import math

import numpy as np

from perception.settings import ExitSettings
from perception.sweep import Floats, Sweep
from transport.description import Point


def is_outside(
    sweep: Sweep, aligned: Floats, misalignment: float, footprint: tuple[Point, ...], settings: ExitSettings
) -> bool:
    """Whether one scan shows the robot outside a wall that it has just passed.

    Ahead there is nothing as far as the exit's ``range``; beside the robot nothing reaches to its rearmost corner or
    farther forward; and, for a sensor that can look back, there is something behind. One reading in a hundred may be
    bad.

    Args:
        sweep: the scan.
        aligned: its hits, in the robot's place but turned along the walls, m, shape (n, 2).
        misalignment: direction of the walls seen from the robot, rad.
        footprint: the robot's outline in its own frame, m.
        settings: sizes and ranges.
    """
    ahead = sweep.fan.sector(quantised(misalignment), 2 * settings.half_angle)
    if not len(ahead):
        return False
    tolerated = len(ahead) // 100
    readings = sweep.ranges[ahead]
    if np.count_nonzero(~(readings > min(settings.range, sweep.reach))) > tolerated:
        return False
    rear = _rear(footprint, misalignment) - settings.margin
    x, y = aligned[:, 0], aligned[:, 1]
    beside = np.abs(y) <= settings.beside
    if np.count_nonzero(beside & (x >= rear)) > tolerated:
        return False
    looks_back = len(sweep.fan.sector(math.pi, math.pi - math.radians(20))) > 0
    return not looks_back or bool(np.any((x < rear) & (np.hypot(x, y) <= 2 * settings.beside)))


def quantised(angle: float) -> float:
    """To the nearest degree, so that the sector's beams are looked up, not sought anew for every scan."""
    return math.radians(round(math.degrees(angle)))


def _rear(footprint: tuple[Point, ...], misalignment: float) -> float:
    """How far the outline reaches back along the walls, m (negative)."""
    cosine, sine = math.cos(misalignment), math.sin(misalignment)
    return min(x * cosine + y * sine for x, y in footprint)
