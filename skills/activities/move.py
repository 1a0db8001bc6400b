"""Moving to a place near by."""

from __future__ import annotations

from hsm.model.registry import Outcome
from hsm.model.types import Length, Speed
from perception.facts import Facts
from skills.frames import Frame
from skills.library import LIBRARY
from skills.motion import BLOCKED, DONE, PATIENCE, Progress, Skill, above_zero, finite, not_negative
from transport.arithmetic import norm
from transport.base import Differential
from transport.messages import Command, Pose

THERE = 0.02
"""The robot has arrived when it is this near, m."""


@LIBRARY.activity("move", outcomes=("done", "blocked"), holds=("base",))
class Move(Skill):
    """Move in a straight line and stop, without turning if the base can move so.

    The way is given relative to the first pose: metres forward and metres to the left, negative to the right. The robot
    cannot move backwards, because the laser does not see what is behind; turn first. Odometry measures the way; walls
    do not guide the robot, but the guard keeps it away from them. A base on two wheels moves forward only. Outcomes:
    `done` within 2 cm; `blocked` when the robot makes no progress.
    """

    @classmethod
    def refuses(cls, *, left: float = 0.0, **_: object) -> str:
        """Why it cannot move so far to the left (m): the base cannot, or nothing."""
        if left and isinstance(cls.robot.base, Differential):
            return f"`left` must be 0 m, not {left:g}: a base on two wheels cannot move sideways; rotate first"
        return ""

    def __init__(self, forward: Length = 0.0, left: Length = 0.0, speed: Speed = 0.3) -> None:
        self._way = Pose(not_negative("forward", forward), finite("left", left))
        self._speed = above_zero("speed", speed)
        reason = self.refuses(left=left)
        if reason:
            raise ValueError(reason)
        self._progress = Progress(PATIENCE, speed)
        self._goal: Frame | None = None

    def tick(self, facts: Facts) -> Command | Outcome:
        """The next velocity."""
        pose = facts.observation.odometry.pose
        if self._goal is None:
            self._goal = Frame(Frame(pose).outer(self._way))
        here = self._goal.local(pose)
        left = norm(here.x, here.y)
        if left < THERE:
            return DONE
        if self._progress.lost(left, facts):
            return BLOCKED
        speed = min(self._speed, max(self.settings.motion.arrival, self.settings.arc.gain * left))
        return Command(self.steering(facts).to_point(Frame(pose).local(self._goal.origin), speed))
