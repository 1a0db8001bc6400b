"""Steering a base that moves in any direction: the heading and the place are kept each by itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from skills.frames import rotated
from skills.settings import SkillSettings
from skills.steering.field import FieldSeeker
from skills.steering.path import OnPath
from skills.steering.speed import speed_ahead
from transport.arithmetic import cos, norm
from transport.description import RobotDescription
from transport.messages import Pose, Twist
from transport.section import Point


@dataclass(frozen=True, slots=True)
class HolonomicSteering:
    """The law of a holonomic base."""

    robot: RobotDescription
    settings: SkillSettings
    sideways: ClassVar[bool] = True

    def along(self, error: float, speed: float, aside: float, ahead: float) -> Twist:
        """Forward at a speed that the way ahead allows, sideways to where the robot should be."""
        motion = self.settings.motion
        forward = speed_ahead(speed, ahead, motion) * max(0.0, cos(2 * error))  # turn first when far off course
        left = 0.0
        if abs(aside) > motion.dead_zone:
            left = max(-motion.lateral_speed, min(motion.lateral_speed, motion.lateral_gain * aside))
        return Twist(*rotated(forward, left, error), motion.heading_gain * error)

    def turn(self, rate: float, spot: Point) -> Twist:
        """Turn, and move to the spot meanwhile."""
        motion = self.settings.motion
        distance = norm(*spot)
        if distance < motion.dead_zone:
            return Twist(turn=rate)
        speed = min(motion.lateral_speed, motion.lateral_gain * distance)
        return Twist(speed * spot[0] / distance, speed * spot[1] / distance, rate)

    def follow(self, path: OnPath, speed: float) -> Twist:
        """The path's speed is fed forward, the distance from it fed back.

        On a tight arc the robot's heading says where it should be: its place is drawn to where the path has that
        heading. Elsewhere the heading is fed back, too.
        """
        gain = self.settings.arc.gain
        if abs(path.curvature) * self.settings.arc.largest_radius > 1 - 1e-9:
            radius = 1 / path.curvature
            x, y = rotated(0.0, path.aside + radius, path.error)
            return Twist(speed + gain * x, gain * (y - radius), speed * path.curvature)
        forward, left = rotated(speed, gain * path.aside, path.error)
        return Twist(forward, left, speed * path.curvature + self.settings.motion.heading_gain * path.error)

    def to_point(self, target: Pose, speed: float) -> Twist:
        """Straight there; the heading is that of the target meanwhile."""
        distance = norm(target.x, target.y)
        share = speed / distance if distance > 0 else 0.0
        return Twist(share * target.x, share * target.y, self.settings.motion.heading_gain * target.heading)

    def away(self, direction: Point, speed: float) -> Twist:
        """In that direction, without turning."""
        return Twist(speed * direction[0], speed * direction[1])

    def seeker(self, speed: float) -> FieldSeeker:
        """Through a potential field."""
        return FieldSeeker(self.robot, self.settings, speed)
