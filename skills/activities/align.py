"""Aligning to a wall."""

from __future__ import annotations

from hsm.model.registry import Outcome
from hsm.model.types import Length
from perception.facts import Facts
from skills.course import Course
from skills.library import LIBRARY
from skills.motion import BLOCKED, DONE, Headway, Skill, not_negative
from skills.passage import passage_of, points_along
from skills.sides import Side
from transport.messages import Command

STRAIGHT = 0.02
"""An error of the heading below this is none, rad."""
NEAR = 0.05
"""An error of the distance below this is none, m."""
PATIENCE = 4.0


@LIBRARY.activity("align", outcomes=("done", "blocked"), holds=("base",))
class Align(Skill):
    """Align with the walls and move sideways to the usual distance from the wall on one side.

    In a corridor too narrow for that distance the robot moves to the middle. A distance of zero means the robot's usual
    one. A robot whose base cannot move sideways only turns: it reaches that distance while driving on. Outcomes:
    `done`; `blocked` when there is no wall on that side, or the robot cannot get there.
    """

    def __init__(self, side: Side = Side.RIGHT, distance: Length = 0.0) -> None:
        self._side = side
        self._distance = not_negative("distance", distance) or self.settings.wall.distance
        self._course = Course()
        self._headway = Headway(PATIENCE)

    def tick(self, facts: Facts) -> Command | Outcome:
        """The next velocity."""
        error, steering = self._course.error(facts), self.steering(facts)
        points = points_along(facts, error, self.settings.passage)
        passage = passage_of(points, facts.robot, facts.robot.radius, self.settings.passage)
        wall = passage.bound(self._side.sign)
        known = wall < self.settings.wall.reach
        aside = self._side.sign * (wall - min(self._distance, passage.width / 2)) if known else 0.0
        if abs(error) < STRAIGHT and (abs(aside) < NEAR or not steering.sideways):
            return DONE if known else BLOCKED
        if self._headway.lost(facts):
            return BLOCKED
        return Command(steering.along(error, 0.0, aside, passage.ahead))
