"""Straight walls in a scan: iterative end-point split, then one weighted total-least-squares fit of each piece.

The pieces are split by their end points alone and fitted only once they are final; fitting during the splits moves
the places of the splits (Schaefer et al., 2018). All pieces of a round are split together in vectors. The noise of a
range sensor points along the beam, so that across a wall it is smaller the more the beam grazes it: a hit at range r of
a wall at distance d deviates by sigma d / r. The fit weighs each hit by the square of its range, which makes it the
maximum likelihood estimate for such noise.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from perception.settings import LineSettings
from perception.sweep import Floats, Indices, Sweep


@dataclass(frozen=True, slots=True)
class Line:
    """One straight piece of wall, the points with ``x cos(alpha) + y sin(alpha) = p`` from ``start`` to ``end``.

    Attributes:
        alpha: direction of the normal from the origin to the wall, rad within [-pi, pi].
        p: distance of the wall's line from the origin, m, not negative.
        start: first end in counter-clockwise order as the sensor sees it, m.
        end: the other end, m.
        hits: how many hits made it.
    """

    alpha: float
    p: float
    start: tuple[float, float]
    end: tuple[float, float]
    hits: int

    @property
    def length(self) -> float:
        """From end to end, m."""
        return math.hypot(self.end[0] - self.start[0], self.end[1] - self.start[1])

    @property
    def direction(self) -> float:
        """Direction from start to end, rad within [-pi, pi]."""
        return math.atan2(self.end[1] - self.start[1], self.end[0] - self.start[0])


@dataclass(frozen=True, eq=False)
class Lines:
    """All straight pieces of a scan in the order of the beams, as arrays of equal length m.

    Attributes:
        alpha: directions of the normals, rad within [-pi, pi].
        p: distances from the origin, m.
        starts: first ends, m, shape (m, 2).
        ends: other ends, m, shape (m, 2).
        hits: numbers of hits.
        information: 1 / variance of each angle for a range noise of 1 m, rad^-2.
        residual: root mean square distance of the hits from their line, m.
    """

    alpha: Floats
    p: Floats
    starts: Floats
    ends: Floats
    hits: Indices
    information: Floats
    residual: Floats

    def __len__(self) -> int:
        return len(self.alpha)

    def __getitem__(self, index: int) -> Line:
        (x0, y0), (x1, y1) = self.starts[index].tolist(), self.ends[index].tolist()
        return Line(float(self.alpha[index]), float(self.p[index]), (x0, y0), (x1, y1), int(self.hits[index]))

    def __iter__(self) -> Iterator[Line]:
        return (self[index] for index in range(len(self)))

    @cached_property
    def lengths(self) -> Floats:
        """From end to end, m, shape (m,)."""
        chords: Floats = self.ends - self.starts
        return np.hypot(chords[:, 0], chords[:, 1])


def no_lines() -> Lines:
    """What is found where nothing is seen."""
    none = np.empty(0)
    return Lines(none, none, np.empty((0, 2)), np.empty((0, 2)), np.empty(0, np.intp), none, none)


def find_lines(sweep: Sweep, settings: LineSettings) -> Lines:
    """The straight pieces of wall in a sweep, in the robot's frame.

    Args:
        sweep: the scan.
        settings: when to split, and what is too small to be a wall.
    """
    points = sweep.points
    if len(points) < settings.min_hits:
        return no_lines()
    bounds = split_at_end_points(points, _runs(sweep, settings), settings.split)
    firsts, lasts = bounds
    # The points at a split belong to both sides or, at a jump, to neither for sure: the fit leaves them out.
    large = lasts - firsts + 1 >= settings.min_hits + 2
    firsts, lasts = firsts[large] + 1, lasts[large] - 1
    if not len(firsts):
        return no_lines()
    weights = sweep.ranges[sweep.beams] ** 2
    return _chosen(_fit(points, weights, firsts, lasts), settings)


def _runs(sweep: Sweep, settings: LineSettings) -> tuple[Indices, Indices]:
    """First and last hit of each run without a gap in the beams and without a jump too wide to be wall."""
    points, beams = sweep.points, sweep.beams
    steps = np.diff(points, axis=0)
    apart = np.hypot(steps[:, 0], steps[:, 1])
    missing = np.diff(beams) - 1
    cut = np.flatnonzero((missing > settings.max_missing) | (apart > settings.jump))
    firsts = np.concatenate(([0], cut + 1))
    lasts = np.concatenate((cut, [len(points) - 1]))
    return firsts, lasts


def split_at_end_points(points: Floats, runs: tuple[Indices, Indices], tolerance: float) -> tuple[Indices, Indices]:
    """Split runs of points until no point is farther than ``tolerance`` from the chord of its piece.

    Args:
        points: in order along the walls, m, shape (n, 2).
        runs: first and last index of each run.
        tolerance: m.

    Returns:
        First and last index of each piece of at least three points, in order; neighbours share the point between them.
    """
    x, y = points[:, 0], points[:, 1]
    firsts, lasts = runs
    done_firsts: list[Indices] = []
    done_lasts: list[Indices] = []
    while True:
        long_enough = lasts - firsts >= 2
        firsts, lasts = firsts[long_enough], lasts[long_enough]
        if not len(firsts):
            break
        counts = lasts - firsts + 1
        offsets = np.cumsum(counts) - counts
        x0, y0 = x[firsts], y[firsts]
        dx, dy = x[lasts] - x0, y[lasts] - y0
        norms = np.hypot(dx, dy)
        closed = norms < 1e-9
        norms[closed], dx[closed] = 1.0, 1.0
        normal_x, normal_y = -dy / norms, dx / norms
        shifts = normal_x * x0 + normal_y * y0
        index = np.arange(len(counts)).repeat(counts)
        flat = np.arange(len(index)) + (firsts - offsets)[index]
        away = np.abs(normal_x[index] * x[flat] + normal_y[index] * y[flat] - shifts[index])
        peaks = np.maximum.reduceat(away, offsets)
        straight = peaks <= tolerance
        done_firsts.append(firsts[straight])
        done_lasts.append(lasts[straight])
        bent = ~straight
        if not bent.any():
            break
        at_peak = np.flatnonzero(away == peaks[index])
        middles = flat[at_peak[np.searchsorted(at_peak, offsets[bent])]]
        firsts, lasts = np.concatenate((firsts[bent], middles)), np.concatenate((middles, lasts[bent]))
    if not done_firsts:
        return np.empty(0, np.intp), np.empty(0, np.intp)
    all_firsts, all_lasts = np.concatenate(done_firsts), np.concatenate(done_lasts)
    order = np.argsort(all_firsts, kind="stable")
    return all_firsts[order], all_lasts[order]


def _fit(points: Floats, weights: Floats, firsts: Indices, lasts: Indices) -> Lines:
    """Weighted total least squares of each piece, all at once."""
    edges = np.stack((firsts, lasts + 1), axis=1).ravel()
    x, y = points[:, 0], points[:, 1]
    padded = np.zeros((6, len(points) + 1))
    wx, wy = weights * x, weights * y
    padded[:, :-1] = (weights, wx, wy, wx * x, wx * y, wy * y)
    total, sx, sy, sxx, sxy, syy = np.add.reduceat(padded, edges, axis=1)[:, ::2]
    mx, my = sx / total, sy / total
    cxx, cxy, cyy = sxx - sx * mx, sxy - sx * my, syy - sy * my
    # The normal is the eigenvector of the scatter's smaller eigenvalue.
    alpha = 0.5 * np.arctan2(-2 * cxy, cyy - cxx)
    cosine, sine = np.cos(alpha), np.sin(alpha)
    p = mx * cosine + my * sine
    flip = p < 0
    alpha[flip] -= np.copysign(math.pi, alpha[flip])
    cosine, sine, p = np.where(flip, -cosine, cosine), np.where(flip, -sine, sine), np.abs(p)
    across = np.maximum(cxx * cosine**2 + 2 * cxy * cosine * sine + cyy * sine**2, 0.0)
    along = np.maximum(cxx + cyy - across, 0.0)
    starts = _onto(points[firsts], cosine, sine, p)
    ends = _onto(points[lasts], cosine, sine, p)
    information = along / np.maximum(p, 0.02) ** 2
    return Lines(alpha, p, starts, ends, lasts - firsts + 1, information, np.sqrt(across / total))


def _onto(points: Floats, cosine: Floats, sine: Floats, p: Floats) -> Floats:
    away = points[:, 0] * cosine + points[:, 1] * sine - p
    return points - np.stack((away * cosine, away * sine), axis=1)


def _chosen(lines: Lines, settings: LineSettings) -> Lines:
    keep = (lines.lengths >= settings.min_length) & (lines.residual <= settings.max_residual)
    return Lines(
        lines.alpha[keep],
        lines.p[keep],
        lines.starts[keep],
        lines.ends[keep],
        lines.hits[keep],
        lines.information[keep],
        lines.residual[keep],
    )
