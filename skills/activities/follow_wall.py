"""Following a wall."""

from __future__ import annotations

from hsm.registry import Outcome
from hsm.types import Length, Speed
from perception.facts import Facts
from skills.activities.drive import BLOCKED, PATIENCE, off_the_walls
from skills.course import Course
from skills.library import LIBRARY
from skills.motion import Headway, Skill, along
from skills.passage import Passage, passage_of, points_along
from skills.sides import Side
from transport.messages import Command


@LIBRARY.activity("follow_wall", outcomes=("blocked",), holds=("base",))
class FollowWall(Skill):
    """Drive along the wall at a side, held at a distance by a virtual spring with a dead zone.

    Where the corridor is narrower than twice the distance the robot drives in its middle; where there is no wall to
    follow it drives straight on. A distance of zero means the robot's usual one. Outcomes: `blocked` when the robot
    gets no farther.
    """

    def __init__(self, side: Side = Side.RIGHT, speed: Speed = 0.5, distance: Length = 0.0) -> None:
        self._side = side
        self._speed = speed
        self._distance = distance or self.settings.wall.distance
        self._course = Course()
        self._headway = Headway(PATIENCE)

    def tick(self, facts: Facts) -> Command | Outcome:
        """The next velocity."""
        if self._headway.lost(facts):
            return BLOCKED
        error = self._course.error(facts)
        passage = passage_of(points_along(facts, error), facts.robot, self.settings.motion.look_ahead)
        return along(error, self._speed, self._spring(passage), passage.ahead, self.settings.motion)

    def _spring(self, passage: Passage) -> float:
        """How far to the left the robot should be, m."""
        wall = passage.bound(self._side.sign)
        if wall > self.settings.wall.reach or passage.width < 2 * self._distance:
            return off_the_walls(passage, self.settings)
        return self._side.sign * (wall - self._distance)
