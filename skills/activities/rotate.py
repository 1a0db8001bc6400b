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
from skills.nearing import Nearing
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
SHARE = 0.5
"""For this share of its turn the robot makes room beforehand, where something comes nearer."""
WATCHED = 0.7
"""As long as it has turned less than this, it is looked at whether something comes nearer, rad."""
ASKEW = 0.15
"""Off its course by more than this it turns back before it backs, rad."""


@LIBRARY.activity("rotate", outcomes=("done", "blocked"), holds=("base",))
class Rotate(Skill):
    """Turn on the spot by an angle, counter-clockwise positive.

    The turn is measured by odometry from the direction of the walls beside the robot; quarter turns end
    along the walls, if there are any. If a wall is too near for its corners, the robot moves away from the wall while
    it turns. If its base cannot move sideways, it backs away from a wall ahead before the turn, and farther from an
    approaching obstacle. A turn that meets an obstacle is undone; if that fails too, the turn is tried again, so that
    the robot does not stay between two headings if it can turn at all. Outcomes: `done`; `blocked` when the robot has
    its old heading again, when it cannot turn in either direction, and after several failures in both.
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
        self._sure = False
        self._nearing: Nearing | None = None

    def tick(self, facts: Facts) -> Command | Outcome:
        """The next velocity."""
        pose = facts.observation.odometry.pose
        if self._turned is None:
            self._turned = Turned(pose.heading)
            self._along_walls = abs(math.remainder(self._angle, facts.settings.compass.world_angle)) < 0.01
            self._error = facts.misalignment
            self._spot = self._roomy_spot(facts, pose)
        off_course = self._error - self._turned.update(pose.heading)
        left = self._goal + off_course
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
            self._there = self._sure = True
        steering = self.steering(facts)
        if steering.sideways:
            spot = self._to_the_spot(pose)
        else:
            spot = self._backwards(facts, pose, off_course, abs(left)), 0.0
            if spot[0] and abs(off_course) > ASKEW:  # first along the course again
                left, spot = off_course, (0.0, 0.0)
        turn = math.copysign(min(settings.rate, settings.gain * abs(left)), left)
        return Command(steering.turn(turn, spot))

    def _stuck(self) -> bool:
        """Whether the robot, which gets no farther, has not got anywhere since the last time either, or too often."""
        assert self._turned is not None
        self._losses.append(self._turned.angle)
        return len(self._losses) > TRIES or any(abs(a - b) < HELD for a, b in pairwise(self._losses[-2:]))

    def _room(self, facts: Facts) -> float:
        """How far off the walls the robot turns, m."""
        return facts.robot.radius + self.settings.safety.margin + self.settings.rotate.room

    def _passage(self, facts: Facts, error: float) -> Passage:
        """What is around, in a frame at the robot along its course, which is so far (rad) off its heading."""
        points = points_along(facts, error, self.settings.passage)
        return passage_of(points, facts.robot, self._room(facts), self.settings.passage)

    def _roomy_spot(self, facts: Facts, pose: Pose) -> Frame:
        """Where to turn: here, or as far off the walls as the robot's corners need."""
        room, passage = self._room(facts), self._passage(facts, self._error)
        aside = _aside(passage, room, facts.robot.half_width) if self.steering(facts).sideways else 0.0
        x, y = rotated(min(0.0, passage.ahead - room), aside, self._error)
        return Frame(Frame(pose).outer(Pose(x, y)))

    def _to_the_spot(self, pose: Pose) -> tuple[float, float]:
        """Where the spot is, in the robot's frame, m."""
        here = self._spot.local(pose)
        distance = norm(here.x, here.y)
        if self._pushed_off(distance):
            self._spot, self._away, self._nearest = Frame(pose), 0.0, 0.0
            return 0.0, 0.0
        return rotated(-here.x, -here.y, -here.heading)

    def _backwards(self, facts: Facts, pose: Pose, off_course: float, left: float) -> float:
        """How far to back along the course, negative, before there is room for the whole turn, m; 0 where there is.

        Whether something comes nearer shows after a moment. A turn that has just begun is then taken back.

        Args:
            facts: of the tick.
            pose: of the robot.
            off_course: from the robot's heading to its course, rad.
            left: of the turn, rad.
        """
        if self._sure or (self._there and abs(off_course) > WATCHED):
            return 0.0
        ahead = self._passage(facts, off_course).ahead
        self._nearing = self._nearing or Nearing(facts.robot.limits.speed)
        nearing = self._nearing.update(facts.observation.stamp * 1e-9, self._spot.local(pose).x + ahead)
        missing = self._room(facts) + SHARE * nearing * left / self.settings.rotate.rate - ahead
        self._there = missing < self.settings.motion.dead_zone
        self._sure = self._there and self._nearing.watched
        # Proportional feedback alone would stay behind what comes nearer.
        return 0.0 if self._there else -(missing + nearing / self.settings.motion.to_spot_gain)

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
        passage: the walls on both sides.
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
