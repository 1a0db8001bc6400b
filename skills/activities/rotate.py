"""Turning on the spot."""

from __future__ import annotations

import math
from itertools import pairwise

from hsm.model.registry import Outcome
from hsm.model.types import Angle
from perception.facts import Facts
from skills.course import TRUSTED
from skills.frames import Frame, Turned, rotated
from skills.library import LIBRARY
from skills.motion import BLOCKED, DONE, Headway, Skill, finite
from skills.passage import Passage, passage_of, points_along
from transport.arithmetic import norm
from transport.messages import Command, Pose

CLOSE = 0.35
"""With less than this left to turn the compass says where the turn ends, rad."""
SECOND_TRY = 0.9
"""The timeout of undoing or repeating a turn, as a share of the usual one."""
HELD = 0.1
"""A robot that has turned less than this from one failure to the next is held, rad."""
TRIES = 5
"""The largest number of failures, in both directions, of one turn."""
PUSHED = 0.05
"""A robot that is this much farther from its spot than it was has given way to something, m."""


@LIBRARY.activity("rotate", outcomes=("done", "blocked"), holds=("base",))
class Rotate(Skill):
    """Turn on the spot by an angle, counter-clockwise positive.

    The turn is measured by odometry from the axis of the walls that the robot is along at first; quarter turns end
    along the walls, where there are any. Where a wall is too near for the robot's corners, the robot moves off it while
    it turns; one whose base cannot move sideways backs from a wall ahead before it turns. A turn that meets an obstacle
    is undone, and repeated if that fails too, so that the robot does not stay between two headings if it can turn at
    all. Outcomes: `done`; `blocked` when the robot faces as before, when it can turn in neither direction, and after
    several failures in both.
    """

    def __init__(self, angle: Angle) -> None:
        self._angle = finite("angle", angle)
        self._goal = angle
        self._headway = Headway(self.settings.rotate.patience)
        self._losses: list[float] = []
        self._turned: Turned | None = None
        self._along_walls = False
        self._error = 0.0
        self._spot = Frame(Pose())
        self._away = 0.0
        self._nearest = math.inf
        self._there = False

    def tick(self, facts: Facts) -> Command | Outcome:
        """The next velocity."""
        pose = facts.observation.odometry.pose
        if self._turned is None:
            self._turned = Turned(pose.heading)
            self._along_walls = abs(math.remainder(self._angle, facts.settings.compass.world_angle)) < 0.01
            self._error = facts.misalignment
            self._spot = self._roomy_spot(facts, pose)
        left = self._goal + self._error - self._turned.update(pose.heading)
        compass = facts.compass
        if self._along_walls and abs(left) < CLOSE and compass.known and abs(compass.misalignment - left) < TRUSTED:
            left = compass.misalignment
        settings = self.settings.rotate
        if abs(left) < settings.tolerance:
            return DONE if self._goal == self._angle else BLOCKED
        if self._headway.lost(facts):
            if self._stuck():
                return BLOCKED
            # Including detection, both tries take at most twice the timeout.
            self._headway = Headway(SECOND_TRY * settings.patience)
            if self._there or self.steering(facts).sideways:
                self._goal = self._angle - self._goal
            self._there = True
        turn = math.copysign(min(settings.rate, settings.gain * abs(left)), left)
        return Command(self.steering(facts).turn(turn, self._to_the_spot(facts, pose)))

    def _stuck(self) -> bool:
        """Whether the robot, which gets no farther, has not got anywhere since the last time either, or too often."""
        assert self._turned is not None
        self._losses.append(self._turned.angle)
        return len(self._losses) > TRIES or any(abs(a - b) < HELD for a, b in pairwise(self._losses[-2:]))

    def _roomy_spot(self, facts: Facts, pose: Pose) -> Frame:
        """Where to turn: here, or as far off the walls as the robot's corners need."""
        error = self._error
        room = facts.robot.radius + self.settings.safety.margin + self.settings.rotate.room
        points = points_along(facts, error, self.settings.passage)
        passage = passage_of(points, facts.robot, room, self.settings.passage)
        aside = _aside(passage, room, facts.robot.half_width) if self.steering(facts).sideways else 0.0
        back = min(0.0, passage.ahead - room)
        x, y = rotated(back, aside, error)
        return Frame(Frame(pose).outer(Pose(x, y)))

    def _to_the_spot(self, facts: Facts, pose: Pose) -> tuple[float, float]:
        """Where the spot is, in the robot's frame, m; a robot that can only go there first goes there once."""
        if not self.steering(facts).sideways and not self._there:
            self._spot = self._roomy_spot(facts, pose)  # what is ahead may come nearer meanwhile
        here = self._spot.local(pose)
        distance = norm(here.x, here.y)
        if not self.steering(facts).sideways:
            self._there = self._there or distance < self.settings.motion.dead_zone
            if self._there:
                return 0.0, 0.0
        elif self._pushed_off(distance):
            self._spot, self._away, self._nearest = Frame(pose), 0.0, 0.0
            return 0.0, 0.0
        return rotated(-here.x, -here.y, -here.heading)

    def _pushed_off(self, distance: float) -> bool:
        """Whether the robot, on its way to the spot or there, has been made to leave it.

        What it gives way to may follow it, also behind its back, where it sees nothing: it does not go back there. At
        first it may roll on, which does not count.
        """
        if distance < self._away:
            self._nearest = min(self._nearest, distance)
        self._away = distance
        return distance > self._nearest + PUSHED


def _aside(passage: Passage, room: float, half_width: float) -> float:
    """How far to the left the robot has room to turn, m.

    Args:
        passage: the walls at both sides.
        room: what a turn takes to each side, m.
        half_width: of the robot, m.
    """
    aside = 0.0
    if passage.width < 2 * room:
        aside = (passage.left + passage.right) / 2
    elif passage.left < room:
        aside = passage.left - room
    elif -passage.right < room:
        aside = passage.right + room
    # A wall beside the robot asks for no more; what does, as the way that it will turn into, is not beside it.
    most = room - half_width
    return min(max(aside, -most), most)
