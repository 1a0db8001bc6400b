"""The odometry of a base with three omnidirectional wheels that miscount a little."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim.settings import OdometryNoise
from transport.messages import STOP, Odometry, Pose, Twist, wrap_angle

WHEEL_DIRECTIONS = (0.0, math.tau / 3, 2 * math.tau / 3)
"""Where the wheels stand about the robot's origin, rad."""


def wheel_matrix(lever: float) -> NDArray[np.float64]:
    """From forward, left and turning motion to the motion of the three wheels' rims, shape (3, 3).

    Args:
        lever: distance of the wheels from the robot's origin, m.
    """
    return np.array([[-math.sin(a), math.cos(a), lever] for a in WHEEL_DIRECTIONS])


def displacement(before: Pose, after: Pose) -> Twist:
    """The constant motion in the robot's own frame that leads from one pose to the other, in metres and radians.

    The logarithm in SE(2): with theta the turn, the chord is divided by sin(theta/2) / (theta/2) and turned back by
    theta/2.
    """
    turn = wrap_angle(after.heading - before.heading)
    dx, dy = after.x - before.x, after.y - before.y
    middle = before.heading + turn / 2
    stretch = 1.0 if abs(turn) < 1e-9 else (turn / 2) / math.sin(turn / 2)
    cos, sin = math.cos(middle) * stretch, math.sin(middle) * stretch
    return Twist(cos * dx + sin * dy, cos * dy - sin * dx, turn)


def moved(pose: Pose, motion: Twist) -> Pose:
    """The pose after a constant motion in the robot's own frame; the inverse of `displacement`."""
    half = motion.turn / 2
    shrink = 1.0 if abs(half) < 1e-9 else math.sin(half) / half
    cos, sin = math.cos(pose.heading + half) * shrink, math.sin(pose.heading + half) * shrink
    return Pose(
        pose.x + cos * motion.forward - sin * motion.left,
        pose.y + sin * motion.forward + cos * motion.left,
        wrap_angle(pose.heading + motion.turn),
    )


class WheelOdometry:
    """Adds up what the wheels count; its frame is placed at random and drifts."""

    def __init__(self, noise: OdometryNoise, generator: np.random.Generator) -> None:
        self._noise, self._generator = noise, generator
        self._wheels = wheel_matrix(noise.lever)
        self._inverse = np.linalg.inv(self._wheels)
        spread = noise.start_spread
        x, y, heading = generator.uniform((-spread, -spread, -math.pi), (spread, spread, math.pi)).tolist()
        self._pose = Pose(x, y, heading)
        self._twist = STOP
        self._counted = self._draw()
        self._next_draw = noise.redraw

    def _draw(self) -> list[list[float]]:
        """The map from true to counted motion: through the wheels, each by its own factor, and back."""
        factors = 1.0 + self._generator.uniform(-self._noise.scale, self._noise.scale, 3)
        counted: list[list[float]] = (self._inverse @ (factors[:, None] * self._wheels)).tolist()
        return counted

    def reading(self, stamp: int) -> Odometry:
        """What the odometry says now.

        Args:
            stamp: time of the measurement, ns.
        """
        return Odometry.at(stamp, self._pose, self._twist)

    def jump(self, jump: Twist) -> None:
        """Be moved at once, in the robot's own frame, metres and radians: a fault, not a motion."""
        self._pose = moved(self._pose, jump)

    def stand(self) -> None:
        """Tell of a robot that stands, having been carried somewhere without its wheels turning."""
        self._twist = STOP

    def count(self, motion: Twist, duration: float, time: float) -> None:
        """Add a motion.

        Args:
            motion: the true motion in the robot's frame, metres and radians.
            duration: how long it took, s.
            time: simulated time at its end, s.
        """
        if self._noise.slip:
            forward, left, turn = (1.0 + self._noise.slip * self._generator.standard_normal(3)).tolist()
            motion = Twist(forward * motion.forward, left * motion.left, turn * motion.turn)
        forward, left, turn = (a * motion.forward + b * motion.left + c * motion.turn for a, b, c in self._counted)
        self._pose = moved(self._pose, Twist(forward, left, turn))
        self._twist = Twist(forward / duration, left / duration, turn / duration)
        if time >= self._next_draw - 1e-9:
            self._counted = self._draw()
            self._next_draw += self._noise.redraw
