"""A robot's body and base: it takes a velocity within its limits and goes where nothing solid is in the way."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pymunk
from pymunk.autogeometry import convex_decomposition

from sim.maze import Point
from transport.description import RobotDescription
from transport.messages import STOP, Pose, Twist, wrap_angle


class Body:
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
            self.twist = self.description.towards(self.twist, target, duration)
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
