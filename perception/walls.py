"""Walls beside the robot: the nearest one on one side, the middle of the corridor, the clearance of the footprint."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from perception.extremes import lowest
from perception.lines import Lines
from perception.settings import CentreSettings, WallSettings
from perception.sweep import Floats, Mask, ScanPoints, any_nearer
from transport.arithmetic import atan2, cos, cos_sin, distance_between, norm, sin, square
from transport.description import Point


@dataclass(frozen=True, slots=True)
class Wall:
    """The nearest wall on one side.

    Attributes:
        distance: from the robot's origin to the nearest seen point of the wall, m; infinity where there is none.
        angle: the turn that brings the robot parallel to it, rad within [-pi/2, pi/2]; zero where there is none.
    """

    distance: float = math.inf
    angle: float = 0.0

    @property
    def known(self) -> bool:
        """Whether there is a wall."""
        return math.isfinite(self.distance)


NO_WALL = Wall()


def nearest_wall(lines: Lines, side: float, settings: WallSettings) -> Wall:
    """The nearest wall on one side.

    The distance and angle are those of a fitted line; the nearest single hit, which 2017 took, is turned by a degree
    of noise for each millimetre.

    Args:
        lines: the walls, in the robot's frame.
        side: direction in which to look, rad: pi/2 for the left.
        settings: how far to the front and back the wall may be.
    """
    walls = [
        Wall(norm(x, y), math.remainder(line.alpha + math.pi / 2, math.pi))
        for line in lines
        if line.length >= settings.min_length
        for x, y in [line.nearest]
        if abs(math.remainder(atan2(y, x) - side, math.tau)) <= settings.half_angle
    ]
    return min(walls, key=lambda wall: wall.distance, default=NO_WALL)


@dataclass(frozen=True, slots=True)
class Centre:
    """Where the robot is between the walls of a corridor, in the frame that is turned along the walls.

    Attributes:
        left: distance to the left wall, m; infinity where there is none.
        right: distance to the right wall, m; infinity where there is none.
    """

    left: float = math.inf
    right: float = math.inf

    @property
    def known(self) -> bool:
        """Whether both walls are seen."""
        return math.isfinite(self.left) and math.isfinite(self.right)

    @property
    def error(self) -> float:
        """How far the middle of the corridor is to the left of the robot, m; zero where not both walls are seen."""
        return (self.left - self.right) / 2 if self.known else 0.0

    @property
    def width(self) -> float:
        """Width of the corridor, m; infinity where not both walls are seen."""
        return self.left + self.right


def centre_of(lines: Lines, misalignment: float, settings: CentreSettings) -> Centre:
    """The bounds of the corridor beside and a little ahead of the robot.

    Args:
        lines: the walls, in the robot's frame.
        misalignment: direction of the walls seen from the robot, rad.
        settings: how far to look.
    """
    cosine, sine = cos_sin(misalignment)
    left = right = math.inf
    for line in lines:
        turned = line.alpha - misalignment
        if line.p > settings.max_half_width or abs(cos(turned)) > sin(settings.parallel):
            continue
        (x0, y0), (x1, y1) = line.start, line.end
        first, last = x0 * cosine + y0 * sine, x1 * cosine + y1 * sine
        if min(max(first, last), settings.ahead) - max(min(first, last), -settings.behind) < settings.min_overlap:
            continue
        if sin(turned) > 0:
            left = min(left, line.p)
        else:
            right = min(right, line.p)
    return Centre(left, right)


def clearance_of(points: Floats, footprint: tuple[Point, ...]) -> float:
    """Distance from the robot's outline to the nearest hit, m; infinity without hits, zero for a hit inside.

    Args:
        points: hits in the robot's frame, m, shape (n, 2).
        footprint: the outline in the same frame, counter-clockwise.
    """
    if not len(points):
        return math.inf
    outline = _outline(footprint)
    x, y = points[:, 0], points[:, 1]
    beside = np.maximum(np.abs(x - outline.centre[0]) - outline.half_size[0], 0.0)
    before = np.maximum(np.abs(y - outline.centre[1]) - outline.half_size[1], 0.0)
    squares = beside * beside + before * before
    # No hit is nearer to the outline than to its bounding box. So only hits nearer to the box than the nearest one of
    # them is to the outline may be nearer still.
    nearest = squares.argmin()
    bound = _distance(x[nearest], y[nearest], outline)
    near = (squares <= bound * bound).nonzero()[0]
    x, y = x[near], y[near]
    if squares[nearest] == 0.0 and _inside(x, y, outline).any():
        return 0.0
    return min(bound, _distance(x, y, outline))


OWN = 0.02
"""A hit this deep within the robot's outline is the robot's own, or dirt on the laser, m; less deep may be noise."""


def without_own_body(sweep: ScanPoints, footprint: tuple[Point, ...]) -> ScanPoints:
    """A sweep in which nothing is known of the beams that end within the robot's own outline."""
    mount = sweep.fan.mount
    reach = _reach_of(footprint, (mount.x, mount.y))
    if not any_nearer(sweep.distances, reach):
        return sweep
    near = (sweep.distances < reach).nonzero()[0]
    outline = _outline(footprint)
    x, y = sweep.points[near, 0], sweep.points[near, 1]
    within = _inside(x, y, outline).nonzero()[0]
    own = [near[hit] for hit in within.tolist() if _distance(x[hit], y[hit], outline) > OWN]
    return sweep.without(sweep.beams[own]) if own else sweep


@lru_cache(maxsize=8)
def _reach_of(footprint: tuple[Point, ...], place: Point) -> float:
    """From a place to the farthest corner of a footprint, m."""
    return max(distance_between(corner, place) for corner in footprint)


@dataclass(frozen=True, eq=False)
class _Outline:
    """A polygon prepared for distances, and its bounding box.

    Attributes:
        corners: x and y of each corner, m, shape (2, n, 1).
        edges: from there to the next corner, m, shape (2, n, 1).
        squares: of the edges' lengths, m^2, shape (n, 1).
        centre: of the bounding box, m.
        half_size: of the bounding box, m.
    """

    corners: Floats
    edges: Floats
    squares: Floats
    centre: tuple[float, float]
    half_size: tuple[float, float]


@lru_cache(maxsize=8)
def _outline(footprint: tuple[Point, ...]) -> _Outline:
    corners = np.array(footprint).T[:, :, None]
    edges = np.roll(corners, -1, axis=1) - corners
    low, high = corners.min(axis=(1, 2)), corners.max(axis=(1, 2))
    (x, y), (half_x, half_y) = ((low + high) / 2).tolist(), ((high - low) / 2).tolist()
    return _Outline(corners, edges, square(edges).sum(axis=0), (x, y), (half_x, half_y))


def _distance(x: Floats, y: Floats, outline: _Outline) -> float:
    """Distance of the nearest of some points from an outline's edges, m."""
    (corner_x, corner_y), (edge_x, edge_y) = outline.corners, outline.edges
    x, y = x - corner_x, y - corner_y
    share = np.minimum(np.maximum((x * edge_x + y * edge_y) / outline.squares, 0.0), 1.0)
    x -= share * edge_x
    y -= share * edge_y
    return math.sqrt(lowest((x * x + y * y).ravel()))


def _inside(x: Floats, y: Floats, outline: _Outline) -> Mask:
    """Which points are inside a polygon, by the number of edges that a ray crosses."""
    (corner_x, corner_y), (edge_x, edge_y) = outline.corners, outline.edges
    straddles = (corner_y > y) != (np.roll(corner_y, -1, axis=0) > y)
    slope = edge_x / np.where(edge_y == 0, 1.0, edge_y)
    crossing = straddles & (x < corner_x + slope * (y - corner_y))
    inside: Mask = crossing.sum(axis=0) % 2 == 1
    return inside
