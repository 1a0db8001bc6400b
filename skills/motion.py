"""What driving skills share: forward at a speed that the way ahead allows, sideways to where the robot should be."""

from __future__ import annotations

import math
from typing import ClassVar

from hsm.model.registry import Outcome
from perception.facts import Facts
from skills.frames import rotated
from skills.passage import Passage
from skills.settings import MotionSettings, SkillSettings
from transport.messages import Command, Pose, Twist

DONE, BLOCKED = Outcome("done"), Outcome("blocked")
STANDOFF = 0.2
"""Free way ahead of the robot's centre at which it has no speed left, m."""
PATIENCE = 2.0
"""After so long without headway the way is blocked, s."""
PAUSE = 4.0
"""An activity that was not asked for so many periods has been kept waiting: that time is not its own."""


class Skill:
    """An activity with the gains of its robot."""

    settings: ClassVar[SkillSettings] = SkillSettings()


def above_zero(name: str, value: float) -> float:
    """The value of an activity's argument, SI.

    Raises:
        ValueError: it is not positive and finite.
    """
    if not 0 < value < math.inf:
        raise ValueError(f"`{name}` must be above zero, not {value:g}")
    return value


def not_negative(name: str, value: float) -> float:
    """The value of an activity's argument, SI.

    Raises:
        ValueError: it is negative or not finite.
    """
    if not 0 <= value < math.inf:
        raise ValueError(f"`{name}` must be zero or above, not {value:g}")
    return value


def finite(name: str, value: float) -> float:
    """The value of an activity's argument, SI.

    Raises:
        ValueError: it is not finite.
    """
    if not math.isfinite(value):
        raise ValueError(f"`{name}` must be a number, not {value:g}")
    return value


def along(course_error: float, speed: float, aside: float, ahead: float, settings: MotionSettings) -> Command:
    """Drive along the course.

    Args:
        course_error: how far to turn to be on course, rad.
        speed: wanted speed, m/s.
        aside: how far to the left the robot should be, m.
        ahead: free way in front of the robot's centre, m.
        settings: gains.
    """
    forward = max(0.0, min(speed, settings.slow_gain * (ahead - STANDOFF)))
    forward *= max(0.0, math.cos(2 * course_error))  # turn first when far off course
    left = 0.0
    if abs(aside) > settings.dead_zone:
        left = max(-settings.lateral_speed, min(settings.lateral_speed, settings.lateral_gain * aside))
    return Command(Twist(*rotated(forward, left, course_error), settings.heading_gain * course_error))


def off_the_walls(passage: Passage, settings: SkillSettings) -> float:
    """How far to the left of the robot the line lies that keeps off the walls of a passage, m.

    The middle of a corridor; in a wider space the robot's own line, unless a wall is too near.
    """
    keep_off = settings.wall.keep_off
    if passage.width < settings.wall.corridor:
        return (passage.left + passage.right) / 2
    room_left, room_right = passage.left - keep_off, -passage.right - keep_off
    return min(room_left, 0.0) - min(room_right, 0.0)


MOVED = 0.05
"""A robot that has moved less has not got anywhere, m."""


class Stopwatch:
    """Counts the time for which an activity has been at work: while the loop keeps the robot standing, it is not asked.

    Attributes:
        elapsed: s.
    """

    def __init__(self) -> None:
        self.elapsed = 0.0
        self._last: float | None = None

    def update(self, facts: Facts) -> float:
        """Take in a tick and return the time so far, s; a pause counts as one period."""
        time = facts.time
        if self._last is not None:
            gone = time - self._last
            self.elapsed += gone if gone < PAUSE * facts.robot.period else facts.robot.period
        self._last = time
        return self.elapsed


class Headway:
    """Notices that the robot does not get anywhere."""

    def __init__(self, patience: float = PATIENCE, speed: float = math.inf) -> None:
        """Args: for how long it may stand, s, and the speed that it is to have, m/s: a slow robot is given longer."""
        self._patience = max(patience, 2 * MOVED / speed)
        self._watch = Stopwatch()
        self._since: float | None = None
        self._pose = Pose()

    def lost(self, facts: Facts) -> bool:
        """Whether the robot has moved less than 5 cm and turned less than 0.1 rad for the time of its patience (s)."""
        time, pose = self._watch.update(facts), facts.observation.odometry.pose
        moved = math.hypot(pose.x - self._pose.x, pose.y - self._pose.y) > MOVED
        if self._since is None or moved or abs(math.remainder(pose.heading - self._pose.heading, math.tau)) > 0.1:
            self._since, self._pose = time, pose
        return time - self._since > self._patience


class Progress:
    """Notices that a distance that is to be driven does not shrink, whatever the robot does meanwhile."""

    def __init__(self, patience: float, speed: float) -> None:
        """Args: for how long it may not shrink, s, and the speed that the robot is to have, m/s."""
        self._patience = max(patience, 2 * MOVED / speed)
        self._watch = Stopwatch()
        self._since: float | None = None
        self._least = math.inf

    def lost(self, left: float, facts: Facts) -> bool:
        """Whether what is left (m) has not shrunk by 5 cm for the time of its patience."""
        time = self._watch.update(facts)
        if self._since is None or left < self._least - MOVED:
            self._since, self._least = time, left
        return time - self._since > self._patience
