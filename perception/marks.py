"""Marks at junctions: which ways have been taken, and how often, as in Tremaux's algorithm."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import StrEnum

from perception.places import NotedPlace, Places
from transport.description import Point
from transport.messages import Pose


class Direction(StrEnum):
    """A way on from a junction, as the robot sees it."""

    AHEAD = "ahead"
    LEFT = "left"
    BACK = "back"
    RIGHT = "right"


_QUARTERS = {Direction.AHEAD: 0, Direction.LEFT: 1, Direction.BACK: 2, Direction.RIGHT: 3}


@dataclass(slots=True)
class Marks:
    """The marked junctions of a run, and the one where the robot is.

    Attributes:
        tolerance: two places nearer to each other than this are the same one, m.
        known: the junctions of an earlier run from the same start that led out; their marks are not changed.
        places: the junctions in the order in which they were found.
        here: the junction that the robot has come to last, or None.
        new: whether it had never been there before.
        heading: the quarter in which the robot came there: 0 along +x, 1 along +y, and so on.
        recognised: the known junction that it is, if it is one and new in this run.
    """

    tolerance: float
    known: Places = field(default_factory=Places)
    places: Places = field(default_factory=Places)
    here: NotedPlace | None = None
    new: bool = False
    heading: int = 0
    recognised: NotedPlace | None = None
    _shift: Point = (0.0, 0.0)

    def arrive(self, pose: Pose) -> None:
        """The robot has come to a junction: find it again or note it, and mark the way by which the robot came.

        A junction found again is moved to where it is seen now: so that the drift of dead reckoning does not
        accumulate.
        """
        near = self.places.nearest(pose, self.tolerance)
        self.new = near is None
        if near is None:
            near = self.places.note(pose)
        else:
            self.places.move(near, pose)
        self.here = near
        self.heading = round(pose.heading / (math.pi / 2)) % 4
        self.mark(Direction.BACK)
        self.recognised = self._recognised(pose) if self.new else None

    def _recognised(self, pose: Pose) -> NotedPlace | None:
        """The known junction at a pose; how far the two lie apart is allowed for at the next one."""
        near = self.known.nearest(Pose(pose.x + self._shift[0], pose.y + self._shift[1]), self.tolerance)
        if near is not None:
            there = self.known.pose_of(near)
            self._shift = (there.x - pose.x, there.y - pose.y)
        return near

    def leads_out(self, direction: Direction) -> bool:
        """Whether an earlier run has shown that this way of the junction, new in this run, leads out.

        Tremaux's rules leave one mark at the ways from the start to where the run ended, and two or none at all others.
        So it is the only way with one mark beside the one by which the robot came; where there is none and the robot
        came by a way with two, everything ahead has been seen, and the way is back.
        """
        if self.recognised is None:
            return False
        came = self._quarter(Direction.BACK)
        onward = [quarter for quarter in range(4) if quarter != came and self.recognised.marks[quarter] == 1]
        if direction is Direction.BACK:
            return not onward and self.recognised.marks[came] > 1
        return onward == [self._quarter(direction)]

    def mark(self, direction: Direction) -> None:
        """Mark a way of the junction where the robot is, as seen when it arrived; nothing if there is none."""
        if self.here is not None:
            self.here.marks[self._quarter(direction)] += 1

    def count(self, direction: Direction) -> int:
        """How many marks a way of the junction has where the robot is, as seen when it arrived."""
        return self.here.marks[self._quarter(direction)] if self.here is not None else 0

    def _quarter(self, direction: Direction) -> int:
        return (self.heading + _QUARTERS[direction]) % 4
