"""Driving past the end of a wall, to where the robot may turn into the opening."""

from __future__ import annotations

from hsm.registry import Outcome
from hsm.types import Length, Speed
from perception.facts import Facts
from skills.activities.drive import BLOCKED, PATIENCE, off_the_walls
from skills.course import Course
from skills.library import LIBRARY
from skills.motion import Headway, Skill, along
from skills.opening import Opening, opening_of
from skills.passage import passage_of, points_along
from skills.sides import Side
from transport.messages import Command


@LIBRARY.activity("pass_corner", outcomes=("done", "blocked"), holds=("base",))
class PassCorner(Skill):
    """Drive past the end of the wall at a side: to the middle of the opening, or as far as a wall is kept off.

    There the robot can turn into the opening and has the corner as far at its side as a wall that it follows. A `past`
    of zero means the robot's usual distance. Outcomes: `done`, `blocked` when the robot gets no farther.
    """

    def __init__(self, side: Side = Side.RIGHT, speed: Speed = 0.5, past: Length = 0.0) -> None:
        self._side = side
        self._speed = speed
        self._past = past or self.settings.wall.distance
        self._course = Course()
        self._headway = Headway(PATIENCE)
        self._opening: Opening | None = None

    def tick(self, facts: Facts) -> Command | Outcome:
        """The next velocity."""
        if self._headway.lost(facts):
            return BLOCKED
        error = self._course.error(facts)
        points = points_along(facts, error)
        pose = facts.observation.odometry.pose
        if self._opening is None:
            self._opening = opening_of(points, facts.robot, self._side, pose, error)
        self._opening.update(points, pose)
        left = self._opening.middle(self._past) - self._opening.driven(pose)
        if left <= 0.02:
            return Outcome("done")
        passage = passage_of(points, facts.robot, self.settings.motion.look_ahead)
        speed = max(0.1, min(self._speed, 2.0 * left))
        return along(error, speed, off_the_walls(passage, self.settings), passage.ahead, self.settings.motion)
