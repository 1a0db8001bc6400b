"""Steering a base on two wheels: to get aside the robot turns its heading, and drives."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from skills.settings import SkillSettings
from skills.steering.gaps import GapSeeker
from skills.steering.path import OnPath
from skills.steering.speed import speed_ahead
from transport.arithmetic import atan2, cos, norm
from transport.description import RobotDescription
from transport.messages import Pose, Twist
from transport.section import Point

SLANT = math.radians(20)
"""The robot slants at most this much to its course to get aside, rad."""
STEEPEST = math.radians(80)
"""The same where something ahead holds it up, rad."""
BESIDE = math.radians(40)
"""The same where something beside its way does, rad: farther round, the walls on its side would be those ahead."""
SIDEWAYS = 0.5
"""A direction of which less than this is along the robot's axis is one to its side."""

BLIND = 0.3
"""It moves forward also where this much of a direction is backward: behind it sees nothing."""
CREEP = 0.4
"""Share of the speed with which it moves away to a side: on the spot its rear would swing to what it leaves."""


@dataclass(frozen=True, slots=True)
class DifferentialSteering:
    """The law of a base on two wheels."""

    robot: RobotDescription
    settings: SkillSettings
    sideways: ClassVar[bool] = False

    def along(self, error: float, speed: float, aside: float, ahead: float) -> Twist:
        """Forward, slanted to the course so that the robot gets to where it should be in a time.

        With the heading gain g and that time T the distance falls as a damped oscillation of damping ratio
        ``sqrt(g * T) / 2``: without overshoot from g * T = 4 on, with less than one per cent from 3 on.
        """
        motion = self.settings.motion
        forward = speed_ahead(speed, ahead, motion)
        left = max(-motion.lateral_speed, min(motion.lateral_speed, aside / motion.settle)) if speed > 0 else 0.0
        # Held up by what is ahead, it turns as far as it takes to get by.
        held_up = forward < speed and abs(aside) > motion.needed
        steepest = self._steepest(aside, ahead) if held_up else SLANT
        slant = max(-steepest, min(steepest, atan2(left, forward))) if forward > 0 or held_up else 0.0
        error += slant
        allowed = norm(forward, left) if held_up else forward
        return Twist(allowed * max(0.0, cos(2 * error)), 0.0, motion.heading_gain * error)

    def _steepest(self, aside: float, ahead: float) -> float:
        """How far it slants to get past what holds it up, rad; less than half in its lane, that is beside it."""
        return STEEPEST if ahead > 0 and abs(aside) > self.robot.half_width else BESIDE

    def turn(self, rate: float, spot: Point) -> Twist:
        """First back or forward to the spot, then turn about the axle."""
        motion = self.settings.motion
        if abs(spot[0]) < motion.dead_zone:
            return Twist(turn=rate)
        return Twist(max(-motion.to_spot_speed, min(motion.to_spot_speed, motion.to_spot_gain * spot[0])))

    def follow(self, path: OnPath, speed: float) -> Twist:
        """As fast as the path's curvature allows, with heading and distance fed back."""
        motion = self.settings.motion
        sharpest = self.robot.limits.turn_rate / abs(path.curvature) if path.curvature else math.inf
        allowed = min(speed, sharpest)
        way = motion.settle * allowed
        error = path.error + (max(-SLANT, min(SLANT, atan2(path.aside, way))) if way > 0 else 0.0)
        forward = allowed * max(0.0, cos(2 * error))
        # On a circle beside the path's own the same angle is another way.
        nearer = max(0.5, 1 + path.aside * path.curvature)
        return Twist(forward, 0.0, forward * path.curvature / nearer + motion.heading_gain * error)

    def to_point(self, target: Pose, speed: float) -> Twist:
        """Turn to it and drive there."""
        bearing = atan2(target.y, target.x)
        return Twist(speed * max(0.0, cos(2 * bearing)), 0.0, self.settings.motion.heading_gain * bearing)

    def away(self, direction: Point, speed: float) -> Twist:
        """Forward or back; where the direction is to a side, along an arc that leads there."""
        if abs(direction[0]) >= SIDEWAYS:
            return Twist(math.copysign(speed, direction[0]))
        ahead = math.copysign(1.0, direction[0] + BLIND)
        bearing = atan2(ahead * direction[1], ahead * direction[0])
        return Twist(ahead * CREEP * speed, 0.0, self.settings.motion.heading_gain * bearing)

    def seeker(self, speed: float) -> GapSeeker:
        """Through gaps between obstacles."""
        return GapSeeker(self.robot, self.settings, self, speed)
