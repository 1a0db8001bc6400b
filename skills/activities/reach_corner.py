"""Driving to the corner that the robot has turned about."""

from __future__ import annotations

import numpy as np

from hsm.model.types import Length, Speed
from perception.facts import Facts
from skills.activities.advance import Advance
from skills.library import LIBRARY
from skills.passage import DENSE, points_along
from skills.sides import Side

JUST_PASSED = 2.0
"""The corner is reached when it is beside the robot's origin, or this many periods at full speed behind it."""
BEAMS = 4
"""Of a laser whose beams are far apart this many are to lie between a wall's end beside the robot and behind it."""


class ToCorner(Advance):
    """Drives on until something is beside the robot."""

    def _stands_beside(self, facts: Facts, side: Side, farthest: float) -> bool:
        """Whether something no farther than that is beside the robot, along the walls."""
        points = points_along(facts, facts.misalignment, self.settings.passage)
        x, y = points[:, 0], points[:, 1] * side.sign
        behind = JUST_PASSED * facts.robot.limits.speed * facts.robot.period
        spacing = facts.observation.scan.geometry.spacing
        if spacing >= DENSE:  # so far that some beams meet what is there, seen from its end
            behind += BEAMS * spacing * self.settings.opening.aside
        # Two hits, so that one of noise is not enough; of a thin wall seen from its end only the first need be so near.
        beside = np.sort(y[(x > -behind) & (x <= 0) & (y > self.settings.opening.beside)])
        return len(beside) >= 2 and bool(beside[0] < farthest)


@LIBRARY.activity("reach_corner", outcomes=("done", "blocked"), holds=("base",))
class ReachCorner(ToCorner):
    """Drive straight on until a wall or its end is beside the robot.

    After a turn into an opening the corner is still ahead; a check for space on that side before it is reached would
    find the way that the robot came from. Outcomes: `done` when the corner is reached, or is not found within the
    distance; `blocked` when the robot makes no progress.
    """

    def __init__(self, side: Side = Side.RIGHT, speed: Speed = 0.5, distance: Length = 1.2) -> None:
        super().__init__(distance, speed)
        self._side = side

    def _arrived(self, facts: Facts) -> bool:
        return self._stands_beside(facts, self._side, self.settings.opening.aside)


@LIBRARY.activity("leave_junction", outcomes=("done", "blocked"), holds=("base",))
class LeaveJunction(ToCorner):
    """Drive straight on until a wall or its end is on both sides of the robot.

    Outcomes: `done` when the robot is in the way beyond the junction, or has driven the distance, for example in open
    space; `blocked` when the robot makes no progress.
    """

    def __init__(self, speed: Speed = 0.5, distance: Length = 1.2) -> None:
        super().__init__(distance, speed)

    def _arrived(self, facts: Facts) -> bool:
        return all(self._stands_beside(facts, side, facts.settings.space.side) for side in Side)
