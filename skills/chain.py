"""From the velocity that a skill requests to the one that is sent to the base: the robot's limits, then the guard."""

from __future__ import annotations

import math

from perception.facts import Facts
from skills.safety import CollisionGuard
from skills.settings import SafetySettings, SkillSettings
from skills.surroundings import Surroundings
from transport.arithmetic import norm
from transport.description import RobotDescription
from transport.messages import STOP, Command


class MotionChain:
    """The last link between a machine and a base; one for each run.

    It remembers the last command, for the limits of acceleration, and the points in the laser's blind sector.
    """

    def __init__(self, robot: RobotDescription, settings: SkillSettings) -> None:
        self._guard = CollisionGuard(robot, settings.safety)
        self._surroundings = Surroundings(reach_of(robot, settings.safety))
        self._last = STOP

    def shape(self, wanted: Command, facts: Facts) -> Command:
        """The command to send for a requested one; call it exactly once in every tick.

        A robot without valid readings stops, and so does one whose requested velocity is not a number, as after a fault
        of the odometry. If the robot's own navigation drives to a goal, it avoids obstacles itself, and the twist is
        not sent. A robot that rings stands still, as the rules of the door require, even if the guard would move it
        away.
        """
        twist, points = wanted.twist, self._surroundings.update(facts)
        if not facts.sweep.known_share or not math.isfinite(twist.forward + twist.left + twist.turn):
            twist = STOP
        if wanted.goal is not None:
            self._last = STOP
            return Command(answers=facts.observation.stamp, goal=wanted.goal)
        before, guard = self._last, self._guard
        self._last = guard.brake(before) if wanted.ring else guard.admit(before, twist, points)
        return Command(self._last, wanted.ring, facts.observation.stamp)

    def stop(self, facts: Facts) -> Command:
        """Stop at once, in answer to a tick whose sensors cannot be trusted: the base brakes as hard as it can."""
        self._surroundings.update(facts)
        self._last = STOP
        return Command(answers=facts.observation.stamp)


def reach_of(robot: RobotDescription, settings: SafetySettings) -> float:
    """How far from the sensor points matter to the guard, m: at least so far that the robot can still stop.

    A point that comes within reach is seen a period later at the latest; braking from then on keeps the margin.
    """
    sensor = norm(robot.laser.mount_x, robot.laser.mount_y)
    approach = robot.limits.largest_speed * robot.period + robot.stopping_distance
    return max(settings.reach, sensor + robot.radius + settings.margin + approach)
