"""What the robot comes upon in a corridor: one value that holds all that is known of a junction.

A way is open where the robot's box fits into it, seen to be free: a rectangle a little wider than the robot that
reaches some depth beyond the wall in which the gap is. Every beam that ends beyond a line parallel to the wall crosses
that line at a known place; neighbouring beams that do so show a free stretch of it, and since what a sensor sees is
star-shaped, the rectangle before a stretch wide enough is free where no hit lies in it. What is hidden behind a near
corner is neither open nor closed but unknown. A recess less deep than the box, as between two walls that are offset, is
no way, nor is one that is shallow and wider than any way: there the corridor only widens.

The robot's surroundings are taken in the frame that is turned along the walls: x along the corridor, y to the left.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from perception.lines import Lines
from perception.settings import JunctionSettings
from perception.sweep import Sweep
from perception.ways import CLOSED, UNSEEN, Fitting, Surroundings, Way
from transport.description import RobotDescription


class JunctionKind(StrEnum):
    """What a junction is, by the ways that lead on from it."""

    UNKNOWN = "unknown"
    CORRIDOR = "corridor"
    DEAD_END = "dead_end"
    CORNER_LEFT = "corner_left"
    CORNER_RIGHT = "corner_right"
    T = "t"
    T_LEFT = "t_left"
    T_RIGHT = "t_right"
    CROSSING = "crossing"
    OPEN_SPACE = "open_space"


_KINDS = {
    (False, False, False): JunctionKind.DEAD_END,
    (False, True, False): JunctionKind.CORRIDOR,
    (True, False, False): JunctionKind.CORNER_LEFT,
    (False, False, True): JunctionKind.CORNER_RIGHT,
    (True, False, True): JunctionKind.T,
    (True, True, False): JunctionKind.T_LEFT,
    (False, True, True): JunctionKind.T_RIGHT,
    (True, True, True): JunctionKind.CROSSING,
}


@dataclass(frozen=True, slots=True)
class Junction:
    """All that is known of the junction that the robot is in or about to enter.

    Attributes:
        left: the way to the left.
        ahead: the way ahead, beyond the ways to the sides.
        right: the way to the right.
        left_wall: d1L, distance to the corridor's left wall before the junction, m; NaN where it is not seen.
        right_wall: d1R, distance to its right wall, m; NaN where it is not seen.
        end: d4, how far a lane of the robot's width is free straight ahead, m; infinity where nothing is in it.
        wide: whether a way is wider than any corridor.
        door_depth: a way that ends within this depth may be a door, m.
    """

    left: Way = UNSEEN
    ahead: Way = UNSEEN
    right: Way = UNSEEN
    left_wall: float = math.nan
    right_wall: float = math.nan
    end: float = math.inf
    wide: bool = False
    door_depth: float = 0.0

    @property
    def kind(self) -> JunctionKind:
        """What it is; unknown where one of the three ways is."""
        if self.wide:
            return JunctionKind.OPEN_SPACE
        if not (self.left.known and self.ahead.known and self.right.known):
            return JunctionKind.UNKNOWN
        return _KINDS[self.left.open, self.ahead.open, self.right.open]

    @property
    def door_left(self) -> bool:
        """Whether the way to the left may be a door: it ends soon."""
        return self._may_be_door(self.left)

    @property
    def door_ahead(self) -> bool:
        """Whether the way ahead may be a door: a dead end."""
        return self.kind is JunctionKind.DEAD_END or self._may_be_door(self.ahead)

    @property
    def door_right(self) -> bool:
        """Whether the way to the right may be a door: it ends soon."""
        return self._may_be_door(self.right)

    def _may_be_door(self, way: Way) -> bool:
        return way.open and way.ended and way.depth <= self.door_depth

    @property
    def d2(self) -> float:
        """How far ahead the first way to a side begins, m; NaN without one."""
        return min((way.near for way in (self.left, self.right) if way.open), default=math.nan)

    @property
    def d3(self) -> float:
        """From the beginning of the first way to a side to the end of the last, m; NaN without one."""
        ends = [way.far for way in (self.left, self.right) if way.open]
        return max(ends) - self.d2 if ends else math.nan

    @property
    def dx(self) -> float:
        """How far ahead the middle of the ways to the sides is, m; NaN without one."""
        return self.d2 + self.d3 / 2

    @property
    def dy(self) -> float:
        """How far to the left the middle of the corridor is, m; NaN where not both walls are seen."""
        return (self.left_wall - self.right_wall) / 2


def junction_of(
    sweep: Sweep, lines: Lines, misalignment: float, robot: RobotDescription, settings: JunctionSettings
) -> Junction:
    """The junction that the robot is in or about to enter.

    Args:
        sweep: the scan.
        lines: the walls, in the robot's frame.
        misalignment: direction of the walls seen from the robot, rad.
        robot: for the size of the box that must fit.
        settings: window, depth and margins.
    """
    if 2 * np.count_nonzero(sweep.known) < max(len(sweep.ranges), 1):
        return Junction()
    half_width = robot.half_width
    box = 2 * (half_width + settings.clearance)
    surroundings = Surroundings.of(sweep, lines, misalignment)
    to_left, to_right, forward = surroundings.left(), surroundings.right(), surroundings.ahead()
    left, right = _of_one_junction(Fitting(to_left, box, settings).side(), Fitting(to_right, box, settings).side())
    edges = [way.far for way in (left, right) if way.open]
    ahead = Fitting(forward, box, settings).ahead(max(edges, default=settings.ahead), after_sides=bool(edges))
    return Junction(
        left=left,
        ahead=ahead,
        right=right,
        left_wall=to_left.wall(settings),
        right_wall=to_right.wall(settings),
        end=forward.lane(half_width),
        wide=any(way.open and way.width > settings.max_width for way in (left, right))
        or forward.is_empty(settings.open_half_angle, settings.open_range),
        door_depth=settings.door_depth,
    )


def _of_one_junction(left: Way, right: Way) -> tuple[Way, Way]:
    """Only ways that overlap along the corridor belong to one junction; of two that don't, the nearer one counts."""
    if not (left.open and right.open) or min(left.far, right.far) > max(left.near, right.near):
        return left, right
    return (left, CLOSED) if left.near < right.near else (CLOSED, right)
