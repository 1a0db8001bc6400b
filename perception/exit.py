"""Whether the robot has left the maze: its lane's walls have ended behind it, and nothing is ahead in that lane.

The lane is the strip between what stands beside the robot, along the walls. As long as it has walls, their end is
measured; once nothing is seen in it any more, the end moves back as the robot moves on. The robot is outside when its
rearmost corner has passed the end and the lane is empty as far as the sensor sees. Other parts of the maze may stand
beside the lane; a scan that failed does not end the walls. A hall deeper than the sensor's range, entered by a gate,
looks the same as the outside and cannot be told from it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from perception.settings import ExitSettings
from perception.sweep import Floats, Mask, Sweep
from transport.description import Point

STRAY = 2
"""So many hits in the lane may be bad readings."""


@dataclass(frozen=True, slots=True)
class Lane:
    """The strip that the robot is in, in the frame turned along the walls, from the robot's origin.

    Attributes:
        left: how far it reaches to the left, m; NaN before walls were seen on both sides.
        right: how far it reaches to the right, m.
        end: how far ahead its walls end, m, negative behind; infinity where that is not known.
        empty: whether this scan shows nothing in it from the robot's rear on.
        outside: whether this scan shows the robot past the end of the walls.
    """

    left: float = math.nan
    right: float = math.nan
    end: float = math.inf
    empty: bool = False
    outside: bool = False


NO_LANE = Lane()


def next_lane(
    before: Lane, sweep: Sweep, misalignment: float, travel: tuple[float, float], settings: ExitSettings
) -> Lane:
    """The lane in the next scan.

    Args:
        before: the lane in the scan before.
        sweep: the scan.
        misalignment: direction of the walls seen from the robot, rad.
        travel: how far the robot has moved along the lane since, m, and where its rearmost corner is along it, m.
        settings: sizes and ranges.
    """
    moved, rear = travel
    end = before.end - moved
    if np.count_nonzero(sweep.known) < settings.known_share * len(sweep.ranges) or not len(sweep.ranges):
        return Lane(before.left, before.right, end)
    cosine, sine = math.cos(misalignment), math.sin(misalignment)
    points = sweep.points
    x = points[:, 0] * cosine + points[:, 1] * sine
    y = points[:, 1] * cosine - points[:, 0] * sine
    in_reach = (x >= rear - settings.margin) & (x <= settings.range)
    stands = x[_within(y, before, settings) & in_reach]
    if len(stands) <= STRAY and not math.isnan(before.left):
        return Lane(before.left, before.right, end, empty=True, outside=end < rear - settings.margin)
    beside = y[np.abs(x) <= settings.beside]
    left, right = _nearest(beside[beside > 0.0]), _nearest(-beside[beside < 0.0])
    if _last(stands, math.inf) <= settings.beside:
        # The walls end beside the robot: what stands farther to the sides is no wall of this lane.
        left, right = min(left, before.left), min(right, before.right)
    lane = Lane(left, right) if max(left, right) <= settings.max_half_width else before
    return Lane(lane.left, lane.right, _last(x[_within(y, lane, settings) & in_reach], end))


def _last(ahead: Floats, otherwise: float) -> float:
    """The farthest place but for stray readings; ``otherwise`` where there are no more than such."""
    return float(np.partition(ahead, -1 - STRAY)[-1 - STRAY]) if len(ahead) > STRAY else otherwise


def _within(y: Floats, lane: Lane, settings: ExitSettings) -> Mask:
    """Which hits are in a lane, by their place across it."""
    inside: Mask = (y < lane.left + settings.widening) & (y > -lane.right - settings.widening)
    return inside


def _nearest(distances: Floats) -> float:
    """The shortest distance but for stray readings; infinity where there are no more than such."""
    return float(np.partition(distances, STRAY)[STRAY]) if len(distances) > STRAY else math.inf


def rear_of(footprint: tuple[Point, ...], misalignment: float) -> float:
    """How far the outline reaches back along the walls, m (negative).

    Args:
        footprint: the robot's outline in its own frame, m.
        misalignment: direction of the walls seen from the robot, rad.
    """
    cosine, sine = math.cos(misalignment), math.sin(misalignment)
    return min(x * cosine + y * sine for x, y in footprint)


def quantised(angle: float) -> float:
    """To the nearest degree, so that a sector's beams are looked up, not sought anew for every scan."""
    return math.radians(round(math.degrees(angle)))
