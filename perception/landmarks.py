"""Landmarks in the form of 2015: walls with their ends and with the line ``p = x cos(alpha) + y sin(alpha)``.

The ends say how much of a wall was seen, which changes from scan to scan; alpha and p say which wall it is, so that two
sightings of a wall can be associated though they show different parts of it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from perception.lines import Lines
from perception.settings import LandmarkSettings
from transport.arithmetic import atan2, cos_sin, distance_between, halfway
from transport.description import Point
from transport.messages import Pose


@dataclass(frozen=True, slots=True)
class Landmark:
    """A wall, in a frame that the caller defines.

    Attributes:
        start: its first end, m.
        end: its other end, m.
        alpha: direction of its normal from the origin, rad within [-pi, pi].
        p: its distance from the origin, m, not negative.
        hits: how many hits made it.
    """

    start: Point
    end: Point
    alpha: float
    p: float
    hits: int

    @property
    def length(self) -> float:
        """From end to end, m."""
        return distance_between(self.start, self.end)

    def seen_from(self, pose: Pose) -> Landmark:
        """The same landmark, given in the robot's frame, in the frame in which the robot is at ``pose``."""
        cosine, sine = cos_sin(pose.heading)

        def move(point: Point) -> Point:
            return (pose.x + point[0] * cosine - point[1] * sine, pose.y + point[0] * sine + point[1] * cosine)

        alpha = self.alpha + pose.heading
        across, along = cos_sin(alpha)
        p = self.p + pose.x * across + pose.y * along
        if p < 0:
            alpha, p = alpha + math.pi, -p
        return Landmark(move(self.start), move(self.end), math.remainder(alpha, math.tau), p, self.hits)


def find_landmarks(lines: Lines, settings: LandmarkSettings) -> tuple[Landmark, ...]:
    """The walls in a scan, in the robot's frame, in the order of the beams.

    Pieces on one line are one wall as long as the gap between them is short, be it because something is before it
    or because of readings that failed. (In 2015 fifty missing beams of a thousand ended a wall, so that openings far
    away were skipped; a gap in metres does not depend on the distance.)

    Args:
        lines: the straight pieces.
        settings: the least number of hits, the longest gap, what counts as one line.
    """
    found: list[Landmark] = []
    for line in lines:
        piece = Landmark(line.start, line.end, line.alpha, line.p, line.hits)
        for index, wall in enumerate(found):
            if _continues(wall, piece, settings):
                found[index] = _united(wall, piece)
                break
        else:
            found.append(piece)
    return tuple(wall for wall in found if wall.hits >= settings.min_hits)


def _continues(wall: Landmark, piece: Landmark, settings: LandmarkSettings) -> bool:
    """Whether a piece continues a wall: the same line, and not too far from its end."""
    turned = abs(math.remainder(piece.alpha - wall.alpha, math.tau))
    return (
        turned <= settings.same_angle
        and abs(piece.p - wall.p) <= settings.same_distance
        and distance_between(wall.end, piece.start) <= settings.max_gap
    )


def _united(wall: Landmark, piece: Landmark) -> Landmark:
    """One wall of two pieces; each end weighs as its piece's hits."""
    ends = wall.start, wall.end, piece.start, piece.end
    weights = wall.hits, wall.hits, piece.hits, piece.hits
    total = math.fsum(weights)
    x, y = (
        math.fsum([weight * end[axis] for weight, end in zip(weights, ends, strict=True)]) / total for axis in (0, 1)
    )
    weighted = [(weight, end[0] - x, end[1] - y) for weight, end in zip(weights, ends, strict=True)]
    # The principal axis of the ends has the angle t with tan 2t = 2 Sxy / (Sxx - Syy); the normal is across it.
    sxy = math.fsum([weight * dx * dy for weight, dx, dy in weighted])
    difference = math.fsum([weight * (dx * dx - dy * dy) for weight, dx, dy in weighted])
    cosine, sine = halfway(difference, 2 * sxy)
    normal = -sine, cosine
    p = normal[0] * x + normal[1] * y
    if p < 0:
        normal, p = (-normal[0], -normal[1]), -p
    start, end = (_onto(point, normal, p) for point in (wall.start, piece.end))
    return Landmark(start, end, atan2(normal[1], normal[0]), p, wall.hits + piece.hits)


def _onto(point: Point, normal: Point, p: float) -> Point:
    away = normal[0] * point[0] + normal[1] * point[1] - p
    return (point[0] - away * normal[0], point[1] - away * normal[1])
