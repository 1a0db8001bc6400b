"""The guard: every command keeps the robot's outline away from the walls, and it can always stop."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from skills.giving_way import alternatives
from skills.outline import Box, Outline, from_core, least_clearance
from skills.settings import SafetySettings
from skills.surroundings import Points
from transport.arithmetic import norm, norms
from transport.base import Holonomic, integrate, reached
from transport.compiled import compiled
from transport.description import RobotDescription
from transport.messages import STOP, Pose, Twist

SOFT = 0.02
"""Depth within the margin at which the robot moves away with the usual push, m."""
HARDEST = 4.0
"""The push grows with the depth, up to this many times the usual one: retreat faster than an approaching obstacle."""
OPPOSITE = 0.9
"""Cosine of the angle within which a point is opposite to another; the other wall of a corner is not."""

SHORT = 2 / 7
"""Share of that way by which a passage ends before what is ahead."""
BESIDE = 0.7
"""Of the direction to what is beside the robot at least this is sideways."""
SAME = 1e-9
"""Two distances that differ by less are the same, m."""

STANDING = np.zeros((1, 3))
"""The pose of a robot that stays where it is."""


class CollisionGuard:
    """Reduces or redirects a command that would bring the outline within the margin of a wall.

    A command is admitted if the robot, having followed it for one period and braking hard from then on, keeps its
    margin all the way. So there is always a command left that is safe: to brake. The outline is a rounded box, which is
    never nearer to a wall than it says. What is within the box, as the end of a thin wall in the robot's hollow front,
    the robot backs away from.

    A round robot turns on the spot anywhere, for a turn brings it nearer to nothing. One that cannot move
    sideways gets away from a wall beside it only by driving on while it turns, in which its rear corner, if it has one,
    comes nearer to that wall; nor can it first make room for a turn on the spot. So it may spend a little of its margin
    on these two, and on nothing else; once only, where it has no corners.
    """

    def __init__(self, robot: RobotDescription, settings: SafetySettings) -> None:
        self._robot = robot
        self._settings = settings
        self._outline = Outline(robot.footprint)
        self._sideways = isinstance(robot.base, Holonomic)
        (middle, _), (half, side) = self._outline.middle.tolist(), self._outline.half.tolist()
        self._beside = (middle - half, middle + half, side, settings.foresee)

    def admit(self, before: Twist, wanted: Twist, points: Points) -> Twist:
        """The command nearest to the wanted one that is safe and within the robot's limits.

        Args:
            before: the command of the last period.
            wanted: what a skill asks for.
            points: what is near, in the robot's frame, m, shape (n, 2).
        """
        reachable = self._reachable(before, wanted)
        if not len(points):
            return reachable
        now, margin = self._margin(points)
        if now >= margin and self._clearance_in_stopping(points, reachable) >= margin:
            return reachable
        apart, distance = self._outline.apart(points)
        away = -apart[int(distance.argmin())] if now > 0 else self._outline.out_of(points)
        x, y = (away / max(norm(*away.tolist()), 1e-9)).tolist()
        keep = min(margin, now if now > 0 else self.clearance(points, STANDING))
        pressed = min(HARDEST, max(0.0, margin - now) / SOFT)
        others = alternatives(self._robot.base, wanted, (x, y), self._settings.push, pressed)
        as_wanted = wanted.turn and (not self._sideways or (self._outline.is_round and not wanted.speed))
        for other in chain((wanted,), others) if as_wanted else others:
            reachable = self._reachable(before, other)
            if self._clearance_in_stopping(points, reachable) >= self._least(reachable, keep, margin, y):
                return reachable
        return self.brake(before)

    def brake(self, before: Twist) -> Twist:
        """The command nearest to standing still that is within the robot's limits."""
        return self._robot.towards(before, STOP, self._robot.period)

    def _reachable(self, before: Twist, wanted: Twist) -> Twist:
        """The command nearest to a wanted one that is within the robot's limits."""
        return self._robot.towards(before, self._robot.limited(wanted), self._robot.period)

    def _least(self, twist: Twist, keep: float, margin: float, away: float) -> float:
        """The distance that a command must keep, m.

        Args:
            twist: the command.
            keep: what is kept now, up to the margin, m.
            margin: m.
            away: how much of the direction away from what is nearest is to the left.
        """
        settings = self._settings
        turns_away = not self._sideways and abs(away) > BESIDE and twist.turn * away > 0 and twist.forward >= 0
        if turns_away and not self._outline.is_round:
            return min(keep, max(keep - settings.turn_away, settings.least_margin / 2))
        if turns_away or (not self._sideways and not twist.forward):
            return min(keep, max(margin - settings.turn_away, settings.least_margin)) - SAME
        return keep - SAME

    def margin(self, points: Points) -> float:
        """The distance to keep from the walls, m: less where they leave less room."""
        return self._margin(points)[1]

    def _margin(self, points: Points) -> tuple[float, float]:
        """The distance of the nearest point from the outline, and the distance to keep, m.

        One margin is for the passage between the left and the right, up to a little ahead. Another one is between the
        nearest point and what is opposite to it, at any heading of the robot. The smaller one counts.
        """
        now, ahead, across = looked_round(points, self._outline.box, self._beside)
        return now, min(self._margin_for(ahead - 2 * self._beside[2]), self._margin_for(across))

    def clearance(self, points: Points, poses: NDArray[np.float64]) -> float:
        """Smallest distance from any of the points to the outline at any of the poses, m; negative within it."""
        return self._outline.clearance(points, poses)

    def _margin_for(self, room: float) -> float:
        """The margin where the robot has this much room (m) besides itself."""
        return min(self._settings.margin, max(self._settings.least_margin, room / 2 - self._settings.spare))

    def _clearance_in_stopping(self, points: Points, twist: Twist) -> float:
        """The clearance of a robot that follows a twist for a period and then brakes, period by period."""
        period, base = self._robot.period, self._robot.base
        if isinstance(base, Holonomic):
            velocity, changes = (twist.forward, twist.left, twist.turn), base.changes(self._robot.limits, period)
            return clearance_in_stopping(points, self._outline.box, velocity, period, changes)
        return self.clearance(points, _followed(twist, period, self.brake))


def _followed(twist: Twist, period: float, brake: Callable[[Twist], Twist]) -> NDArray[np.float64]:
    """The poses after each period, the first one with a twist, each further one braked again, shape (k, 3)."""
    pose, poses = Pose(), []
    while twist != STOP:
        pose = integrate(pose, twist, period)
        poses.append((pose.x, pose.y, pose.heading))
        twist = brake(twist)
    return np.asarray(poses or [(0.0, 0.0, 0.0)])


@compiled
def stopping(velocity: tuple[float, float, float], period: float, changes: tuple[float, float]) -> NDArray[np.float64]:
    """The poses of a holonomic robot after a period and after each period of braking, shape (k, 3).

    Args:
        velocity: forward and to the left, m/s, and turn, rad/s.
        period: s.
        changes: the largest of translation and rotation in a period, m/s and rad/s, positive.
    """
    return _followed(Twist(*velocity), period, lambda twist: reached(twist, STOP, changes))


@compiled
def clearance_in_stopping(
    points: Points, box: Box, velocity: tuple[float, float, float], period: float, changes: tuple[float, float]
) -> float:
    """`least_clearance` at the poses of `stopping`, m; the arguments are theirs."""
    return least_clearance(points, stopping(velocity, period, changes), box)


@compiled
def looked_round(points: Points, box: Box, bounds: tuple[float, float, float, float]) -> tuple[float, float, float]:
    """The distance of the nearest point from the outline, `room_ahead` and `room_across`, m.

    Args:
        points: what is near, in the robot's frame, m, shape (n, 2), one at least.
        box: the outline.
        bounds: as for `room_ahead`.
    """
    apart, distance = from_core(points, box)
    nearest = int(distance.argmin())
    return float(distance[nearest]), room_ahead(points, bounds), room_across(apart, distance, nearest)


@compiled
def room_ahead(points: Points, bounds: tuple[float, float, float, float]) -> float:
    """From what is on the left to what is on the right, from the robot's rear up to a little ahead, m.

    Args:
        points: what is near, in the robot's frame, m, shape (n, 2).
        bounds: how far the outline reaches back, to the front and to a side, and how far to look ahead, m.
    """
    x, y = points[:, 0], points[:, 1]
    rear, front, side, foresee = bounds
    faced = x[(np.abs(y) < side) & (x > front)]
    ahead = min(foresee, float(faced.min()) - SHORT * foresee) if len(faced) else foresee
    beside = y[(x > rear) & (x < ahead)]
    left, right = beside[beside > 0], beside[beside < 0]
    return float(left.min()) - float(right.max()) if len(left) and len(right) else math.inf


@compiled
def room_across(apart: Points, distance: NDArray[np.float64], nearest: int) -> float:
    """From the nearest point across the robot to what is opposite to it, without the robot itself, m.

    Args:
        apart: the way from the outline's core to each point, m, shape (n, 2).
        distance: of each point from the outline, m, shape (n,).
        nearest: which point is nearest.
    """
    lengths = norms(apart[:, 0], apart[:, 1])
    towards = apart[nearest] / max(float(lengths[nearest]), 1e-9)
    opposite = distance[apart[:, 0] * towards[0] + apart[:, 1] * towards[1] < -OPPOSITE * lengths]
    return float(distance[nearest] + opposite.min()) if len(opposite) else math.inf
