"""Door areas: dead ends that may be doors by the rules, and whether the robot may ring there.

The five checks of 2017, made on the corners of fitted walls instead of on single hits: the lengths of the dead end and
of its side walls; both side walls on the robot's side of the dead end; the three walls joined by two corners; right
angles at both corners; and the robot within the door area.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from perception.extremes import lowest
from perception.lines import Line, Lines
from perception.settings import DoorSettings
from perception.sweep import Floats, ScanPoints
from transport.arithmetic import atan2, cos, cos_sin, distance_between, norm, sin
from transport.description import Point, RobotDescription

RIGHT = math.pi / 2
CORNER_BEAMS = 8
"""The lines of two walls leave out at most this many beams at their corner."""


@dataclass(frozen=True, slots=True)
class Door:
    """A dead end that may be a door.

    Attributes:
        right: its end at the right hand of someone who faces it, m in the robot's frame.
        left: its other end.
        reach: distance from the door to the farthest point of the robot's outline, m.
    """

    right: Point
    left: Point
    reach: float

    @property
    def centre(self) -> Point:
        """The middle of the door, m in the robot's frame."""
        return ((self.right[0] + self.left[0]) / 2, (self.right[1] + self.left[1]) / 2)

    @property
    def width(self) -> float:
        """Length of the dead-end wall, m."""
        return norm(self.left[0] - self.right[0], self.left[1] - self.right[1])

    @property
    def bearing(self) -> float:
        """Direction of its middle, rad."""
        return atan2(self.centre[1], self.centre[0])

    @property
    def facing(self) -> float:
        """The turn that makes the robot face it squarely, rad."""
        return atan2(self.right[0] - self.left[0], self.left[1] - self.right[1])

    @property
    def distance(self) -> float:
        """Distance from the robot's origin to the line of the door, m."""
        return self.centre[0] * cos(self.facing) + self.centre[1] * sin(self.facing)


def find_doors(lines: Lines, robot: RobotDescription, settings: DoorSettings) -> tuple[Door, ...]:
    """All dead ends in sight that may be doors by their sizes, the nearest first."""
    shortest = settings.min_side - settings.margin
    walls = [line for line in lines if line.length >= shortest]
    between = abs(robot.laser.angle_increment)
    turns = [_turns_left(one, other, between, settings) for one, other in pairwise(walls)]
    dead_ends = (index for index, (one, other) in enumerate(pairwise(turns)) if one and other)
    found = (_door(walls[index : index + 3], robot, settings) for index in dead_ends)
    return tuple(sorted((door for door in found if door), key=lambda door: door.distance))


def _turns_left(first: Line, second: Line, between: float, settings: DoorSettings) -> bool:
    """Whether two successive walls, counter-clockwise, are joined by a right angle to the left.

    Both corners of a dead end are so; an S-bend turns left and right. The wider the angle ``between`` two beams is, in
    rad, the wider is the gap that their lines leave at the corner.
    """
    gap = max(settings.corner_gap, CORNER_BEAMS * between * norm(*first.end))
    return (
        distance_between(first.end, second.start) <= gap
        and abs(math.remainder(second.direction - first.direction - RIGHT, math.tau)) <= settings.square
    )


def _door(walls: Sequence[Line], robot: RobotDescription, settings: DoorSettings) -> Door | None:
    """The dead end between two side walls, if its size is a door's."""
    before, end, after = walls
    right, left = _corner(before, end), _corner(end, after)
    width = norm(left[0] - right[0], left[1] - right[1])
    if not settings.min_width - settings.margin <= width <= settings.max_width + settings.margin:
        return None
    return Door(right, left, _reach(right, left, robot.footprint))


def _corner(first: Line, second: Line) -> Point:
    """Where the lines of two walls that are not parallel cross."""
    cosine, sine = cos_sin(first.alpha)
    other_cosine, other_sine = cos_sin(second.alpha)
    determinant = cosine * other_sine - sine * other_cosine
    return (
        (first.p * other_sine - second.p * sine) / determinant,
        (second.p * cosine - first.p * other_cosine) / determinant,
    )


def _reach(right: Point, left: Point, footprint: tuple[Point, ...]) -> float:
    """Distance from the door to the corner of the outline that is farthest from it."""
    return max(_distance(corner, right, left) for corner in footprint)


def _distance(point: Point, start: Point, end: Point) -> float:
    dx, dy = end[0] - start[0], end[1] - start[1]
    along = ((point[0] - start[0]) * dx + (point[1] - start[1]) * dy) / (dx * dx + dy * dy)
    share = min(max(along, 0.0), 1.0)
    return norm(point[0] - start[0] - share * dx, point[1] - start[1] - share * dy)


def is_near(door: Door, settings: DoorSettings) -> bool:
    """Whether a door is ahead and the whole robot within the area from which it may be rung."""
    return (
        abs(door.facing) <= settings.ahead
        and door.reach <= min(settings.range, settings.rule_range) - settings.range_margin
    )


def open_share(sweep: ScanPoints, right: Point, left: Point, settings: DoorSettings) -> float:
    """Share of the beams towards a door's place that go through it, 0 to 1; 0 where none is known.

    Args:
        sweep: the scan.
        right: right end of the door's place in the robot's frame, m.
        left: its left end.
        settings: which part of the door to look at, and how far beyond it a beam must go.
    """
    mount = sweep.fan.mount
    facing = atan2(right[0] - left[0], left[1] - right[1])
    cosine, sine = cos_sin(facing)
    distance = (right[0] - mount.x) * cosine + (right[1] - mount.y) * sine
    if distance <= 0:
        return 0.0
    forward = sweep.fan.cosines * cosine + sweep.fan.sines * sine
    leftward = sweep.fan.sines * cosine - sweep.fan.cosines * sine
    crossing = distance * leftward
    low = -(right[0] - mount.x) * sine + (right[1] - mount.y) * cosine
    high = -(left[0] - mount.x) * sine + (left[1] - mount.y) * cosine
    trim = (1 - settings.inner_share) / 2 * (high - low)
    low, high = low + trim, high - trim
    towards = (forward > 0.1) & (crossing >= low * forward) & (crossing <= high * forward) & sweep.known
    count = int(towards.sum())
    if not count:
        return 0.0
    return float((sweep.ranges[towards] * forward[towards] >= distance + settings.seen_depth).sum()) / count


def passage_of(aligned: Floats, half_width: float, behind: float = 0.0) -> float:
    """How far a lane straight ahead is free, m from the robot's origin; infinity if it is empty.

    Args:
        aligned: hits in the robot's place, turned so that the lane runs along x, m, shape (n, 2).
        half_width: half of the lane's width, m.
        behind: where the lane begins, m along x.
    """
    in_lane = (np.abs(aligned[:, 1]) <= half_width) & (aligned[:, 0] > behind)
    return lowest(aligned[in_lane, 0])
