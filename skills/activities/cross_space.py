"""Crossing an open space along a wall."""

from __future__ import annotations

import math

from hsm.model.registry import Outcome
from hsm.model.types import Length, Speed
from perception.exit import quantised
from perception.facts import Facts
from perception.space import look
from skills.activities.follow_wall import FollowWall
from skills.library import LIBRARY
from skills.motion import DONE
from skills.passage import Passage
from skills.sides import Side

LOST = Outcome("lost")


@LIBRARY.activity("cross_space", outcomes=("done", "lost", "blocked"), holds=("base",))
class CrossSpace(FollowWall):
    """Cross an open space along the wall on one side, like `follow_wall`, until the space or the wall ends.

    Outcomes: `done` at the far side, where a wall is ahead or a corridor begins; `lost` when the wall on that
    side ends, for example at an opening, or when there is none; `blocked` when the robot makes no progress.
    """

    def __init__(self, side: Side = Side.RIGHT, speed: Speed = 0.5, distance: Length = 0.0) -> None:
        super().__init__(side, speed, distance)
        self._in_the_open = False

    def _ended(self, facts: Facts, passage: Passage) -> Outcome | None:
        settings = facts.settings.space
        threshold = self._distance + self.settings.wall.beyond
        direction = quantised(facts.misalignment) + self._side.sign * math.pi / 2
        beside = look(facts.sweep, direction, settings.width, threshold, settings.bad_share)
        if beside.free:
            return LOST
        narrow = passage.width < self.settings.wall.corridor
        self._in_the_open = self._in_the_open or not narrow
        front = facts.space.front
        return DONE if (front.known and not front.free) or (self._in_the_open and narrow) else None
