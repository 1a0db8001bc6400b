"""Driving straight on between the walls."""

from __future__ import annotations

from hsm.model.registry import Outcome
from hsm.model.types import Speed
from perception.facts import Facts
from skills.course import Course
from skills.library import LIBRARY
from skills.motion import BLOCKED, Headway, HeldUp, Skill, above_zero
from skills.passage import Passage, off_the_walls, passage_of, points_along
from transport.messages import Command


@LIBRARY.activity("drive", outcomes=("blocked",), holds=("base",))
class Drive(Skill):
    """Drive straight on along the walls, in the middle of a corridor, at a distance from the walls of a wider space.

    Outcomes: `blocked` when the robot makes no progress.
    """

    def __init__(self, speed: Speed = 0.5) -> None:
        self._speed = above_zero("speed", speed)
        self._course = Course()
        self._headway = Headway(speed=speed)
        self._held_up = HeldUp(self.settings.motion.needed)

    def tick(self, facts: Facts) -> Command | Outcome:
        """The next velocity."""
        error = self._course.error(facts)
        points = points_along(facts, error, self.settings.passage)
        passage = passage_of(points, facts.robot, self.settings.motion.look_ahead, self.settings.passage)
        ended = self._ended(facts, passage)
        if ended is None and self._headway.lost(facts):
            return BLOCKED
        if ended is not None:
            return ended
        steering, aside = self.steering(facts), self._aside(passage)
        # The end of a wall beside the lane is not ahead, and yet the guard may stop the robot there.
        ahead = 0.0 if not steering.sideways and self._held_up.update(facts, aside) else passage.ahead
        return Command(steering.along(error, self._speed, aside, ahead))

    def _ended(self, facts: Facts, passage: Passage) -> Outcome | None:
        """How the activity has ended, or None while it runs."""
        return None

    def _aside(self, passage: Passage) -> float:
        """How far to the left the robot should be, m."""
        return off_the_walls(passage, self.settings)
