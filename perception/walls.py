"""Walls beside the robot: the nearest one at a side, the middle of the corridor, the clearance of the footprint."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from perception.lines import Lines
from perception.settings import CentreSettings, WallSettings
from perception.sweep import Floats, Mask
from transport.description import Point


@dataclass(frozen=True, slots=True)
class Wall:
    """The nearest wall at a side.

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
    """The nearest wall at a side.

    The distance and angle are those of a fitted line; the nearest single hit, which 2017 took, is turned by a degree
    of noise for each millimetre.

    Args:
        lines: the walls, in the robot's frame.
        side: direction in which to look, rad: pi/2 for the left.
        settings: how far to the front and back the wall may be.
    """
    if not len(lines):
        return NO_WALL
    distances, bearings = lines.nearest
    off = np.abs((bearings - side + math.pi) % math.tau - math.pi)
    fitting = (off <= settings.half_angle) & (lines.lengths >= settings.min_length)
    best = int(np.where(fitting, distances, math.inf).argmin())
    if not fitting[best]:
        return NO_WALL
    direction = float(lines.alpha[best]) + math.pi / 2
    return Wall(float(distances[best]), math.remainder(direction, math.pi))


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
    if not len(lines):
        return Centre()
    cosine, sine = math.cos(misalignment), math.sin(misalignment)
    along = np.array([cosine, sine])
    first, second = lines.starts @ along, lines.ends @ along
    back, front = np.minimum(first, second), np.maximum(first, second)
    overlap = np.minimum(front, settings.ahead) - np.maximum(back, -settings.behind)
    parallel = np.abs(np.cos(lines.alpha - misalignment)) <= math.sin(settings.parallel)
    beside = parallel & (overlap >= settings.min_overlap) & (lines.p <= settings.max_half_width)
    is_left = np.sin(lines.alpha - misalignment) > 0
    left, right = lines.p[beside & is_left], lines.p[beside & ~is_left]
    return Centre(
        float(left.min()) if len(left) else math.inf,
        float(right.min()) if len(right) else math.inf,
    )


def clearance_of(points: Floats, footprint: tuple[Point, ...]) -> float:
    """Distance from the robot's outline to the nearest hit, m; infinity without hits, zero for a hit inside.

    Args:
        points: hits in the robot's frame, m, shape (n, 2).
        footprint: the outline in the same frame, counter-clockwise.
    """
    if not len(points):
        return math.inf
    outline = _outline(footprint)
    # The distance to the bounding box tells which hits matter: it is less than that to the outline, by at most the
    # depth of the outline's notches.
    x, y = points[:, 0], points[:, 1]
    beside = np.maximum(np.abs(x - outline.centre[0]) - outline.half_size[0], 0.0)
    before = np.maximum(np.abs(y - outline.centre[1]) - outline.half_size[1], 0.0)
    squares = beside * beside + before * before
    shortest = math.sqrt(squares.min())
    near = points[squares <= (shortest + outline.notch) ** 2]
    if shortest == 0.0 and _inside(near, outline.corners).any():
        return 0.0
    return float(_distances(near, outline).min())


@dataclass(frozen=True, eq=False)
class _Outline:
    corners: Floats
    edges: Floats
    squares: Floats
    centre: tuple[float, float]
    half_size: tuple[float, float]
    notch: float


@lru_cache(maxsize=8)
def _outline(footprint: tuple[Point, ...]) -> _Outline:
    """A polygon prepared for distances; its notches are measured from the bounding box's border."""
    corners = np.asarray(footprint)
    edges = np.roll(corners, -1, axis=0) - corners
    low, high = corners.min(axis=0), corners.max(axis=0)
    (x, y), (half_x, half_y) = ((low + high) / 2).tolist(), ((high - low) / 2).tolist()
    outline = _Outline(corners, edges, (edges**2).sum(axis=1), (x, y), (half_x, half_y), 0.0)
    share = np.linspace(-1.0, 1.0, 201)
    border = [(x + half_x * s, y + half_y * t) for s in share for t in (-1.0, 1.0)]
    border += [(x + half_x * t, y + half_y * s) for s in share for t in (-1.0, 1.0)]
    step = max(half_x, half_y) / 100
    return replace(outline, notch=float(_distances(np.array(border), outline).max()) + step)


def _distances(points: Floats, outline: _Outline) -> Floats:
    """Distance of each point from an outline's edges, m."""
    edge_x, edge_y = outline.edges[:, 0], outline.edges[:, 1]
    x = points[:, 0, None] - outline.corners[:, 0]
    y = points[:, 1, None] - outline.corners[:, 1]
    share = np.minimum(np.maximum((x * edge_x + y * edge_y) / outline.squares, 0.0), 1.0)
    x -= share * edge_x
    y -= share * edge_y
    distances: Floats = np.sqrt((x * x + y * y).min(axis=1))
    return distances


def _inside(points: Floats, corners: Floats) -> Mask:
    """Which points are inside a polygon, by the number of edges that a ray crosses."""
    x, y = points[:, 0, None], points[:, 1, None]
    ends = np.roll(corners, -1, axis=0)
    straddles = (corners[:, 1] > y) != (ends[:, 1] > y)
    rise = ends[:, 1] - corners[:, 1]
    slope = (ends[:, 0] - corners[:, 0]) / np.where(rise == 0, 1.0, rise)
    crossing = straddles & (x < corners[:, 0] + slope * (y - corners[:, 1]))
    inside: Mask = crossing.sum(axis=1) % 2 == 1
    return inside
