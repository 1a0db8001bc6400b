"""Driving straight on between the walls."""

from __future__ import annotations

from hsm.registry import Outcome
from hsm.types import Speed
from perception.facts import Facts
from skills.course import Course
from skills.library import LIBRARY
from skills.motion import Headway, Skill, along
from skills.passage import Passage, passage_of, points_along
from skills.settings import SkillSettings
from transport.messages import Command

PATIENCE = 2.0
"""After so long without headway the way is blocked, s."""
BLOCKED = Outcome("blocked")


@LIBRARY.activity("drive", outcomes=("blocked",), holds=("base",))
class Drive(Skill):
    """Drive straight on along the walls, in the middle of a corridor, off the walls of a wider space.

    Outcomes: `blocked` when the robot gets no farther.
    """

    def __init__(self, speed: Speed = 0.5) -> None:
        self._speed = speed
        self._course = Course()
        self._headway = Headway(PATIENCE)

    def tick(self, facts: Facts) -> Command | Outcome:
        """The next velocity."""
        if self._headway.lost(facts):
            return BLOCKED
        error = self._course.error(facts)
        passage = passage_of(points_along(facts, error), facts.robot, self.settings.motion.look_ahead)
        return along(error, self._speed, off_the_walls(passage, self.settings), passage.ahead, self.settings.motion)


def off_the_walls(passage: Passage, settings: SkillSettings) -> float:
    """How far to the left of the robot the line lies that keeps off the walls of a passage, m.

    The middle of a corridor; in a wider space the robot's own line, unless a wall is too near.
    """
    keep_off = settings.wall.keep_off
    if passage.width < settings.wall.corridor:
        return (passage.left + passage.right) / 2
    room_left, room_right = passage.left - keep_off, -passage.right - keep_off
    return min(room_left, 0.0) - min(room_right, 0.0)
