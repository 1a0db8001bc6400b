"""Driving past the end of a wall, to where the robot may turn into the opening."""

from __future__ import annotations

import math

from hsm.model.registry import Outcome
from hsm.model.types import Length, Speed
from perception.facts import Facts
from skills.activities.to_opening import ToOpening
from skills.library import LIBRARY
from skills.motion import BLOCKED, DONE, not_negative
from skills.sides import Side
from transport.messages import Command

PARALLEL = math.radians(10)
"""A robot that is off its course by more turns along the walls first, rad."""


@LIBRARY.activity("pass_corner", outcomes=("done", "blocked"), holds=("base",))
class PassCorner(ToOpening):
    """Drive past the end of the wall on one side: to the middle of the opening, or a distance past it.

    There the robot can turn into the opening, and the corner is as far beside it as a wall that it follows. A `past`
    of zero means the robot's usual distance. Outcomes: `done`, `blocked` when the robot makes no progress.
    """

    def __init__(self, side: Side = Side.RIGHT, speed: Speed = 0.5, past: Length = 0.0) -> None:
        super().__init__(side, speed)
        self._past = not_negative("past", past) or self.settings.wall.distance

    def tick(self, facts: Facts) -> Command | Outcome:
        """The next velocity."""
        if self._headway.lost(facts):
            return BLOCKED
        approach = self._approach(facts, self._past)
        if approach.left <= 0.02:
            if abs(approach.error) < PARALLEL:
                return DONE
            return Command(self.steering(facts).along(approach.error, 0.0, 0.0, approach.passage.ahead))
        return self._straight_on(
            facts, approach, max(self.settings.opening.least_speed, min(self._speed, 2.0 * approach.left))
        )
