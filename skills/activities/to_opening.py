"""Driving straight on beside an opening: how the skills begin that take it."""

from __future__ import annotations

from dataclasses import dataclass

from hsm.model.types import Length, Speed
from perception.facts import Facts
from skills.course import Course
from skills.motion import Headway, Skill, above_zero
from skills.opening import Opening, opening_of
from skills.passage import Passage, off_the_walls, passage_of, points_along
from skills.sides import Side
from transport.messages import Command, Pose


@dataclass(frozen=True, slots=True)
class Approach:
    """Where the robot is before an opening on its side.

    Attributes:
        error: how far to turn to be on course, rad.
        left: how far it is along the course to where the robot can turn into the opening, m.
        beside: distance to the wall before the opening, m.
        passage: the gap that the robot drives in.
    """

    error: float
    left: float
    beside: float
    passage: Passage


class ToOpening(Skill):
    """An activity that drives past the end of the wall on one side."""

    def __init__(self, side: Side, speed: Speed) -> None:
        self._side = side
        self._speed = above_zero("speed", speed)
        self._course = Course()
        self._headway = Headway(speed=speed)
        self._opening: Opening | None = None

    def _approach(self, facts: Facts, past: Length, least: Length = 0.0) -> Approach:
        """Measure the opening again.

        Args:
            facts: of the tick.
            past: the robot turns in the opening's middle, or so far past its near corner, m.
            least: so far ahead its far side must be, m.
        """
        error = self._course.error(facts)
        points = points_along(facts, error, self.settings.passage)
        pose = facts.observation.odometry.pose
        if self._opening is None:
            course = Pose(pose.x, pose.y, pose.heading + error)
            self._opening = opening_of(
                points, facts.robot, self._side, course, self.settings.opening, least=least + facts.robot.half_width
            )
        self._opening.update(points, pose)
        passage = passage_of(points, facts.robot, self.settings.motion.look_ahead, self.settings.passage)
        return Approach(error, self._opening.middle(past) - self._opening.driven(pose), self._opening.aside, passage)

    def _straight_on(self, facts: Facts, approach: Approach, speed: float) -> Command:
        """Drive on along the course."""
        aside = off_the_walls(approach.passage, self.settings)
        return Command(self.steering(facts).along(approach.error, speed, aside, approach.passage.ahead))
