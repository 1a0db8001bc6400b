"""Whether the robot has left the maze: its lane's walls have ended behind it, and nothing is ahead in that lane.

The lane is the strip between what is beside the robot, along the walls. As long as it has walls, their end is
measured; once nothing is seen in it any more, the end moves back as the robot moves on. The robot is outside when its
rearmost corner has passed the end and the lane is empty as far as the sensor sees. Other parts of the maze may be
beside the lane; a scan that failed does not end the walls. A hall deeper than the sensor's range, entered by a gate,
looks the same as the outside. So a sensor whose range is shorter than the largest open space must first have been
carried on by the rest of that length, with nothing in the lane all the way.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from perception.extremes import highest
from perception.settings import ExitSettings
from perception.sweep import Floats, Mask, ScanPoints
from transport.compiled import compiled
from transport.description import Point

STRAY = 2
"""The number of hits in the lane that may be bad readings."""


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

    @property
    def known(self) -> bool:
        """Whether walls were seen on both sides."""
        return not math.isnan(self.left)


NO_LANE = Lane()


@dataclass(frozen=True, slots=True)
class RobotInLane:
    """The robot in its lane.

    Attributes:
        rear: how far its outline reaches back along the lane, m (negative).
        half_width: how far it reaches to the sides, m, to the side where that is less; not negative.
        moved: how far it has moved along the lane since the scan before, m.
    """

    rear: float
    half_width: float
    moved: float


def next_lane(before: Lane, sweep: ScanPoints, direction: Point, body: RobotInLane, settings: ExitSettings) -> Lane:
    """The lane in the next scan.

    Args:
        before: the lane in the scan before, ``NO_LANE`` after a turn.
        sweep: the scan.
        direction: cosine and sine of the walls' direction seen from the robot.
        body: the robot's extent and movement along the lane.
        settings: sizes and ranges.
    """
    moved_on = Lane(before.left, before.right, before.end - body.moved)
    if sweep.known_share < settings.known_share or not len(sweep.ranges):
        return moved_on
    bounds = body.rear - settings.margin, settings.range
    sizes = body.half_width, settings.beside, settings.max_half_width, settings.widening
    beside, standing, last = lane_in_sight(sweep.points, direction, bounds, sizes, (before.left, before.right))
    found = Lane(*beside) if beside else None
    if not before.known:
        return found or NO_LANE
    if standing > STRAY:
        if not found or last > settings.beside:
            return found or replace(moved_on, end=last)
        # The walls end beside the robot: what is farther to the sides is not a wall of this lane.
        narrowed = Lane(min(found.left, before.left), min(found.right, before.right))
        low, high = -narrowed.right - settings.widening, narrowed.left + settings.widening
        return replace(narrowed, end=in_lane(along_lane(sweep.points, direction, bounds), low, high, moved_on.end)[1])
    if found and found.end > settings.beside:
        return found
    passed = moved_on.end < body.rear - settings.margin
    return replace(moved_on, empty=True, outside=passed and sweep.reach - moved_on.end >= settings.range)


@compiled
def lane_in_sight(
    points: Floats,
    direction: tuple[float, float],
    bounds: tuple[float, float],
    sizes: tuple[float, float, float, float],
    before: tuple[float, float],
) -> tuple[tuple[float, float, float] | None, int, float]:
    """What the hits say of a lane: `lane_beside`, and `in_lane` of the lane before, which is taken a little wider.

    Args:
        points: in the robot's frame, m, shape (n, 2).
        direction: cosine and sine of the walls' direction seen from the robot.
        bounds: the lowest and the highest place along the lane, m.
        sizes: what `lane_beside` is given after the hits, m.
        before: how far the lane before reaches to the left and to the right, m; NaN where there was none.
    """
    hits = along_lane(points, direction, bounds)
    (*_, widening), (left, right) = sizes, before
    return lane_beside(hits, *sizes), *in_lane(hits, -right - widening, left + widening, math.inf)


@compiled
def along_lane(points: Floats, direction: tuple[float, float], bounds: tuple[float, float]) -> Floats:
    """The hits in the frame turned along the walls, those between two bounds along it, m, shape (2, k).

    Args:
        points: in the robot's frame, m, shape (n, 2).
        direction: cosine and sine of the walls' direction seen from the robot.
        bounds: the lowest and the highest x, m.
    """
    (cosine, sine), (low, high) = direction, bounds
    x = points[:, 0] * cosine + points[:, 1] * sine
    y = points[:, 1] * cosine - points[:, 0] * sine
    in_reach = ((x >= low) & (x <= high)).nonzero()[0]
    return np.stack((x[in_reach], y[in_reach]))


@compiled
def lane_beside(
    hits: Floats, half_width: float, beside: float, max_half_width: float, widening: float
) -> tuple[float, float, float] | None:
    """The lane between the walls on both sides of the robot; None if one is missing, or a wall is just ahead.

    Args:
        hits: along the lane, m, shape (2, k).
        half_width: of the robot, m.
        beside: how far ahead and behind a wall is beside the robot, m.
        max_half_width: the largest distance of a wall of the lane, m.
        widening: the end is that of a lane this much wider on each side, m.

    Returns:
        How far it reaches to the left, to the right and ahead, m.
    """
    x, y = hits
    close = (np.abs(x) <= beside).nonzero()[0]
    close_y = y[close]
    if np.count_nonzero((x[close] > 0.0) & (np.abs(close_y) < half_width)) > STRAY:
        return None
    close_y.sort()
    left = _lowest_from(close_y, half_width)
    right = _lowest_from(-close_y[::-1], half_width)
    if max(left, right) > max_half_width:
        return None
    return left, right, _last(x[_within(y, -right - widening, left + widening)], math.inf)


@compiled
def in_lane(hits: Floats, low: float, high: float, otherwise: float) -> tuple[int, float]:
    """How many hits are in a lane, and where the last of them is, stray readings left out.

    Args:
        hits: along the lane, m, shape (2, k).
        low: the lane's right bound, m.
        high: its left bound, m.
        otherwise: where the last one is if there are only stray readings, m.
    """
    x, y = hits
    inside = x[_within(y, low, high)]
    return len(inside), _last(inside, otherwise)


def _lowest_from(values: Floats, bound: float) -> float:
    """The lowest of sorted values from a bound on without stray readings; infinity where there are only such."""
    index = int(values.searchsorted(bound)) + STRAY
    return values.item(index) if index < len(values) else math.inf


def _within(y: Floats, low: float, high: float) -> Mask:
    """Which hits are between two bounds across the lane."""
    inside: Mask = (y < high) & (y > low)
    return inside


def _last(ahead: Floats, otherwise: float) -> float:
    """The farthest place except for stray readings; ``otherwise`` where there are no more than such."""
    return highest(ahead, otherwise, passed_over=STRAY)


@compiled
def extent_along(footprint: tuple[Point, ...], direction: Point) -> tuple[float, float]:
    """How far an outline reaches back along a lane, m, and to the sides: see `RobotInLane`.

    Args:
        footprint: its corners in the robot's frame, m.
        direction: cosine and sine of the walls' direction seen from the robot.
    """
    cosine, sine = direction
    rear = min([x * cosine + y * sine for x, y in footprint])
    across = [y * cosine - x * sine for x, y in footprint]
    return rear, max(min(max(across), -min(across)), 0.0)


def quantised(angle: float) -> float:
    """To the nearest degree, so that a sector's beams are cached, not searched again for every scan."""
    return math.radians(round(math.degrees(angle)))
