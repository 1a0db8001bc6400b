"""A robot's base: a body that takes a velocity within its limits and goes where nothing solid is in the way."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pymunk
from pymunk.autogeometry import convex_decomposition

from sim.maze import Point
from transport.description import Limits, RobotDescription
from transport.messages import STOP, Pose, Twist, wrap_angle


def limited(twist: Twist, limits: Limits) -> Twist:
    """The twist that the base makes of a command: within its speed limits, as the profile says by norm or by axis."""
    forward, left = twist.forward, twist.left
    if limits.translation == "axis":
        forward = min(max(forward, -limits.speed), limits.speed)
        left = min(max(left, -limits.speed), limits.speed)
    else:
        speed = math.hypot(forward, left)
        if speed > limits.speed:
            forward, left = forward * limits.speed / speed, left * limits.speed / speed
    return Twist(forward, left, min(max(twist.turn, -limits.turn_rate), limits.turn_rate))


def approach(twist: Twist, target: Twist, limits: Limits, duration: float) -> Twist:
    """The twist after a while of getting from one velocity to another within the acceleration limits."""
    dx, dy, dw = target.forward - twist.forward, target.left - twist.left, target.turn - twist.turn
    change, most = math.hypot(dx, dy), limits.acceleration * duration
    turn_most = limits.turn_acceleration * duration
    if change <= most and abs(dw) <= turn_most:
        return target
    share = 1.0 if change <= most else most / change
    return Twist(
        twist.forward + share * dx if share < 1.0 else target.forward,
        twist.left + share * dy if share < 1.0 else target.left,
        twist.turn + math.copysign(turn_most, dw) if abs(dw) > turn_most else target.turn,
    )


class Base:
    """A robot's body in a world of solid things."""

    def __init__(self, description: RobotDescription, pose: Pose) -> None:
        self.description = description
        self.radius = description.radius
        self.outline = np.asarray(description.footprint, dtype=np.float64)
        self.body = pymunk.Body(1.0, pymunk.moment_for_poly(1.0, list(description.footprint)))
        self.shapes: list[pymunk.Shape] = [pymunk.Poly(self.body, part) for part in convex_parts(description.footprint)]
        self.put(pose)

    def put(self, pose: Pose) -> None:
        """Place it, at rest."""
        self.body.position = pose.x, pose.y
        self.body.angle = pose.heading
        self.body.velocity = 0.0, 0.0
        self.body.angular_velocity = 0.0
        self.body.velocity_func = pymunk.Body.update_velocity
        self.twist = STOP
        self._steady = True
        self._in_touch = False
        self._wanted: tuple[Point, float] = (0.0, 0.0), 0.0

    @property
    def pose(self) -> Pose:
        """Where it is."""
        x, y = self.body.position
        return Pose(x, y, wrap_angle(self.body.angle))

    def drive(self, target: Twist, duration: float, *, touching: bool) -> None:
        """Set the body's velocity for one step so that a constant twist is followed exactly along its arc.

        The solver moves bodies first and then stops those that touch something. Hence a robot in contact takes its
        velocity between the two, or what stopped it would be forgotten at every step.

        Args:
            target: the velocity to strive for, within the limits.
            duration: length of the step, s.
            touching: whether the robot is in contact with something.
        """
        if self.twist is not target:
            self.twist = approach(self.twist, target, self.description.limits, duration)
            self._steady = False
        if self._steady and not touching:
            return
        twist = self.twist
        half = twist.turn * duration / 2
        chord = 1.0 if abs(half) < 1e-9 else math.sin(half) / half
        middle = self.body.angle + half
        cos, sin = chord * math.cos(middle), chord * math.sin(middle)
        velocity = cos * twist.forward - sin * twist.left, sin * twist.forward + cos * twist.left
        if touching != self._in_touch:
            self._in_touch = touching
            self.body.velocity_func = self._take_wanted if touching else pymunk.Body.update_velocity
        if touching:
            self._wanted = velocity, twist.turn
        else:
            self.body.velocity = velocity
            if self.body.angular_velocity != twist.turn:
                self.body.angular_velocity = twist.turn
        # Straight on at constant speed, the body needs nothing new.
        self._steady = twist is target and twist.turn == 0.0 and not touching

    def _take_wanted(self, body: pymunk.Body, _gravity: object, _damping: float, _duration: float) -> None:
        body.velocity, body.angular_velocity = self._wanted


def convex_parts(footprint: Sequence[Point]) -> list[list[Point]]:
    """A footprint, cut into convex polygons."""
    closed = [*footprint, footprint[0]]
    return [[(float(x), float(y)) for x, y in part[:-1]] for part in convex_decomposition(closed, 0.0)]
