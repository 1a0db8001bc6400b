"""Driving to the corner that the robot has turned about."""

from __future__ import annotations

from hsm.model.types import Length, Speed
from perception.facts import Facts
from skills.activities.advance import Advance
from skills.library import LIBRARY
from skills.passage import points_along
from skills.sides import Side
from skills.surroundings import Points

JUST_PASSED = 0.1
"""The corner is reached when it is beside the robot's origin, or this much behind, m: two ticks at full speed."""
BESIDE = 0.1
"""What is nearer to the robot's line than this is not beside it, m."""
ASIDE = 0.7
"""What is farther from the robot's line than this is not the corner about which it has turned, m."""


@LIBRARY.activity("reach_corner", outcomes=("done", "blocked"), holds=("base",))
class ReachCorner(Advance):
    """Drive straight on until a wall or its end stands beside the robot.

    After a turn into an opening the corner is still ahead; to look for space at that side before it is reached would
    find the way that the robot came from. Outcomes: `done` when it is reached, or not found within the distance;
    `blocked` when the robot gets no farther.
    """

    def __init__(self, side: Side = Side.RIGHT, speed: Speed = 0.5, distance: Length = 1.2) -> None:
        super().__init__(distance, speed)
        self._side = side

    def _arrived(self, facts: Facts) -> bool:
        return _stands_beside(points_along(facts, facts.misalignment), self._side, ASIDE)


@LIBRARY.activity("leave_junction", outcomes=("done", "blocked"), holds=("base",))
class LeaveJunction(Advance):
    """Drive straight on until a wall or its end stands at both sides of the robot.

    Outcomes: `done` when the robot is in the way beyond the junction, or has driven the distance, as in open space;
    `blocked` when the robot gets no farther.
    """

    def __init__(self, speed: Speed = 0.5, distance: Length = 1.2) -> None:
        super().__init__(distance, speed)

    def _arrived(self, facts: Facts) -> bool:
        points, farthest = points_along(facts, facts.misalignment), facts.settings.space.side
        return all(_stands_beside(points, side, farthest) for side in Side)


def _stands_beside(points: Points, side: Side, farthest: float) -> bool:
    """Whether something no farther than that stands beside the robot, by points in a frame along its course."""
    x, y = points[:, 0], points[:, 1] * side.sign
    near = (x > -JUST_PASSED) & (x <= 0) & (y > BESIDE) & (y < farthest)
    return bool(near.sum() >= 2)
