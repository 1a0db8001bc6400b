"""The last word on every command: the robot's outline stays clear of the walls, and it can always still stop."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from skills.settings import SafetySettings
from skills.surroundings import Points
from transport.description import RobotDescription
from transport.messages import STOP, Pose, Twist

SOFT = 0.02
"""Depth within the margin at which the robot moves away with the usual push, m."""
HARDEST = 4.0
"""The push grows with the depth, up to so many times the usual one: what comes on shall not overtake the robot."""
OPPOSITE = 0.9
"""Cosine of the angle within which a point is opposite to another; the other wall of a corner is not."""

FORESEEN = 0.35
"""Up to so far ahead of the robot's centre a passage may be narrower, m: where it can stop, and the margin there.

Much farther ahead a turning robot would take the wall that it turns away from for one side of a narrow passage.
"""

STANDING = np.zeros((1, 3))
"""The pose of a robot that stays where it is."""


class Guard:
    """Cuts a command, or turns it away, where it would bring the outline within the margin of a wall.

    A command is admitted if the robot, having followed it for one period and braking hard from then on, keeps its
    margin all the way. So there is always a command left that is safe: to brake. The outline is taken for its bounding
    box, which is never nearer to a wall than it says. What is within the box, as the end of a thin wall in the robot's
    hollow front, the robot backs away from.
    """

    def __init__(self, robot: RobotDescription, settings: SafetySettings) -> None:
        outline = np.asarray(robot.footprint)
        self._robot = robot
        self._settings = settings
        self._middle = (outline.min(axis=0) + outline.max(axis=0)) / 2
        self._half = (outline.max(axis=0) - outline.min(axis=0)) / 2

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
        apart = self._apart(points)
        distance = np.hypot(apart[:, 0], apart[:, 1])
        nearest = int(distance.argmin())
        now = float(distance[nearest])
        margin = min(self._margin_ahead(points), self._margin_across(apart, distance, nearest))
        if now >= margin and self.clearance(points, self._stop(reachable)) >= margin:
            return reachable
        away = -apart[nearest] if now > 0 else self._out_of(points)
        x, y = (away / max(float(np.hypot(*away)), 1e-9)).tolist()
        keep = min(margin, now if now > 0 else self.clearance(points, STANDING))
        pressed = min(HARDEST, max(0.0, margin - now) / SOFT)
        for other in self._alternatives(wanted, (x, y), pressed):
            reachable = self._reachable(before, other)
            if self.clearance(points, self._stop(reachable)) >= keep:
                return reachable
        return self.brake(before)

    def brake(self, before: Twist) -> Twist:
        """The command nearest to standing still that is within the robot's limits."""
        return self._robot.towards(before, STOP, self._robot.period)

    def _reachable(self, before: Twist, wanted: Twist) -> Twist:
        """The command nearest to a wanted one that is within the robot's limits."""
        return self._robot.towards(before, self._robot.limited(wanted), self._robot.period)

    def margin(self, points: Points) -> float:
        """The distance to keep from the walls, m: less where they leave less room."""
        apart = self._apart(points)
        distance = np.hypot(apart[:, 0], apart[:, 1])
        return min(self._margin_ahead(points), self._margin_across(apart, distance, int(distance.argmin())))

    def _margin_ahead(self, points: Points) -> float:
        """The margin for the passage between what is at the left and at the right, up to a little ahead."""
        x, y = points[:, 0], points[:, 1]
        rear, front = self._middle[0] - self._half[0], self._middle[0] + self._half[0]
        side = float(self._half[1])
        faced = x[(np.abs(y) < side) & (x > front)]
        ahead = min(FORESEEN, float(faced.min()) - 0.1) if len(faced) else FORESEEN
        beside = y[(x > rear) & (x < ahead)]
        left, right = beside[beside > 0], beside[beside < 0]
        room = float(left.min()) - float(right.max()) if len(left) and len(right) else math.inf
        return self._margin_for(room - 2 * side)

    def _margin_across(self, apart: Points, distance: NDArray[np.float64], nearest: int) -> float:
        """The margin between the nearest point and what is opposite to it, however the robot stands."""
        towards = apart[nearest] / max(float(distance[nearest]), 1e-9)
        opposite = distance[apart @ towards < -OPPOSITE * distance]
        return self._margin_for(float(distance[nearest] + opposite.min()) if len(opposite) else math.inf)

    def _margin_for(self, room: float) -> float:
        """The margin where the robot has so much room (m) besides itself."""
        return min(self._settings.margin, max(self._settings.least_margin, room / 2 - self._settings.spare))

    def _apart(self, points: Points) -> Points:
        """From the robot's box to each point, m; zero for a point within it."""
        offset = points - self._middle
        return np.asarray(np.sign(offset) * np.maximum(np.abs(offset) - self._half, 0))

    def _out_of(self, points: Points) -> NDArray[np.float64]:
        """Where to go from the point deepest within the box, m: to the box's far side, by the middle."""
        offset = points - self._middle
        deepest = int((np.abs(offset) / self._half).max(axis=1).argmin())
        return np.asarray(-offset[deepest])

    def clearance(self, points: Points, poses: NDArray[np.float64]) -> float:
        """Smallest distance from any of the points to the robot's box at any of the poses, m; negative within it.

        Args:
            points: in the robot's frame, m, shape (n, 2).
            poses: x, y, heading in the same frame, shape (k, 3).
        """
        cos, sin = np.cos(poses[:, 2])[:, None], np.sin(poses[:, 2])[:, None]
        dx, dy = points[:, 0] - poses[:, 0, None], points[:, 1] - poses[:, 1, None]
        x = np.abs(cos * dx + sin * dy - self._middle[0]) - self._half[0]
        y = np.abs(cos * dy - sin * dx - self._middle[1]) - self._half[1]
        outside = np.hypot(np.maximum(x, 0), np.maximum(y, 0))
        return float((outside + np.minimum(np.maximum(x, y), 0)).min())

    def _alternatives(self, wanted: Twist, away: tuple[float, float], pressed: float) -> Iterator[Twist]:
        """What to try instead, the nearest to the wanted command first.

        Args:
            wanted: what was asked for.
            away: unit vector away from the nearest point.
            pressed: how hard the robot must get away from there; 1 for the usual push.
        """
        towards = min(0.0, wanted.forward * away[0] + wanted.left * away[1])
        slide = (wanted.forward - towards * away[0], wanted.left - towards * away[1])
        yield self._pushed(slide, away, pressed, wanted.turn)
        for share in (0.6, 0.3):
            yield Twist(share * wanted.forward, share * wanted.left, share * wanted.turn)
            yield self._pushed((share * slide[0], share * slide[1]), away, max(1.0, pressed), share * wanted.turn)
        yield self._pushed((0.0, 0.0), away, max(1.0, pressed), wanted.turn)
        yield self._pushed((0.0, 0.0), away, max(1.0, pressed), 0.0)
        yield Twist(0.0, 0.0, wanted.turn)

    def _pushed(self, velocity: tuple[float, float], away: tuple[float, float], pressed: float, turn: float) -> Twist:
        push = pressed * self._settings.push
        return Twist(velocity[0] + push * away[0], velocity[1] + push * away[1], turn)

    def _stop(self, twist: Twist) -> NDArray[np.float64]:
        """Where the robot is after a period with this twist and after each period of braking, shape (k, 3)."""
        period = self._robot.period
        pose = Pose()
        poses = []
        while twist != STOP:
            pose = moved(pose, twist, period)
            poses.append((pose.x, pose.y, pose.heading))
            twist = self.brake(twist)
        return np.asarray(poses or [(0.0, 0.0, 0.0)])


def moved(pose: Pose, twist: Twist, duration: float) -> Pose:
    """Where a constant twist carries the robot in a time (s), the translation taken at the middle heading."""
    heading = pose.heading + twist.turn * duration / 2
    cos, sin = math.cos(heading), math.sin(heading)
    return Pose(
        pose.x + duration * (cos * twist.forward - sin * twist.left),
        pose.y + duration * (sin * twist.forward + cos * twist.left),
        pose.heading + twist.turn * duration,
    )
