"""What driving skills share: forward at a speed that the way ahead allows, sideways to where the robot should be."""

from __future__ import annotations

import math
from typing import ClassVar

from perception.facts import Facts
from skills.frames import rotated
from skills.settings import MotionSettings, SkillSettings
from transport.messages import Command, Pose, Twist

STANDOFF = 0.2
"""Free way ahead of the robot's centre at which it has no speed left, m."""


class Skill:
    """An activity with the gains of its robot."""

    settings: ClassVar[SkillSettings] = SkillSettings()


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


class Headway:
    """Notices that the robot does not get anywhere."""

    def __init__(self, patience: float) -> None:
        self._patience = patience
        self._since: float | None = None
        self._pose = Pose()

    def lost(self, facts: Facts) -> bool:
        """Whether the robot has moved less than 5 cm and turned less than 0.1 rad for the time of its patience (s)."""
        pose = facts.observation.odometry.pose
        moved = math.hypot(pose.x - self._pose.x, pose.y - self._pose.y) > 0.05
        if self._since is None or moved or abs(math.remainder(pose.heading - self._pose.heading, math.tau)) > 0.1:
            self._since, self._pose = facts.time, pose
        return facts.time - self._since > self._patience
