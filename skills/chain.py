"""From what a skill asks for to what the base is sent: limits of the robot, then the guard against walls."""

from __future__ import annotations

import math

from perception.facts import Facts
from skills.safety import Guard
from skills.settings import SkillSettings
from skills.surroundings import Surroundings
from transport.description import RobotDescription
from transport.messages import STOP, Twist


class MotionChain:
    """The last link between a machine and a base; one for each run.

    It remembers the last command, for the limits of acceleration, and the points in the laser's blind sector.
    """

    def __init__(self, robot: RobotDescription, settings: SkillSettings) -> None:
        self._guard = Guard(robot, settings.safety)
        self._surroundings = Surroundings(robot.laser, settings.safety.reach)
        self._last = STOP

    def shape(self, wanted: Twist, facts: Facts) -> Twist:
        """The command to send for a wanted one; to be called once a tick, in every tick.

        A robot that sees nothing stops, as does one whose wish is not a number, as comes of an odometry that is none.
        """
        if not facts.sweep.known.any() or not math.isfinite(wanted.forward + wanted.left + wanted.turn):
            wanted = STOP
        self._last = self._guard.admit(self._last, wanted, self._surroundings.update(facts))
        return self._last
