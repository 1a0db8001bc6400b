"""Driving to a target past obstacles."""

from __future__ import annotations

from hsm.model.registry import Outcome
from hsm.model.types import Angle, Length, Speed
from perception.facts import Facts
from skills.frames import Frame, rotated
from skills.library import LIBRARY
from skills.motion import BLOCKED, DONE, Headway, Progress, Skill, above_zero, finite
from skills.steering import Seeker
from transport.arithmetic import norm
from transport.messages import Command, Pose

THERE = 0.05
"""The robot has arrived when it is this near, m."""
PATIENCE = 8.0
"""A detour counts as blocked after this long without progress, s."""


@LIBRARY.activity("drive_to", outcomes=("done", "blocked"), holds=("base",))
class DriveTo(Skill):
    """Drive to a target past obstacles.

    The target is given relative to the first pose: a distance and a direction; odometry measures the way to it.
    The robot turns to where it drives. It follows a potential field: the target attracts it, and an obstacle pushes it
    towards the side with the shorter detour. A base that cannot move sideways drives in the direction with the longest
    free way. So it avoids obstacles, but it does not leave a room or a dead end that opens away from the target.
    Outcomes: `done` within 5 cm; `blocked` when the robot stands still or makes no progress for 8 s.
    """

    def __init__(self, distance: Length, bearing: Angle = 0.0, speed: Speed = 0.5) -> None:
        self._target = rotated(above_zero("distance", distance), 0.0, finite("bearing", bearing))
        self._speed = above_zero("speed", speed)
        self._headway = Headway(speed=speed)
        self._progress = Progress(PATIENCE, speed)
        self._goal: Frame | None = None
        self._seeker: Seeker | None = None

    def tick(self, facts: Facts) -> Command | Outcome:
        """The next velocity."""
        pose = facts.observation.odometry.pose
        if self._goal is None or self._seeker is None:
            self._seeker = self.steering(facts).seeker(self._speed)
            self._goal = Frame(Frame(pose).outer(Pose(*self._target)))
        origin = self._goal.origin
        target = Frame(pose).local(origin)
        distance = norm(target.x, target.y)
        if distance < THERE:
            return DONE
        if self._headway.lost(facts) or self._progress.lost(distance, facts):
            return BLOCKED
        return Command(self._seeker.towards(facts, (target.x, target.y)))
