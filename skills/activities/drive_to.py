"""Driving to a target through a potential field."""

from __future__ import annotations

import math

import numpy as np

from hsm.model.registry import Outcome
from hsm.model.types import Angle, Length, Speed
from perception.facts import Facts, turned
from skills.frames import Frame, rotated
from skills.library import LIBRARY
from skills.motion import BLOCKED, DONE, Headway, Progress, Skill, above_zero, finite
from skills.passage import REACH, SPARE
from skills.sides import Side
from skills.surroundings import Points
from transport.messages import Command, Pose, Twist

THERE = 0.05
"""The robot has arrived when it is this near, m."""
SLOWEST = 0.08
"""The robot arrives at this speed, m/s."""
NEAR = 0.5
"""Within this of the target the walls push the less the nearer it is, so that one beside a wall can be reached, m."""
FACED = 0.3
"""Nearer than this the direction to the target says little, and the robot keeps its heading, m."""
PATIENCE = 8.0
"""A way round an obstacle that brings the robot no nearer for so long is none, s."""


@LIBRARY.activity("drive_to", outcomes=("done", "blocked"), holds=("base",))
class DriveTo(Skill):
    """Drive to a target through a potential field: the target draws the robot, walls and obstacles push it off.

    The target is given as the robot stands at first: so far away, in such a direction; odometry measures the way to it.
    The robot turns to where it drives. What stands in the way pushes it to the side by which the way round is the
    shorter, not back, so it rounds obstacles; it does not leave a room or a dead end that opens away from the target.
    Outcomes: `done` within 5 cm; `blocked` when the robot stands still or gets no nearer for 8 s.
    """

    def __init__(self, distance: Length, bearing: Angle = 0.0, speed: Speed = 0.5) -> None:
        self._target = rotated(above_zero("distance", distance), 0.0, finite("bearing", bearing))
        self._speed = above_zero("speed", speed)
        self._headway = Headway(speed=speed)
        self._progress = Progress(PATIENCE, speed)
        self._goal: Frame | None = None
        self._round: Side | None = None

    def tick(self, facts: Facts) -> Command | Outcome:
        """The next velocity."""
        pose = facts.observation.odometry.pose
        if self._goal is None:
            self._goal = Frame(Frame(pose).outer(Pose(*self._target)))
        origin = self._goal.origin
        target = Frame(pose).local(origin)
        distance = math.hypot(target.x, target.y)
        if distance < THERE:
            return DONE
        if self._headway.lost(facts) or self._progress.lost(distance, facts):
            return BLOCKED
        bearing = math.atan2(target.y, target.x)
        forward, left = self._field(facts, distance, bearing)
        turn = self.settings.motion.heading_gain * bearing if distance > FACED else 0.0
        return Command(Twist(forward, left, turn))

    def _field(self, facts: Facts, distance: float, bearing: float) -> tuple[float, float]:
        """The velocity that target and walls make together, in the robot's frame, m/s."""
        drawn = min(self._speed, max(SLOWEST, self.settings.motion.lateral_gain * distance))
        facing = max(0.0, math.cos(bearing))  # what is behind the laser does not see: turn first
        drawn *= facing
        share = facing * min(1.0, distance / NEAR)
        back, aside = share * facts.repulsion.forward, share * facts.repulsion.left
        points = turned(facts.points[np.hypot(*facts.points.T) < distance], -bearing)
        x, y = points[:, 0], points[:, 1]
        lane = np.flatnonzero((np.abs(y) < facts.robot.half_width + SPARE) & (x > 0) & (x < min(distance, REACH)))
        if len(lane):
            self._round = self._round or _shorter_way(facts, points, int(lane[x[lane].argmin()]))
            aside += self._round.sign * min(-back, self._speed)
        else:
            self._round = None
        to_target = rotated(drawn, 0.0, bearing)
        return to_target[0] + back, to_target[1] + aside


def _shorter_way(facts: Facts, points: Points, nearest: int) -> Side:
    """The side by which an obstacle ends nearer to the robot's line; rather one where its end is seen.

    Args:
        facts: of the tick.
        points: hits in a frame at the robot with x to the target, counter-clockwise, m, shape (n, 2).
        nearest: which of them is the obstacle's.
    """
    gaps = np.flatnonzero(np.hypot(*np.diff(points, axis=0).T) > 2 * (facts.robot.half_width + SPARE))
    first = int(gaps[gaps < nearest].max(initial=-1)) + 1
    last = int(gaps[gaps >= nearest].min(initial=len(points) - 1))
    y = points[first : last + 1, 1]
    to_the_left = (last == len(points) - 1 and bool(facts.sweep.hit[-1]), float(y.max()))
    to_the_right = (first == 0 and bool(facts.sweep.hit[0]), -float(y.min()))
    return Side.LEFT if to_the_left <= to_the_right else Side.RIGHT
