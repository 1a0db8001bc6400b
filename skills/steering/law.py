"""The interface of steering laws, and the law of each base."""

from __future__ import annotations

from typing import Protocol

from perception.facts import Facts
from skills.settings import SkillSettings
from skills.steering.differential import DifferentialSteering
from skills.steering.holonomic import HolonomicSteering
from skills.steering.path import OnPath
from transport.base import Differential, Holonomic
from transport.description import RobotDescription
from transport.messages import Pose, Twist
from transport.section import Point


class Seeker(Protocol):
    """The way to a point past what is between; it remembers by which side it rounds something."""

    def towards(self, facts: Facts, target: Point) -> Twist:
        """The next velocity on the way to a target in the robot's frame, m."""
        ...


class Steering(Protocol):
    """A law of steering."""

    @property
    def sideways(self) -> bool:
        """Whether the base can move aside without driving on."""
        ...

    def along(self, error: float, speed: float, aside: float, ahead: float) -> Twist:
        """Drive along a course.

        Args:
            error: how far to turn to be on course, rad.
            speed: wanted speed, m/s.
            aside: how far to the left the robot should be, m.
            ahead: free way in front of the robot's centre, m; 0 where something beside the way holds the robot up.
        """
        ...

    def turn(self, rate: float, spot: Point) -> Twist:
        """Turn on a spot.

        Args:
            rate: of rotation, rad/s.
            spot: where the turn is to be, in the robot's frame, m.
        """
        ...

    def follow(self, path: OnPath, speed: float) -> Twist:
        """Follow a path at a speed (m/s)."""
        ...

    def to_point(self, target: Pose, speed: float) -> Twist:
        """Go straight to a point.

        Args:
            target: in the robot's frame, with the heading that a robot has there which can go there in any heading.
            speed: m/s.
        """
        ...

    def away(self, direction: Point, speed: float) -> Twist:
        """Move in a direction, a unit vector in the robot's frame, without regard to the heading, at a speed (m/s)."""
        ...

    def seeker(self, speed: float) -> Seeker:
        """The way to a point past obstacles at a speed (m/s)."""
        ...


def steering_of(robot: RobotDescription, settings: SkillSettings) -> Steering:
    """The law of a robot's base."""
    match robot.base:
        case Holonomic():
            return HolonomicSteering(robot, settings)
        case Differential():
            return DifferentialSteering(robot, settings)
