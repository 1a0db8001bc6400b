"""The way to a point through a potential field: the target draws the robot, walls and obstacles push it off."""

from __future__ import annotations

from perception.facts import Facts, turned
from skills.frames import rotated
from skills.settings import SkillSettings
from skills.sides import Side
from skills.steering.round import in_the_way, shorter_way
from transport.arithmetic import atan2, cos, norm, norms
from transport.description import RobotDescription
from transport.messages import Twist
from transport.section import Point


class FieldSeeker:
    """Drives with the sum of the target's pull and the walls' push, and looks at the target meanwhile.

    An obstacle pushes the robot towards the side with the shorter detour, not back.
    """

    def __init__(self, robot: RobotDescription, settings: SkillSettings, speed: float) -> None:
        self._robot, self._settings, self._speed = robot, settings, speed
        self._round: Side | None = None

    def towards(self, facts: Facts, target: Point) -> Twist:
        """The next velocity on the way to a target in the robot's frame, m."""
        distance, bearing = norm(*target), atan2(target[1], target[0])
        forward, left = self._field(facts, distance, bearing)
        return Twist(
            forward,
            left,
            self._settings.motion.heading_gain * bearing if distance > self._settings.target.faced else 0.0,
        )

    def _field(self, facts: Facts, distance: float, bearing: float) -> tuple[float, float]:
        """The velocity that target and walls make together, in the robot's frame, m/s."""
        drawn = min(self._speed, max(self._settings.target.arrival, self._settings.motion.lateral_gain * distance))
        facing = max(0.0, cos(bearing))  # the laser does not see what is behind: turn first
        drawn *= facing
        share = facing * min(1.0, distance / self._settings.target.near)
        back, aside = share * facts.repulsion.forward, share * facts.repulsion.left
        points = turned(facts.points[norms(*facts.points.T) < distance], -bearing)
        nearest = in_the_way(points, self._robot, distance, self._settings.passage)
        if nearest is None:
            self._round = None
        else:
            self._round = self._round or shorter_way(facts, points, nearest, self._settings.passage)
            aside += self._round.sign * min(-back, self._speed)
        to_target = rotated(drawn, 0.0, bearing)
        return to_target[0] + back, to_target[1] + aside
