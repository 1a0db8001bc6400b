"""Turning a corner along a circle, the way of the 2015 robot."""

from __future__ import annotations

import math

from hsm.model.registry import Outcome
from hsm.model.types import Speed
from perception.facts import Facts
from skills.activities.rotate import Rotate
from skills.activities.to_opening import ToOpening
from skills.course import TRUSTED
from skills.frames import Frame, Turned
from skills.library import LIBRARY
from skills.motion import BLOCKED, DONE, Headway
from skills.sides import Side
from skills.steering import OnPath
from transport.arithmetic import atan2, norm
from transport.messages import Command, Pose, wrap_angle

QUARTER = math.pi / 2
CLOSE = 0.35
"""With less than this left to turn the compass says where the turn ends, rad."""


@LIBRARY.activity("arc", outcomes=("done", "blocked"), holds=("base",))
class Arc(ToOpening):
    """Turn into the opening on one side while driving on.

    The distances to the opening's corners give the radius of a quarter circle. The circle ends in the middle of the
    opening or, in a wide opening, at the usual distance of a wall from the corner. At its beginning a local frame is
    set in the odometry. The speed along the circle is fed forward, and the deviation from it is fed back: from the
    position for the angle turned, or, if the base cannot move sideways, from the circle. A turn that has begun is
    always completed, on the spot if necessary. A robot that cannot move sideways also turns on the spot if it cannot
    reach the beginning of the circle. Outcomes: `done`; `blocked` when the robot does not reach the opening, or cannot
    turn.
    """

    def __init__(self, side: Side = Side.RIGHT, speed: Speed = 0.5) -> None:
        super().__init__(side, speed)
        self._circle: _Circle | None = None
        self._on_the_spot = False
        self._instead: Rotate | None = None

    def tick(self, facts: Facts) -> Command | Outcome:
        """The next velocity."""
        if self._instead is not None:
            return self._instead.tick(facts)
        if self._headway.lost(facts):
            if self._circle is None and not self.steering(facts).sideways:
                self._instead = Rotate(self._side.sign * QUARTER)
                return self._instead.tick(facts)
            if self._circle is None or self._on_the_spot:
                return BLOCKED
            self._on_the_spot, self._headway = True, Headway()
        if self._circle is not None:
            return self._along_the_circle(facts, self._circle)
        return self._to_the_circle(facts)

    def _to_the_circle(self, facts: Facts) -> Command | Outcome:
        """Drive straight on to where the circle begins."""
        smallest, largest = self.settings.arc.smallest_radius, self.settings.arc.largest_radius
        approach = self._approach(facts, self.settings.wall.distance, smallest)
        radius = min(max(min(approach.left, approach.beside), smallest), largest)
        if approach.left > radius + 0.02:
            return self._straight_on(facts, approach, self._speed)
        pose = facts.observation.odometry.pose
        frame = Frame(Pose(pose.x, pose.y, pose.heading + approach.error))
        self._circle = _Circle(frame, radius, self._side, pose.heading)
        return self._along_the_circle(facts, self._circle)

    def _along_the_circle(self, facts: Facts, circle: _Circle) -> Command | Outcome:
        """Feed the path's speed forward, and the distance from the path back."""
        pose = facts.observation.odometry.pose
        turned = circle.turned(pose)
        left = QUARTER - turned
        misalignment = facts.compass.misalignment * self._side.sign
        if abs(left) < CLOSE and facts.compass.known and abs(misalignment - left) < TRUSTED:
            left = misalignment
        if left < self.settings.arc.tolerance:
            return DONE
        steering = self.steering(facts)
        if self._on_the_spot:
            return Command(steering.turn(self._side.sign * self.settings.rotate.rate, (0.0, 0.0)))
        rate = min(self._speed / circle.radius, facts.robot.limits.turn_rate, self.settings.arc.turn_gain * left)
        return Command(steering.follow(circle.seen_from(pose), rate * circle.radius))


class _Circle:
    """A quarter circle to a side, in a frame at its beginning with x along the course."""

    def __init__(self, frame: Frame, radius: float, side: Side, heading: float) -> None:
        self.frame = frame
        self.radius = radius
        self._sign = side.sign
        self._before = (frame.origin.heading - heading) * side.sign
        self._turned = Turned(heading)

    def turned(self, pose: Pose) -> float:
        """The angle turned from the course to the side, rad."""
        return self._turned.update(pose.heading) * self._sign - self._before

    def seen_from(self, pose: Pose) -> OnPath:
        """The circle where the robot is beside it: in its direction from the centre."""
        here = self.frame.local(pose)
        x, y = here.x, here.y - self._sign * self.radius
        angle = atan2(x, -self._sign * y)
        error = wrap_angle(self._sign * angle - here.heading)
        return OnPath(self._sign * (norm(x, y) - self.radius), error, self._sign / self.radius)
