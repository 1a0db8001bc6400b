"""A robot's body and base: it follows a velocity within its limits until something solid stops it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pymunk
from pymunk.autogeometry import convex_decomposition

from sim.maze import Point
from transport.arithmetic import chord_over_arc, cos_sin
from transport.base import Holonomic, reached
from transport.compiled import compiled
from transport.description import RobotDescription
from transport.messages import STOP, Pose, Twist, wrap_angle

Placed = tuple[float, float, float]


class Body:
    """A robot's body in a world of solid things."""

    def __init__(self, description: RobotDescription, pose: Pose) -> None:
        self.description = description
        self.radius = description.radius
        self.outline = np.asarray(description.footprint, dtype=np.float64)
        self.body = pymunk.Body(1.0, pymunk.moment_for_poly(1.0, list(description.footprint)))
        # Chipmunk would turn the shapes by the C library's sine, which differs from processor to processor. So its body
        # never turns; the shapes do.
        self._polygons = [pymunk.Poly(self.body, part) for part in convex_parts(description.footprint)]
        self.shapes: list[pymunk.Shape] = [*self._polygons]
        self._corners = [polygon.get_vertices() for polygon in self._polygons]
        self.heading = 0.0
        self._glided_to: Point | None = None  # where the physics has not put it since
        self.put(pose)

    def put(self, pose: Pose) -> None:
        """Place it, at rest."""
        self.body.position = pose.x, pose.y
        self._glided_to = pose.x, pose.y
        self.heading = pose.heading
        self._turn_shapes()
        self.body.velocity = 0.0, 0.0
        self.body.angular_velocity = 0.0
        self.body.velocity_func = pymunk.Body.update_velocity
        self.body.position_func = pymunk.Body.update_position
        self._turning = False
        self._half, self._chord = 0.0, 1.0
        self.twist = STOP
        self._steady = True
        self._in_touch = False
        self._shapes_behind = False
        self._wanted: tuple[Point, float] = (0.0, 0.0), 0.0

    @property
    def pose(self) -> Pose:
        """Where it is."""
        return Pose(*self.place, wrap_angle(self.heading))

    @property
    def place(self) -> Point:
        """The place of its origin, m."""
        if self._glided_to is not None:
            return self._glided_to
        x, y = self.body.position
        return x, y

    def drive(self, target: Twist, duration: float, *, touching: bool) -> None:
        """Set the body's velocity for one step so that a constant twist is followed exactly along its arc.

        The solver moves bodies first and then stops those that touch something. Hence a robot in contact takes its
        velocity between the two, or what stopped it would be forgotten at every step.

        Args:
            target: the velocity to strive for, within the limits.
            duration: length of the step, s.
            touching: whether the robot is in contact with something.
        """
        if self._shapes_behind:
            self.body.position = self.place
            self._turn_shapes()
        self._glided_to = None
        if self.twist is not target:
            self.twist = self.description.towards(self.twist, target, duration)
            self._steady = False
        if self._steady and not touching:
            return
        twist = self.twist
        half = twist.turn * duration / 2
        if half != self._half:
            self._half, self._chord = half, chord_over_arc(half)
        chord = self._chord
        cos, sin = cos_sin(self.heading + half)
        cos, sin = chord * cos, chord * sin
        velocity = cos * twist.forward - sin * twist.left, sin * twist.forward + cos * twist.left
        if touching != self._in_touch:
            self._in_touch = touching
            self.body.velocity_func = self._take_wanted if touching else pymunk.Body.update_velocity
        turning = touching or twist.turn != 0.0
        if turning != self._turning:
            self._turning = turning
            self.body.position_func = self._move if turning else pymunk.Body.update_position
        if touching:
            self._wanted = velocity, twist.turn
        else:
            self.body.velocity = velocity
            if self.body.angular_velocity != twist.turn:
                self.body.angular_velocity = twist.turn
        # Straight on at constant speed, the body needs nothing new.
        self._steady = twist is target and twist.turn == 0.0 and not touching

    def glide(self, target: Twist, duration: float, steps: int) -> None:
        """Follow a velocity for some steps where nothing can be touched: the same motion as the physics makes of it.

        Args:
            target: the velocity to strive for, within the limits.
            duration: length of a step, s.
            steps: how many.
        """
        place, description, wanted = (*self.place, self.heading), self.description, _parts(target)
        if isinstance(description.base, Holonomic):
            changes = description.base.changes(description.limits, duration)
            place, velocity, arrived = glided(place, (_parts(self.twist), wanted), changes, duration, steps)
            self.twist = target if arrived else Twist(*velocity)
        else:
            while steps:
                self.twist = description.towards(self.twist, target, duration)
                alike = steps if self.twist is target else 1
                place = follow_arc(place, _parts(self.twist), duration, alike)
                steps -= alike
        x, y, self.heading = place
        self._glided_to = x, y
        self._shapes_behind, self._steady = True, False  # the physics is given the place once it moves the body itself

    def _take_wanted(self, body: pymunk.Body, _gravity: object, _damping: float, _duration: float) -> None:
        body.velocity, body.angular_velocity = self._wanted

    def _move(self, body: pymunk.Body, duration: float) -> None:
        pymunk.Body.update_position(body, duration)
        if body.angle:
            self.heading += body.angle
            body.angle = 0.0
            self._turn_shapes()

    def _turn_shapes(self) -> None:
        self._shapes_behind = False
        cos, sin = cos_sin(self.heading)
        for polygon, corners in zip(self._polygons, self._corners, strict=True):
            polygon.unsafe_set_vertices([(cos * x - sin * y, sin * x + cos * y) for x, y in corners])


@compiled
def follow_arc(place: Placed, velocity: Placed, duration: float, steps: int) -> Placed:
    """Where a constant velocity carries a robot, step by step as Chipmunk adds it up.

    Args:
        place: x and y in m, heading in rad.
        velocity: forward and to the left in m/s, turn in rad/s, in the robot's frame.
        duration: length of a step, s.
        steps: how many.

    Returns:
        The place at the end.
    """
    (x, y, heading), (forward, left, turn) = place, velocity
    half = turn * duration / 2
    chord = chord_over_arc(half)
    for _ in range(steps):
        cos, sin = cos_sin(heading + half)
        cos, sin = chord * cos, chord * sin
        x += (cos * forward - sin * left) * duration
        y += (sin * forward + cos * left) * duration
        heading += turn * duration
    return x, y, heading


def _parts(twist: Twist) -> Placed:
    return twist.forward, twist.left, twist.turn


@compiled
def glided(
    place: Placed, velocities: tuple[Placed, Placed], changes: tuple[float, float], duration: float, steps: int
) -> tuple[Placed, Placed, bool]:
    """Where a holonomic base is that gets from one velocity to another, and then keeps it.

    Args:
        place: x and y in m, heading in rad.
        velocities: the present one and the one to strive for, within the limits: forward and to the left in m/s, turn
            in rad/s, in the robot's frame.
        changes: the largest changes of translation and rotation in a step, m/s and rad/s.
        duration: length of a step, s.
        steps: how many.

    Returns:
        The place and the velocity at the end, and whether that is the wanted one.
    """
    twist, target = (Twist(*velocity) for velocity in velocities)
    while steps:
        twist = reached(twist, target, changes)
        alike = steps if twist is target else 1
        place = follow_arc(place, _parts(twist), duration, alike)
        steps -= alike
    return place, _parts(twist), twist is target


def convex_parts(footprint: Sequence[Point]) -> list[list[Point]]:
    """A footprint, cut into convex polygons."""
    closed = [*footprint, footprint[0]]
    return [[(float(x), float(y)) for x, y in part[:-1]] for part in convex_decomposition(closed, 0.0)]
