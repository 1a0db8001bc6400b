"""Odometry with wheels that miscount slightly and may slip: three omnidirectional ones, or two on an axle."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.settings import OdometryNoise
from transport.arithmetic import chord_over_arc, cos_sin, normals
from transport.base import Base, Differential, Holonomic, integrate
from transport.messages import STOP, Odometry, Pose, Twist, wrap_angle

Floats = NDArray[np.float64]

WHEEL_DIRECTIONS = (0.0, math.tau / 3, 2 * math.tau / 3)
"""Where the wheels are about the robot's origin, rad."""


@dataclass(frozen=True, slots=True)
class Wheels:
    """The kinematics of a base's wheels.

    Attributes:
        rims: from forward, left and turning motion to the motion of the wheels' rims, shape (wheels, 3).
        motion: from the rims' motion to that of the robot, shape (3, wheels).
    """

    rims: Floats
    motion: Floats

    def counted(self, factors: Floats) -> list[list[float]]:
        """The map from true to counted motion: through the wheels, each by its own factor, and back."""
        counted: list[list[float]] = (self.motion[:, :, None] * (factors[:, None] * self.rims)).sum(axis=1).tolist()
        return counted


def wheels_of(base: Base, lever: float) -> Wheels:
    """The wheels of a base.

    Args:
        base: a holonomic base has three omnidirectional wheels; a differential one rolls on two and does not
            notice what moves it sideways.
        lever: distance of the three wheels from the robot's origin, m.
    """
    match base:
        case Holonomic():
            rims = np.array([[-sin, cos, lever] for cos, sin in map(cos_sin, WHEEL_DIRECTIONS)])
            return Wheels(rims, _inverse(rims))
        case Differential(track=track):
            rims = np.array([[1.0, 0.0, -track / 2], [1.0, 0.0, track / 2]])
            return Wheels(rims, np.array([[0.5, 0.5], [0.0, 0.0], [-1.0 / track, 1.0 / track]]))


def _inverse(matrix: Floats) -> Floats:
    """The inverse of a matrix of shape (3, 3), by its adjugate: the same bits on every processor."""
    (a, b, c), (d, e, f), (g, h, i) = matrix.tolist()
    adjugate = [
        [e * i - f * h, c * h - b * i, b * f - c * e],
        [f * g - d * i, a * i - c * g, c * d - a * f],
        [d * h - e * g, b * g - a * h, a * e - b * d],
    ]
    (first, *_), (second, *_), (third, *_) = adjugate
    determinant = a * first + b * second + c * third
    return np.array([[entry / determinant for entry in row] for row in adjugate])


def displacement(before: Pose, after: Pose) -> Twist:
    """The constant motion in the robot's own frame that leads from one pose to the other, in metres and radians.

    The logarithm in SE(2): with theta the turn, the chord is divided by sin(theta/2) / (theta/2) and turned back by
    theta/2.
    """
    turn = wrap_angle(after.heading - before.heading)
    dx, dy = after.x - before.x, after.y - before.y
    middle = before.heading + turn / 2
    stretch = 1.0 / chord_over_arc(turn / 2)
    cos, sin = cos_sin(middle)
    cos, sin = cos * stretch, sin * stretch
    return Twist(cos * dx + sin * dy, cos * dy - sin * dx, turn)


def moved(pose: Pose, motion: Twist) -> Pose:
    """The pose after a constant motion in the robot's own frame, metres and radians; the inverse of `displacement`."""
    return integrate(pose, motion, 1.0)


class WheelOdometry:
    """Adds up what the wheels count; its frame is placed at random and drifts."""

    def __init__(self, base: Base, noise: OdometryNoise, generator: np.random.Generator) -> None:
        self._noise, self._generator = noise, generator
        self._wheels = wheels_of(base, noise.lever)
        spread = noise.start_spread
        x, y, heading = generator.uniform((-spread, -spread, -math.pi), (spread, spread, math.pi)).tolist()
        self._pose = Pose(x, y, heading)
        self._twist = STOP
        self._factors = self._draw()
        self._counted = self._wheels.counted(self._factors)
        self._next_draw = noise.redraw

    def _draw(self) -> Floats:
        """The error factor of each wheel."""
        scale = self._noise.scale
        return 1.0 + self._generator.uniform(-scale, scale, len(self._wheels.rims))

    def reading(self, stamp: int) -> Odometry:
        """The current odometry.

        Args:
            stamp: time of the measurement, ns.
        """
        return Odometry.at(stamp, self._pose, self._twist)

    def jump(self, jump: Twist) -> None:
        """Jump, in the robot's own frame, metres and radians: a fault, not a motion."""
        self._pose = moved(self._pose, jump)

    def stand(self) -> None:
        """Report that the robot was carried somewhere without its wheels turning."""
        self._twist = STOP

    def count(self, motion: Twist, duration: float, time: float) -> None:
        """Add a motion.

        Args:
            motion: the true motion in the robot's frame, metres and radians.
            duration: how long it took, s.
            time: simulated time at its end, s.
        """
        counted = self._counted
        if self._noise.slip:
            slips = 1.0 + self._noise.slip * normals(self._generator, len(self._factors))
            counted = self._wheels.counted(slips * self._factors)
        forward, left, turn = (a * motion.forward + b * motion.left + c * motion.turn for a, b, c in counted)
        self._pose = moved(self._pose, Twist(forward, left, turn))
        self._twist = Twist(forward / duration, left / duration, turn / duration)
        if time >= self._next_draw - 1e-9:
            self._factors = self._draw()
            self._counted = self._wheels.counted(self._factors)
            self._next_draw += self._noise.redraw
