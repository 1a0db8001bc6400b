"""Straight walls in a scan: iterative end-point split, then one weighted total-least-squares fit of each piece.

The pieces are split by their end points alone and fitted only once they are final; fitting during the splits moves
the places of the splits (Schaefer et al., 2018). The noise of a range sensor points along the beam, so that across a
wall it is smaller the more the beam grazes it: a hit at range r of a wall at distance d deviates by sigma d / r. The
fit weighs each hit by the square of its range, which makes it the maximum likelihood estimate for such noise.
"""

from __future__ import annotations

import math
import operator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise, starmap
from typing import NamedTuple

import numpy as np

from perception.settings import LineSettings
from perception.sweep import Floats, Indices, ScanPoints
from transport.arithmetic import atan2, distance_between, halfway, norm, square
from transport.compiled import compiled
from transport.description import Point


class Line(NamedTuple):
    """One straight piece of wall, the points with ``x cos(alpha) + y sin(alpha) = p`` from ``start`` to ``end``.

    Attributes:
        alpha: direction of the normal from the origin to the wall, rad within [-pi, pi].
        p: distance of the wall's line from the origin, m, not negative.
        start: first end in counter-clockwise order as the sensor sees it, m.
        end: the other end, m.
        length: from end to end, m.
        hits: how many hits made it.
        information: 1 / variance of the angle for a range noise of 1 m, rad^-2.
        residual: root mean square distance of the hits from the line, m.
    """

    alpha: float
    p: float
    start: Point
    end: Point
    length: float
    hits: int
    information: float
    residual: float

    @property
    def direction(self) -> float:
        """Direction from start to end, rad within [-pi, pi]."""
        return atan2(self.end[1] - self.start[1], self.end[0] - self.start[0])

    @property
    def nearest(self) -> Point:
        """The point nearest to the origin, m."""
        (x, y), (end_x, end_y) = self.start, self.end
        dx, dy = end_x - x, end_y - y
        share = min(max(-(x * dx + y * dy) / max(dx * dx + dy * dy, 1e-12), 0.0), 1.0)
        return (x + share * dx, y + share * dy)


LineValues = tuple[float, float, Point, Point, float, int, float, float]
"""The fields of a `Line`."""

Lines = tuple[Line, ...]
"""All straight pieces of a scan in the order of the beams."""


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


def split(sweep: ScanPoints, settings: LineSettings) -> LinePieces:
    """Where the hits of a sweep jump and bend.

    Args:
        sweep: the scan.
        settings: when to split, and what is too small to be a wall.
    """
    points = sweep.points
    if len(points) < settings.min_hits:
        return LinePieces([], [])
    limits = sweep.fan.step / settings.nearest, settings.jump, settings.max_missing
    runs = runs_of(points, sweep.distances, sweep.beams, limits)
    return LinePieces(runs, split_at_end_points(points, runs, settings.split, settings.min_hits + 1))


def find_lines(sweep: ScanPoints, pieces: LinePieces, settings: LineSettings) -> Lines:
    """The straight pieces of wall in a sweep, in the robot's frame.

    Args:
        sweep: the scan.
        pieces: how its hits were split.
        settings: what is too small or too crooked to be a wall.
    """
    if not pieces.pieces:
        return ()
    limits = settings.merge, settings.min_length, settings.max_residual
    return tuple(map(Line._make, fitted_lines(sweep.points, sweep.distances, pieces.pieces, limits)))


@compiled
def fitted_lines(
    points: Floats, distances: Floats, pieces: list[tuple[int, int]], limits: tuple[float, float, float]
) -> list[LineValues]:
    """The lines through pieces, with what one line fits as well put together.

    Args:
        points: the hits, m, shape (n, 2).
        distances: of the hits from the sensor, m, shape (n,).
        pieces: first and last hit of each piece.
        limits: by how much the deviation of a joined piece may be larger, the least length, the largest residual, m.
    """
    merge, min_length, max_residual = limits
    lines = [_fitted(points, piece) for piece in _merged(_weighed(points, distances, pieces), merge)]
    return [line for line in lines if line.length >= min_length and line.residual <= max_residual]


@compiled
def runs_of(points: Floats, ranges: Floats, beams: Indices, limits: tuple[float, float, int]) -> list[tuple[int, int]]:
    """First and last hit of each run without a gap in the beams and without a jump too wide to be wall.

    On a wall at distance d, neighbouring hits at range r are ``r^2 step / d`` apart.

    Args:
        points: the hits, m, shape (n, 2), one at least.
        ranges: their distances from the sensor, m, shape (n,).
        beams: which beams they belong to, shape (n,).
        limits: the angle between beams over the distance of the nearest wall, rad/m; how much farther apart hits may
            be, m; how many missing beams end no run.
    """
    ratio, jump, max_missing = limits
    columns = points.T
    steps = columns[:, 1:] - columns[:, :-1]
    steps *= steps
    apart = square(np.minimum(ranges[1:], ranges[:-1])) * ratio + jump
    cut = (steps[0] + steps[1] > apart * apart) | (beams[1:] - beams[:-1] > max_missing + 1)
    lasts = [*cut.nonzero()[0].tolist(), len(beams) - 1]
    return list(zip([0, *(last + 1 for last in lasts[:-1])], lasts, strict=True))


@compiled
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
        if max(above, below) <= tolerance * norm(1.0, slope):
            pieces.append((first, last))
        else:
            farthest = first + (highest if above >= below else lowest)
            waiting += [(farthest, last), (first, farthest)]
    return pieces


class _Piece(NamedTuple):
    """The hits that make a straight piece, first to last, with sums over them of the weights w and of their products.

    A scan has some ten pieces: single numbers are faster than arrays so short.
    """

    first: int
    last: int
    w: float
    wx: float
    wy: float
    wxx: float
    wxy: float
    wyy: float

    def joined(self, other: _Piece) -> _Piece:
        """This piece and the one behind it as one."""
        return _Piece(self.first, other.last, *map(operator.add, self[2:], other[2:]))

    def scatter(self) -> tuple[float, float, float]:
        """Sums of w (x - mean x)^2, w (x - mean x) (y - mean y) and w (y - mean y)^2."""
        _, _, w, wx, wy, wxx, wxy, wyy = self
        return (wxx - wx * wx / w, wxy - wx * wy / w, wyy - wy * wy / w)

    def deviation(self) -> float:
        """Root mean square distance of the hits from the line that fits best, m."""
        cxx, cxy, cyy = self.scatter()
        across = (cxx + cyy) / 2 - norm((cxx - cyy) / 2, cxy)
        return math.sqrt(max(across, 0.0) / self.w)


def _weighed(points: Floats, distances: Floats, pieces: list[tuple[int, int]]) -> list[_Piece]:
    """The pieces with their sums.

    The points at a split belong to both sides or, at a jump, to neither for sure: they are left out.
    """
    x, y = points.T
    terms = np.empty((6, len(distances)))
    w, wx, wy, wxx, wxy, wyy = terms
    np.multiply(distances, distances, out=w)
    w += 1e-30  # hits at the sensor itself weigh something, too
    np.multiply(x, w, out=wx)
    np.multiply(y, w, out=wy)
    np.multiply(x, wx, out=wxx)
    np.multiply(y, wx, out=wxy)
    np.multiply(y, wy, out=wyy)
    edges = np.array(pieces).ravel()
    edges[::2] += 1
    sums = np.add.reduceat(terms, edges, axis=1)[:, ::2].T.tolist()
    return [_Piece(first + 1, last - 1, *each) for (first, last), each in zip(pieces, sums, strict=True)]


def _merged(pieces: list[_Piece], limit: float) -> list[_Piece]:
    """Put neighbours together that one line fits about as well as two, the best pair first.

    A split that noise put a little beside a corner tilts the chord of the next piece so that it is split once more.
    """
    excesses = list(starmap(_excess, pairwise(pieces)))
    while excesses and (least := min(excesses)) <= limit:
        best = excesses.index(least)
        pieces[best : best + 2] = [pieces[best].joined(pieces[best + 1])]
        before = max(best - 1, 0)
        excesses[before : best + 2] = starmap(_excess, pairwise(pieces[before : best + 2]))
    return pieces


def _excess(piece: _Piece, other: _Piece) -> float:
    """By how much hits of neighbours deviate more from one line than from two, m; infinity where a jump is between."""
    if other.first - piece.last != 2:
        return math.inf
    return piece.joined(other).deviation() - 1.2 * max(piece.deviation(), other.deviation())


def _fitted(points: Floats, piece: _Piece) -> Line:
    """Weighted total least squares: the normal is the eigenvector of the scatter's smaller eigenvalue."""
    cxx, cxy, cyy = piece.scatter()
    cosine, sine = halfway(cyy - cxx, -2 * cxy)
    p = (piece.wx * cosine + piece.wy * sine) / piece.w
    if p < 0:
        cosine, sine, p = -cosine, -sine, -p
    along = norm(cxx - cyy, 2 * cxy)
    across = max((cxx + cyy - along) / 2, 0.0)
    away = max(p, 0.02)
    start, end = _onto(points, piece.first, cosine, sine, p), _onto(points, piece.last, cosine, sine, p)
    return Line(
        alpha=atan2(sine, cosine),
        p=p,
        start=start,
        end=end,
        length=distance_between(start, end),
        hits=piece.last - piece.first + 1,
        information=(along + across) / (away * away),
        residual=math.sqrt(across / piece.w),
    )


def _onto(points: Floats, hit: int, cosine: float, sine: float, p: float) -> Point:
    """The place of a hit, moved onto the line with this normal at this distance from the origin."""
    x, y = points.item(hit, 0), points.item(hit, 1)
    away = x * cosine + y * sine - p
    return (x - away * cosine, y - away * sine)
