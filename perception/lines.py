"""Straight walls in a scan: iterative end-point split, then one weighted total-least-squares fit of each piece.

The pieces are split by their end points alone and fitted only once they are final; fitting during the splits moves
the places of the splits (Schaefer et al., 2018). The noise of a range sensor points along the beam, so that across a
wall it is smaller the more the beam grazes it: a hit at range r of a wall at distance d deviates by sigma d / r. The
fit weighs each hit by the square of its range, which makes it the maximum likelihood estimate for such noise.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from perception.extremes import lowest
from perception.settings import LineSettings
from perception.sweep import Floats, Indices, Sweep
from transport.description import Point


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
    start: Point
    end: Point
    hits: int

    @property
    def length(self) -> float:
        """From end to end, m."""
        return math.hypot(self.end[0] - self.start[0], self.end[1] - self.start[1])

    @property
    def direction(self) -> float:
        """Direction from start to end, rad within [-pi, pi]."""
        return math.atan2(self.end[1] - self.start[1], self.end[0] - self.start[0])

    @property
    def nearest(self) -> Point:
        """The point nearest to the origin, m."""
        (x, y), (end_x, end_y) = self.start, self.end
        dx, dy = end_x - x, end_y - y
        share = min(max(-(x * dx + y * dy) / max(dx * dx + dy * dy, 1e-12), 0.0), 1.0)
        return (x + share * dx, y + share * dy)


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
        return len(self.p)

    def __getitem__(self, index: int) -> Line:
        return self._each[index]

    def __iter__(self) -> Iterator[Line]:
        return iter(self._each)

    @cached_property
    def _each(self) -> tuple[Line, ...]:
        starts, ends = map(tuple, self.starts.tolist()), map(tuple, self.ends.tolist())
        return tuple(map(Line, self.alpha.tolist(), self.p.tolist(), starts, ends, self.hits.tolist()))

    @cached_property
    def lengths(self) -> Floats:
        """From end to end, m, shape (m,)."""
        chords: Floats = self.ends - self.starts
        return np.hypot(chords[:, 0], chords[:, 1])


@dataclass(frozen=True, eq=False)
class LinePieces:
    """How the hits of a scan were split.

    Attributes:
        runs: first and last hit of each run without a jump.
        pieces: first and last hit of each straight piece; neighbours share a hit.
    """

    runs: list[tuple[int, int]]
    pieces: list[tuple[int, int]]

    @cached_property
    def bends(self) -> list[int]:
        """The hits at which the walls bend, in order."""
        ends = {last for _, last in self.runs}
        return sorted({first for first, _ in self.pieces} | {last for _, last in self.pieces} - ends)


def no_lines() -> Lines:
    """What is found where nothing is seen."""
    none = np.empty(0)
    return Lines(none, none, np.empty((0, 2)), np.empty((0, 2)), np.empty(0, np.intp), none, none)


def split(sweep: Sweep, settings: LineSettings) -> LinePieces:
    """Where the hits of a sweep jump and bend.

    Args:
        sweep: the scan.
        settings: when to split, and what is too small to be a wall.
    """
    points = sweep.points
    if len(points) < settings.min_hits:
        return LinePieces([], [])
    runs = _runs(sweep, settings)
    return LinePieces(runs, split_at_end_points(points, runs, settings.split, settings.min_hits + 1))


def find_lines(sweep: Sweep, pieces: LinePieces, settings: LineSettings) -> Lines:
    """The straight pieces of wall in a sweep, in the robot's frame.

    Args:
        sweep: the scan.
        pieces: how its hits were split.
        settings: what is too small or too crooked to be a wall.
    """
    if not pieces.pieces:
        return no_lines()
    firsts, lasts = np.array(pieces.pieces).T
    # The points at a split belong to both sides or, at a jump, to neither for sure: the fit leaves them out.
    firsts, lasts = firsts + 1, lasts - 1
    points = sweep.points
    sums = _sums(points, sweep.distances**2, firsts, lasts)
    merged = _merged(sums, firsts, lasts, settings)
    return _chosen(_fit(points, *merged), settings)


def _runs(sweep: Sweep, settings: LineSettings) -> list[tuple[int, int]]:
    """First and last hit of each run without a gap in the beams and without a jump too wide to be wall.

    On a wall at distance d, neighbouring hits at range r are ``r^2 step / d`` apart.
    """
    columns, beams, ranges = sweep.points.T, sweep.beams, sweep.distances
    steps = columns[:, 1:] - columns[:, :-1]
    steps *= steps
    apart = np.minimum(ranges[1:], ranges[:-1]) ** 2 * (sweep.fan.step / settings.nearest) + settings.jump
    cut = steps[0] + steps[1] > apart * apart
    if len(beams) < len(sweep.ranges):
        cut |= beams[1:] - beams[:-1] > settings.max_missing + 1
    lasts = [*cut.nonzero()[0].tolist(), len(beams) - 1]
    return list(zip([0, *(last + 1 for last in lasts[:-1])], lasts, strict=True))


def split_at_end_points(
    points: Floats, runs: list[tuple[int, int]], tolerance: float, min_step: int
) -> list[tuple[int, int]]:
    """Split runs of points until no point is farther than ``tolerance`` from the chord of its piece.

    Args:
        points: in order along the walls, m, shape (n, 2).
        runs: first and last index of each run.
        tolerance: m.
        min_step: a piece whose last index is less than this above its first is dropped.

    Returns:
        First and last index of each piece, in order; neighbours share the point between them.
    """
    x, y = points[:, 0], points[:, 1]
    waiting = runs[::-1]
    pieces: list[tuple[int, int]] = []
    while waiting:
        first, last = waiting.pop()
        if last - first < min_step:
            continue
        dx, dy = x.item(last) - x.item(first), y.item(last) - y.item(first)
        # Heights over the chord are taken along an axis, not squarely: that is cheaper, and longer by a known factor.
        level, height, run, rise = (x, y, dx, dy) if abs(dx) >= abs(dy) else (y, x, dy, dx)
        slope = rise / run if run else 0.0
        across = level[first:last] * slope
        across -= height[first:last]
        highest, lowest = int(across.argmax()), int(across.argmin())
        chord = across.item(0)
        above, below = across.item(highest) - chord, chord - across.item(lowest)
        if max(above, below) <= tolerance * math.hypot(1.0, slope):
            pieces.append((first, last))
        else:
            farthest = first + (highest if above >= below else lowest)
            waiting += [(farthest, last), (first, farthest)]
    return pieces


def _sums(points: Floats, weights: Floats, firsts: Indices, lasts: Indices) -> Floats:
    """For each piece the sums of w, wx, wy, wxx, wxy and wyy, shape (6, m)."""
    x, y = points[:, 0], points[:, 1]
    terms = np.zeros((6, len(points) + 1))
    w, wx, wy = terms[0, :-1], terms[1, :-1], terms[2, :-1]
    w[:] = weights
    np.multiply(weights, x, out=wx)
    np.multiply(weights, y, out=wy)
    np.multiply(wx, x, out=terms[3, :-1])
    np.multiply(wx, y, out=terms[4, :-1])
    np.multiply(wy, y, out=terms[5, :-1])
    edges = np.empty(2 * len(firsts), np.intp)
    edges[::2], edges[1::2] = firsts, lasts + 1
    return np.add.reduceat(terms, edges, axis=1)[:, ::2]


def _scatter(sums: Floats) -> Floats:
    """Sums of w (x - mean x)^2, w (x - mean x) (y - mean y) and w (y - mean y)^2 of each piece, shape (3, m)."""
    total, sx, sy, sxx, sxy, syy = sums
    return np.array((sxx - sx * sx / total, sxy - sx * sy / total, syy - sy * sy / total))


def _deviation(sums: Floats, scatter: Floats) -> Floats:
    """Root mean square distance of each piece's hits from the line that fits best, m."""
    cxx, cxy, cyy = scatter
    across = (cxx + cyy) / 2 - np.hypot((cxx - cyy) / 2, cxy)
    deviation: Floats = np.sqrt(np.maximum(across, 0.0) / sums[0])
    return deviation


def _merged(
    sums: Floats, firsts: Indices, lasts: Indices, settings: LineSettings
) -> tuple[Floats, Floats, Indices, Indices]:
    """Put neighbours together that one line fits about as well as two, the best pair first.

    A split that noise put a little beside a corner tilts the chord of the next piece so that it is split once more.

    Returns:
        Sums, scatter, first and last hits of the pieces that are left.
    """
    while True:
        count = len(firsts)
        both = np.concatenate((sums, sums[:, 1:] + sums[:, :-1]), axis=1)
        scatter = _scatter(both)
        deviations = _deviation(both, scatter)
        own, of_pairs = deviations[:count], deviations[count:]
        excess = of_pairs - 1.2 * np.maximum(own[1:], own[:-1])
        excess[firsts[1:] - lasts[:-1] != 2] = math.inf
        if lowest(excess) > settings.merge:
            return sums, scatter[:, :count], firsts, lasts
        best = int(excess.argmin())
        sums = np.delete(sums, best + 1, axis=1) + np.eye(1, count - 1, best) * sums[:, best + 1, None]
        firsts, lasts = np.delete(firsts, best + 1), np.delete(lasts, best)


def _fit(points: Floats, sums: Floats, scatter: Floats, firsts: Indices, lasts: Indices) -> Lines:
    """Weighted total least squares of each piece: the normal is the eigenvector of the scatter's smaller eigenvalue."""
    cxx, cxy, cyy = scatter
    alpha = 0.5 * np.arctan2(-2 * cxy, cyy - cxx)
    cosine, sine = np.cos(alpha), np.sin(alpha)
    p = (sums[1] * cosine + sums[2] * sine) / sums[0]
    sign = np.where(p < 0, -1.0, 1.0)
    cosine, sine, p = cosine * sign, sine * sign, np.abs(p)
    along = np.hypot(cxx - cyy, 2 * cxy)
    across = np.maximum((cxx + cyy - along) / 2, 0.0)
    starts, ends = _onto(points[np.array((firsts, lasts))], cosine, sine, p)
    return Lines(
        alpha=np.arctan2(sine, cosine),
        p=p,
        starts=starts,
        ends=ends,
        hits=lasts - firsts + 1,
        information=(along + across) / np.maximum(p, 0.02) ** 2,
        residual=np.sqrt(across / sums[0]),
    )


def _onto(points: Floats, cosine: Floats, sine: Floats, p: Floats) -> Floats:
    x, y = points[..., 0], points[..., 1]
    away = x * cosine + y * sine - p
    x -= away * cosine
    y -= away * sine
    return points


def _chosen(lines: Lines, settings: LineSettings) -> Lines:
    keep = (lines.lengths >= settings.min_length) & (lines.residual <= settings.max_residual)
    if np.count_nonzero(keep) == len(keep):
        return lines
    return Lines(
        lines.alpha[keep],
        lines.p[keep],
        lines.starts[keep],
        lines.ends[keep],
        lines.hits[keep],
        lines.information[keep],
        lines.residual[keep],
    )
