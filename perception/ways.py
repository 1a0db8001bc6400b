"""Ways into which the robot fits: where one half of a scan shows a free rectangle beyond a wall."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from perception.extremes import highest, lowest
from perception.lines import Lines
from perception.settings import JunctionSettings
from perception.sweep import Floats, Indices, Mask, ScanPoints
from transport.arithmetic import cos_sin, tan


@dataclass(frozen=True, slots=True)
class Way:
    """The knowledge about the way to one side or ahead.

    Lengths are in the frame turned along the walls, measured from the robot's origin: along the corridor for a way to a
    side, to the left for the way ahead.

    Attributes:
        open: whether the robot is seen to fit in.
        known: whether it is known to be open or closed; False where what matters is hidden or was not measured.
        near: where the opening begins, m: its edge nearer to the robot, or its right edge for the way ahead.
        far: where it ends, m.
        depth: how far beyond the wall it is seen to be free, m; 0 where it is not open.
        ended: whether a wall across it is seen at that depth.
    """

    open: bool = False
    known: bool = False
    near: float = math.nan
    far: float = math.nan
    depth: float = 0.0
    ended: bool = False

    @property
    def width(self) -> float:
        """From edge to edge, m; NaN where it is not open."""
        return self.far - self.near

    @property
    def is_beside(self) -> bool:
        """Whether the robot is past the middle of a way to a side: more of it is behind than ahead (2015)."""
        return self.open and -self.near > self.far

    @property
    def middle(self) -> float:
        """Between the edges, m; NaN where it is not open."""
        return (self.far + self.near) / 2


SLIGHT = 0.03
"""A beam leads to a side if this much of its direction does."""

UNSEEN = Way()
CLOSED = Way(known=True)


class WallSpan(NamedTuple):
    """A wall along x.

    Attributes:
        level: its y, m.
        low: lowest x, m.
        high: highest x, m.
    """

    level: float
    low: float
    high: float

    @property
    def is_end(self) -> bool:
        """Whether it is only the end of a wall across."""
        return self.high == self.low


class Gap(NamedTuple):
    """A run of beams that go beyond a line along x.

    Attributes:
        low: lowest x that is seen free on that line, m.
        high: highest x.
        first: first beam, at the high end.
        last: last beam.
    """

    low: float
    high: float
    first: int
    last: int

    @property
    def width(self) -> float:
        """From end to end, m."""
        return self.high - self.low


class BeamEnds(NamedTuple):
    """Where all beams end, in the robot's place but turned along the walls: x along the corridor, y to the left.

    Attributes:
        cosines: of the beams' directions, shape (n,).
        sines: the same.
        ends: where each beam ends, m, shape (2, n); at the sensor where nothing is known of the beam.
        hit: whether it ends at something.
        origin: the sensor's place, m.
        walls: those that run along x, on both sides.
    """

    cosines: Floats
    sines: Floats
    ends: Floats
    hit: Mask
    origin: tuple[float, float]
    walls: list[WallSpan]

    @classmethod
    def of(cls, sweep: ScanPoints, lines: Lines, misalignment: float) -> BeamEnds:
        """Turn a scan and its walls by the misalignment."""
        cosine, sine = cos_sin(misalignment)
        cosines = sweep.fan.cosines * cosine + sweep.fan.sines * sine
        sines = sweep.fan.sines * cosine - sweep.fan.cosines * sine
        ranges = sweep.free
        mount = sweep.fan.mount
        x, y = mount.x * cosine + mount.y * sine, mount.y * cosine - mount.x * sine
        ends = np.empty((2, len(ranges)))
        np.multiply(ranges, cosines, out=ends[0])
        np.multiply(ranges, sines, out=ends[1])
        if x or y:
            ends += [[x], [y]]
        return cls(cosines, sines, ends, sweep.hit, (x, y), _flanks(lines, cosine, sine))

    def left(self) -> View:
        """The view to the left: y to the left, x ahead."""
        (x, y), (origin_x, origin_y) = self.ends, self.origin
        beams = _in_order(self.sines > SLIGHT)
        walls = [wall for wall in self.walls if wall.level > 0]
        cotangent = self.cosines[beams] / self.sines[beams]
        return View(cotangent, x[beams], y[beams], self.hit[beams], (origin_x, origin_y), walls)

    def right(self) -> View:
        """The view to the right: y to the right, x ahead."""
        (x, y), (origin_x, origin_y) = self.ends, self.origin
        beams = _in_order(self.sines < -SLIGHT)
        walls = [WallSpan(-wall.level, wall.low, wall.high) for wall in self.walls if wall.level < 0]
        # Mirrored, the beams come in the other order.
        cotangent = -self.cosines[beams][::-1] / self.sines[beams][::-1]
        return View(cotangent, x[beams][::-1], -y[beams][::-1], self.hit[beams][::-1], (origin_x, -origin_y), walls)

    def ahead(self) -> View:
        """The view ahead: y ahead, x to the right; without walls, since a way ahead begins where no wall must be."""
        (x, y), (origin_x, origin_y) = self.ends, self.origin
        beams = _in_order(self.cosines > SLIGHT)
        cotangent = -self.sines[beams] / self.cosines[beams]
        return View(cotangent, -y[beams], x[beams], self.hit[beams], (-origin_y, origin_x), [])


_NOTHING = np.empty(0)
NOTHING_SEEN = BeamEnds(_NOTHING, _NOTHING, np.empty((2, 0)), np.empty(0, np.bool_), (0.0, 0.0), [])
"""Unknown surroundings."""


def _flanks(lines: Lines, cosine: float, sine: float) -> list[WallSpan]:
    """The walls that run along x, in the frame turned by an angle that is given by its cosine and sine.

    Of a wall across x that is on one side only, the end that points at the robot is one, without length.
    """
    flanks = []
    for line in lines:
        (x0, y0), (x1, y1) = line.start, line.end
        low, high = x0 * cosine + y0 * sine, x1 * cosine + y1 * sine
        first, last = y0 * cosine - x0 * sine, y1 * cosine - x1 * sine
        if low > high:
            low, high = high, low
        if abs(last - first) <= 0.3 * (high - low):
            flanks.append(WallSpan((first + last) / 2, low, high))
        elif first * last > 0:
            flanks.append(WallSpan(min(first, last, key=abs), (low + high) / 2, (low + high) / 2))
    return flanks


def _in_order(towards: Mask) -> slice | Indices:
    """The beams that lead to one side, in order; a slice where they follow each other, which saves copies."""
    runs = _runs(towards)
    if len(runs) <= 1:
        return slice(*runs[0]) if runs else slice(0)
    # The beams of a sensor that looks all round begin somewhere within the half.
    beams = towards.nonzero()[0]
    return np.roll(beams, runs[0][0] - runs[0][1])


def _runs(mask: Mask, bridged: int = 0) -> list[tuple[int, int]]:
    """Where a mask is true: the first of each run and the one behind its last; ``bridged`` false ones end no run."""
    runs = []
    # Bytes are searched without the cost of a call to numpy for each step.
    values, end = mask.tobytes().rstrip(b"\0"), bytes(bridged + 1)
    first = values.find(1)
    while first >= 0:
        stop = values.find(end, first)
        runs.append((first, stop if stop >= 0 else len(values)))
        first = values.find(1, stop) if stop >= 0 else -1
    return runs


class View(NamedTuple):
    """The half of the surroundings around one direction, its y axis, beams in order from positive x to negative x.

    Attributes:
        cotangent: x over y of each beam's direction, falling.
        x: where each beam ends, m.
        y: the same along y.
        hit: whether it ends at something.
        origin: the sensor's place, m.
        walls: the walls along x.
    """

    cotangent: Floats
    x: Floats
    y: Floats
    hit: Mask
    origin: tuple[float, float]
    walls: list[WallSpan]

    def crossing(self, level: float, beam: int) -> float:
        """Where a beam crosses a line along x, m."""
        return self.origin[0] + (level - self.origin[1]) * self.cotangent.item(beam)

    def lane(self, half_width: float) -> float:
        """How far a lane along y is free, m; infinity where nothing is in it."""
        inside = self.hit & (np.abs(self.x) <= half_width)
        return lowest(self.y[inside])

    def is_empty(self, half_angle: float, distance: float) -> bool:
        """Whether nothing is seen within an angle of the y axis up to a distance; two bad beams do not count."""
        within = slice(self._after(tan(half_angle)), self._after(-tan(half_angle)))
        x, y = self.x[within], self.y[within]
        return bool(len(x)) and int(np.count_nonzero(x * x + y * y < distance * distance)) <= 2

    def wall(self, settings: JunctionSettings) -> float:
        """Distance to the nearest wall of the corridor beside the robot or ahead of it, m; NaN where there is none.

        The end of a wall bounds the corridor only beside the robot: farther ahead the corridor becomes narrow there.
        """
        front = settings.ahead + settings.max_width
        of_corridor = (
            wall.level
            for wall in self.walls
            if wall.low <= (settings.beside if wall.is_end else front) and wall.high >= -settings.behind
        )
        return min((level for level in of_corridor if level <= settings.max_wall), default=math.nan)

    def gaps(self, level: float, limit: float = math.inf) -> list[Gap]:
        """The free stretches of a line along x up to x = ``limit``, from low x to high.

        Two bad beams do not end one.
        """
        height = level - self.origin[1]
        begin = self._after((limit - self.origin[0]) / height) if height > 0 and limit < math.inf else 0
        return [
            self._gap(level, begin + first, begin + stop - 1)
            for first, stop in reversed(_runs(self.y[begin:] > level, bridged=2))
        ]

    def _gap(self, level: float, first: int, last: int) -> Gap:
        """The stretch of a line that some beams cross."""
        return Gap(self.crossing(level, last), self.crossing(level, first), first, last)

    def _after(self, cotangent: float) -> int:
        """The first beam whose cotangent is not more than this."""
        return len(self.cotangent) - int(self.cotangent[::-1].searchsorted(cotangent, "right"))

    def clipped(self, gap: Gap, bottom: float, top: float) -> tuple[float, float]:
        """The part of a gap before which no hit lies between two levels, as lowest and highest x."""
        between = self.hit & (self.y > bottom) & (self.y < top)
        before, after = slice(0, gap.first), slice(gap.last + 1, None)
        return (
            max(gap.low, highest(self.x[after][between[after]])),
            min(gap.high, lowest(self.x[before][between[before]])),
        )

    def far_corner(self, gap: Gap, level: float) -> float:
        """Where the wall at ``level`` continues after a gap: the x of the last hits before it."""
        before = range(max(gap.first - 3, 0), gap.first)
        wall = (self.x.item(beam) for beam in before if self.hit[beam] and self.y.item(beam) > level - 0.1)
        return min(wall, default=math.inf)


def _fifth(values: Floats) -> float:
    """The 20th percentile of the values."""
    values, index = values.copy(), len(values) // 5
    values.partition(index)
    return values.item(index)


@dataclass(frozen=True, eq=False)
class Fitting:
    """The search for ways in one view.

    Attributes:
        view: the half of the scan.
        box: width of the box that must fit, m.
        settings: window, depth and margins.
    """

    view: View
    box: float
    settings: JunctionSettings

    @property
    def limit(self) -> float:
        """Nothing farther ahead than this matters, m."""
        return self.settings.ahead + 1.1 * self.settings.max_width

    def side(self) -> Way:
        """The way to the view's side that begins before the window ends.

        A gap counts as far back as the walls do, and as far as the sensor sees it: of a way that the robot has mostly
        passed, the rest may be too narrow for the box, and the way is over.
        """
        if not len(self.view.y):
            return UNSEEN
        reference = self.view.wall(self.settings)
        level = self.settings.assumed_wall if math.isnan(reference) else reference
        known = True
        for gap in self.view.gaps(level + self.settings.edge, self.limit):
            if gap.low > self.settings.ahead or gap.high < 0.0 or gap.width < self.box:
                continue
            way = self._into(gap, level)
            if way.open:
                return way
            known = known and way.known
        return CLOSED if known else UNSEEN

    def ahead(self, edge: float, *, after_sides: bool) -> Way:
        """The way ahead, seen in the view that looks ahead.

        Args:
            edge: where the ways to the sides end, or how far to look, m.
            after_sides: whether there are ways to the sides, so that the robot can move sideways before the way ahead.
        """
        view, settings = self.view, self.settings
        if not len(view.y):
            return UNSEEN
        deep = edge + settings.depth
        bottom = edge - settings.edge if after_sides else 0.0
        for free in view.gaps(deep):
            beside = free.high < -settings.assumed_wall or free.low > settings.assumed_wall
            if beside or free.width < self.box:
                continue
            low, high = view.clipped(free, bottom, deep)
            if high - low >= self.box:
                # The view's x points to the right: y = -x.
                depth = _fifth(view.y[free.first : free.last + 1]) - edge
                return Way(open=True, known=True, near=-high, far=-low, depth=depth)
        return CLOSED

    def _into(self, gap: Gap, level: float) -> Way:
        """Fit the box into a gap of the wall at ``level``."""
        view, settings = self.view, self.settings
        level = self._outer_wall(gap, level)
        deep = level + settings.depth
        near, far = view.crossing(level, gap.last), view.far_corner(gap, level)
        for free in view.gaps(deep, self.limit):
            if free.last < gap.first or free.first > gap.last or free.width < self.box:
                continue
            low, high = view.clipped(free, level + settings.edge, deep)
            high = min(high, far)
            if high - max(low, near, -settings.behind) >= self.box:
                return self._way(gap, free, level, Way(near=near, far=high))
        beams = slice(gap.first, gap.last + 1)
        hits = view.hit[beams] & (view.y[beams] < deep)
        bound = min(gap.high, lowest(view.x[beams][hits]))
        return UNSEEN if bound - max(gap.low, -settings.behind) >= self.box else CLOSED

    def _outer_wall(self, gap: Gap, level: float) -> float:
        """The outer one of the two walls between which a gap is: they may be offset."""
        reach, highest = self.settings.box_reach, level + self.settings.max_offset
        for wall in self.view.walls:
            joins = min(abs(wall.high - gap.low), abs(wall.low - gap.high)) <= reach and wall.level <= highest
            # Where a wall across is seen through the gap, its end may only be where it comes into sight.
            if joins and not wall.is_end:
                level = max(level, wall.level)
        return level

    def _way(self, gap: Gap, free: Gap, level: float, edges: Way) -> Way:
        """The way behind a gap into which the box fits, unless it may only be a recessed wall."""
        view, settings = self.view, self.settings
        inside = slice(free.first, free.last + 1)
        depths = view.y[inside] - level
        depth = _fifth(depths)
        across = view.hit[inside] & (np.abs(depths - depth) <= 0.1)
        ended = int(np.count_nonzero(across)) >= 0.75 * len(across)
        if ended and depth <= settings.recess:
            if edges.width > settings.max_recess_width:
                return CLOSED
            # Where the sensor does not see its beginning, it may be a niche or a corridor that was wider.
            if gap.last >= len(view.y) - 3:
                return UNSEEN
        return Way(open=True, known=True, near=edges.near, far=edges.far, depth=depth, ended=ended)
