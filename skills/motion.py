"""The common part of driving skills: steering, checks of arguments, and timeouts."""

from __future__ import annotations

import math
from typing import ClassVar

from hsm.model.registry import Outcome
from perception.facts import Facts
from skills.settings import SkillSettings
from skills.steering import Steering, steering_of
from transport.arithmetic import norm
from transport.description import RobotDescription
from transport.messages import Pose

DONE, BLOCKED = Outcome("done"), Outcome("blocked")
PATIENCE = 2.0
"""After this long without progress the way is blocked, s."""
PAUSE = 4.0
"""An activity that was not ticked for this many periods was paused: that time does not count."""


class Skill:
    """An activity with its robot and the robot's gains."""

    settings: ClassVar[SkillSettings] = SkillSettings()
    robot: ClassVar[RobotDescription] = RobotDescription()

    def steering(self, facts: Facts) -> Steering:
        """The law of the robot's base."""
        return steering_of(facts.robot, self.settings)


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


MOVED = 0.05
"""The least movement that counts as progress, m."""


class Stopwatch:
    """Counts the active time of an activity, without the time for which the loop keeps the robot stopped.

    Attributes:
        elapsed: s.
    """

    def __init__(self) -> None:
        self.elapsed = 0.0
        self._last: float | None = None

    def update(self, facts: Facts) -> float:
        """Process a tick and return the time so far, s; a pause counts as one period."""
        time = facts.time
        if self._last is not None:
            gone = time - self._last
            self.elapsed += gone if gone < PAUSE * facts.robot.period else facts.robot.period
        self._last = time
        return self.elapsed


class Rest:
    """Measures for how long the robot has neither moved nor turned further."""

    def __init__(self, moved: float, turned: float = math.inf) -> None:
        """Args: the least movement, m, and turn, rad, that end a rest."""
        self._moved = moved
        self._turned = turned
        self._watch = Stopwatch()
        self._since: float | None = None
        self._pose = Pose()

    def update(self, facts: Facts) -> float:
        """Process a tick and return the time since the robot was elsewhere, s."""
        time, pose = self._watch.update(facts), facts.observation.odometry.pose
        moved = norm(pose.x - self._pose.x, pose.y - self._pose.y) > self._moved
        turned = abs(math.remainder(pose.heading - self._pose.heading, math.tau)) > self._turned
        if self._since is None or moved or turned:
            self._since, self._pose = time, pose
        return time - self._since


class Headway:
    """Detects that the robot makes no progress."""

    def __init__(self, patience: float = PATIENCE, speed: float = math.inf) -> None:
        """Args: how long it may rest, s, and the speed that it is to have, m/s: a slow robot is given longer."""
        self._patience = max(patience, 2 * MOVED / speed)
        self._rest = Rest(MOVED, 0.1)

    def lost(self, facts: Facts) -> bool:
        """Whether the robot has moved less than 5 cm and turned less than 0.1 rad for the timeout (s)."""
        return self._rest.update(facts) > self._patience


HELD_AFTER = 0.5
"""A robot that has rested for this long is held up, s."""
STILL = 0.02
"""A robot that has moved less than this rests, m."""


class HeldUp:
    """Detects that something beside the way ahead holds up a robot that should be farther aside."""

    def __init__(self, needed: float) -> None:
        """Args: from how far aside on it matters, m."""
        self._needed = needed
        self._rest = Rest(STILL)
        self._held = False

    def update(self, facts: Facts, aside: float) -> bool:
        """Whether the robot is held up: from when it has rested until it is where it should be.

        Args:
            facts: of this tick.
            aside: how far to its left the robot should be, m.
        """
        rested = self._rest.update(facts) > HELD_AFTER
        self._held = abs(aside) > self._needed and (self._held or rested)
        return self._held


class Progress:
    """Detects that a remaining distance does not shrink."""

    def __init__(self, patience: float, speed: float) -> None:
        """Args: for how long it may not shrink, s, and the speed that the robot is to have, m/s."""
        self._patience = max(patience, 2 * MOVED / speed)
        self._watch = Stopwatch()
        self._since: float | None = None
        self._least = math.inf

    def lost(self, left: float, facts: Facts) -> bool:
        """Whether what is left (m) has not shrunk by 5 cm for the timeout."""
        time = self._watch.update(facts)
        if self._since is None or left < self._least - MOVED:
            self._since, self._least = time, left
        return time - self._since > self._patience
