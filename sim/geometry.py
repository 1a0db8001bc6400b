"""Distances between a robot's outline and segments, and footprints in the world."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sim.maze import Point, Segments
from transport.arithmetic import cos_sin, norms
from transport.compiled import compiled
from transport.messages import Pose

CLOSE = 1e-3
"""Walls whose line passes the sensor nearer than this, m, are intersected with every beam."""
STRAIGHT = 2e-3
"""A wall whose ends lie in opposite directions to within this angle, rad, is tried with every beam: on which side of it
the sensor is, the directions do not show for certain."""

Points = NDArray[np.float64]


def placed(outline: Points, pose: Pose) -> Points:
    """The corners of an outline in the world: shape (n, 2) in metres, turned and shifted by the pose."""
    cos, sin = cos_sin(pose.heading)
    x, y = outline[:, 0], outline[:, 1]
    return np.stack([pose.x + cos * x - sin * y, pose.y + sin * x + cos * y], axis=1)


def edges(corners: Points) -> Segments:
    """The sides of a closed polygon, shape (n, 4) from corners of shape (n, 2)."""
    return np.hstack([corners, np.roll(corners, -1, axis=0)])


def distances(points: Points, segments: Segments) -> NDArray[np.float64]:
    """The distance of each point from each segment, m, shape (points, segments)."""
    ax, ay = segments[:, 0], segments[:, 1]
    dx, dy = segments[:, 2] - ax, segments[:, 3] - ay
    px, py = points[:, 0, None] - ax, points[:, 1, None] - ay
    along = np.clip((px * dx + py * dy) / np.maximum(dx * dx + dy * dy, 1e-300), 0.0, 1.0)
    return norms(px - along * dx, py - along * dy)


@compiled
def nearest_segment(x: float, y: float, segments: Segments) -> float:
    """The distance from a point to the nearest segment, m; infinite for none."""
    return float(distances(np.array([[x, y]]), segments).min()) if len(segments) else math.inf


@compiled
def outline_distance(corners: Points, segments: Segments) -> float:
    """The smallest distance between a polygon's outline and segments that do not cross it, m; infinite for none."""
    if len(segments) == 0:
        return math.inf
    ends = segments.reshape(-1, 2)
    return float(min(distances(corners, segments).min(), distances(ends, edges(corners)).min()))


@compiled
def outline_near(outline: Points, pose: tuple[float, float, float, float], segments: Segments, reach: float) -> float:
    """`outline_distance` of a robot from those segments that are within reach of its origin, m; infinite for none.

    Args:
        outline: its corners in its own frame, m, shape (n, 2).
        pose: x and y in m, cosine and sine of its heading.
        segments: shape (m, 4).
        reach: m.
    """
    near = segments[distances(np.array([pose[:2]]), segments)[0] <= reach]
    x, y, cos, sin = pose
    ahead, aside = outline[:, 0], outline[:, 1]
    corners = np.stack([x + cos * ahead - sin * aside, y + sin * ahead + cos * aside], axis=1)
    return outline_distance(corners, near)


def crosses(before: Point, after: Point, gate: Sequence[float]) -> int:
    """Whether a short move passes through a gate: +1 from its right to its left, -1 the other way, 0 not at all.

    Args:
        before: where the move begins, m.
        after: where it ends, m.
        gate: x1, y1, x2, y2 in metres; left and right as seen when going from its first end to its second.
    """
    ax, ay, bx, by = gate
    dx, dy = bx - ax, by - ay
    old = dx * (before[1] - ay) - dy * (before[0] - ax)
    new = dx * (after[1] - ay) - dy * (after[0] - ax)
    if (old < 0.0) == (new < 0.0):
        return 0
    part = old / (old - new)
    x, y = before[0] + part * (after[0] - before[0]), before[1] + part * (after[1] - before[1])
    along = (x - ax) * dx + (y - ay) * dy
    if not 0.0 <= along <= dx * dx + dy * dy:
        return 0
    return 1 if old < 0.0 else -1
