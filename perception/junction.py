"""Junctions in a corridor: one value with everything known about a junction.

A way is open where the robot's box fits into it, seen to be free: a rectangle a little wider than the robot that
reaches some depth beyond the wall in which the gap is. Every beam that ends beyond a line parallel to the wall
crosses that line at a known place, and neighbouring beams that do so show a free stretch of it. What a sensor sees is
star-shaped: the rectangle before a stretch that is wide enough is free where no hit lies in it. What is hidden behind
a near corner is neither open nor closed but unknown. A recess less deep than the box, as between two walls that are
offset, is no way, nor is one that is shallow and wider than any way: there the corridor only widens.

The robot's surroundings are taken in the frame that is turned along the walls: x along the corridor, y to the left.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property

from perception.lines import Lines
from perception.settings import JunctionSettings
from perception.sweep import ScanPoints
from perception.ways import CLOSED, NOTHING_SEEN, BeamEnds, Fitting, View, Way
from transport.description import RobotDescription


class JunctionKind(StrEnum):
    """The kind of a junction, by the ways that continue from it."""

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


@dataclass(frozen=True, eq=False)
class Junction:
    """Everything known about the junction that the robot is in or about to enter, computed on demand.

    Attributes:
        surroundings: where the beams end, and the walls.
        half_width: of the robot, m.
        settings: window, depth and margins.
    """

    surroundings: BeamEnds
    half_width: float
    settings: JunctionSettings

    @cached_property
    def _beside(self) -> tuple[View, View]:
        """The views to the left and to the right."""
        return self.surroundings.left(), self.surroundings.right()

    @cached_property
    def _forward(self) -> View:
        """The view ahead."""
        return self.surroundings.ahead()

    @cached_property
    def _sides(self) -> tuple[Way, Way]:
        """The ways to the left and to the right."""
        to_left, to_right = self._beside
        return _of_one_junction(self._fitting(to_left).side(), self._fitting(to_right).side())

    def _fitting(self, view: View) -> Fitting:
        return Fitting(view, 2 * (self.half_width + self.settings.clearance), self.settings)

    @property
    def left(self) -> Way:
        """The way to the left."""
        return self._sides[0]

    @property
    def right(self) -> Way:
        """The way to the right."""
        return self._sides[1]

    @cached_property
    def ahead(self) -> Way:
        """The way ahead, beyond the ways to the sides."""
        edges = [way.far for way in self._sides if way.open]
        edge = max(edges, default=self.settings.ahead)
        return self._fitting(self._forward).ahead(edge, after_sides=bool(edges))

    @property
    def left_wall(self) -> float:
        """d1L, distance to the corridor's left wall before the junction, m; NaN where it is not seen."""
        return self._beside[0].wall(self.settings)

    @property
    def right_wall(self) -> float:
        """d1R, distance to its right wall, m; NaN where it is not seen."""
        return self._beside[1].wall(self.settings)

    @cached_property
    def end(self) -> float:
        """d4, how far a lane of the robot's width is free straight ahead, m; infinity where nothing is in it."""
        return self._forward.lane(self.half_width)

    @cached_property
    def wide(self) -> bool:
        """Whether a way is wider than any corridor, or nothing is seen far around ahead."""
        settings = self.settings
        too_wide = any(way.open and way.width > settings.max_width for way in self._sides)
        return too_wide or self._forward.is_empty(settings.open_half_angle, settings.open_range)

    @property
    def kind(self) -> JunctionKind:
        """Its kind; unknown if one of the three ways is unknown."""
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
        return way.open and way.ended and way.depth <= self.settings.door_depth

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
    sweep: ScanPoints, lines: Lines, misalignment: float, robot: RobotDescription, settings: JunctionSettings
) -> Junction:
    """The junction that the robot is in or about to enter.

    Args:
        sweep: the scan.
        lines: the walls, in the robot's frame.
        misalignment: direction of the walls seen from the robot, rad.
        robot: for the size of the box that must fit.
        settings: window, depth and margins.
    """
    surroundings = BeamEnds.of(sweep, lines, misalignment) if sweep.known_share >= 0.5 else NOTHING_SEEN
    return Junction(surroundings, robot.half_width, settings)


def _of_one_junction(left: Way, right: Way) -> tuple[Way, Way]:
    """Only ways that overlap along the corridor belong to one junction; of two that don't, the nearer one counts."""
    if not (left.open and right.open) or min(left.far, right.far) > max(left.near, right.near):
        return left, right
    return (left, CLOSED) if left.near < right.near else (CLOSED, right)
