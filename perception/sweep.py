"""One scan made ready for use: readings sorted into hits, free beams and unknown ones, hits as points of the robot.

Readings mean what REP 117 says: infinity, or a reading at the end of the sensor's range or beyond, that the beam hit
nothing; minus infinity that something is too close to be measured, which is treated as a hit at the shortest range; NaN
that nothing is known. A finite reading below the shortest range means that there was no echo: PICO's sensor and many
others report what they cannot see as a distance near zero.

Where a scan begins says nothing about the world. The beams are put into counter-clockwise order; those of a sensor that
sees all round begin straight behind the robot, whatever the sensor's own first beam and its mounting.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from transport.arithmetic import cosines_and_sines
from transport.compiled import compiled
from transport.messages import ALL_ROUND, Pose, Scan, ScanGeometry

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]
Mask = NDArray[np.bool_]

ORIGIN = Pose()

_BESIDE = 1e-5
"""Directions that differ by less are the same, rad: messages have them in single precision."""

LONGEST_RANGE = 1000.0
"""A range sensor that claims to see farther, in metres, is not believed."""


class FieldOfView(NamedTuple):
    """From where and between which directions a sensor looks, counter-clockwise, in the robot's frame.

    Attributes:
        x: of the sensor, m.
        y: the same.
        first_cosine: of the first beam.
        first_sine: of the first beam.
        last_cosine: of the last beam.
        last_sine: of the last beam.
        span: from the one to the other, rad.
    """

    x: float
    y: float
    first_cosine: float
    first_sine: float
    last_cosine: float
    last_sine: float
    span: float


@dataclass(frozen=True, eq=False)
class BeamTable:
    """The directions of a sensor's beams in the robot's frame; computed once for a geometry and a mounting.

    Attributes:
        angles: rad within [-pi, pi], counter-clockwise from the robot's x axis, shape (n,), in the order of the beams.
        cosines: of the angles.
        sines: of the angles.
        mount: pose of the sensor in the robot's frame.
        step: angle from one beam to the next, rad, positive.
    """

    angles: Floats
    cosines: Floats
    sines: Floats
    mount: Pose
    step: float

    @property
    def ends(self) -> tuple[int, int]:
        """The first and the last beam: what they hit may be cut off by the sensor's view."""
        return 0, len(self.angles) - 1

    def blind(self, points: Floats) -> Floats:
        """The points that the sensor does not look at, whatever is in between, shape (k, 2).

        Args:
            points: in the robot's frame, m, shape (n, 2).
        """
        if self.view is None:
            return points if not len(self.angles) else points[:0]
        return out_of_view(points, self.view)

    @cached_property
    def every(self) -> Indices:
        """All beams, shape (n,); not to be changed."""
        beams = np.arange(len(self.angles))
        beams.flags.writeable = False
        return beams

    @cached_property
    def place(self) -> tuple[float, float]:
        """The sensor's place in the robot's frame, m."""
        return self.mount.x, self.mount.y

    @cached_property
    def view(self) -> FieldOfView | None:
        """What the sensor looks at; None of a sensor that sees all round, or nothing."""
        span = (len(self.angles) - 1) * self.step
        if not len(self.angles) or math.tau - span <= ALL_ROUND * self.step:
            return None
        return FieldOfView(*self.place, *self._direction(0), *self._direction(-1), span)

    def _direction(self, beam: int) -> tuple[float, float]:
        return self.cosines.item(beam), self.sines.item(beam)

    def sector(self, centre: float, width: float) -> Indices:
        """The beams whose direction is within ``width / 2`` of ``centre`` (both in rad), shape (k,)."""
        return _sector(self, centre, width)


@compiled
def out_of_view(points: Floats, view: FieldOfView) -> Floats:
    """The points outside a sensor's field of view, shape (k, 2).

    Args:
        points: in the robot's frame, m, shape (n, 2).
        view: the sensor's.
    """
    x, y = points[:, 0] - view.x, points[:, 1] - view.y
    after_first = view.first_cosine * y - view.first_sine * x >= -_BESIDE
    before_last = view.last_sine * x - view.last_cosine * y >= -_BESIDE
    return points[~(after_first | before_last if view.span > math.pi else after_first & before_last)]


@compiled
def any_nearer(distances: Floats, reach: float) -> bool:
    """Whether a distance is less than a reach."""
    return bool((distances < reach).any())


@compiled
def all_hit(ranges: Floats) -> bool:
    """Whether all of some ranges are finite."""
    return bool(np.isfinite(ranges).all())


@lru_cache(maxsize=1024)
def _sector(fan: BeamTable, centre: float, width: float) -> Indices:
    offset = np.abs((fan.angles - centre + math.pi) % math.tau - math.pi)
    return np.flatnonzero(offset <= width / 2 + _BESIDE)


@lru_cache(maxsize=8)
def fan_of(geometry: ScanGeometry, mount: Pose) -> BeamTable:
    """The beams of a geometry seen by a sensor at ``mount``, in the order of :func:`_order`."""
    order = _order(geometry, mount)
    step = abs(geometry.angle_increment)
    counted = np.arange(geometry.beams) if order is None else order
    directions = geometry.angle_min + geometry.angle_increment * counted.astype(np.float64) + mount.heading
    angles = (directions + math.pi) % math.tau - math.pi
    return BeamTable(angles, *cosines_and_sines(angles), mount, step)


@lru_cache(maxsize=8)
def _order(geometry: ScanGeometry, mount: Pose) -> Indices | None:
    """The beams in counter-clockwise order; None where they come so.

    Of a sensor that sees all round there are as many as fit into the circle, from straight behind the robot on. Those
    that the sensor leaves out between its last beam and its first have numbers beyond its last.
    """
    clockwise = geometry.angle_increment < 0
    around = math.tau / abs(geometry.angle_increment)
    if not geometry.all_round or geometry.beams > around + 2:
        return np.arange(geometry.beams)[::-1] if clockwise else None
    beams = round(around)
    angles = geometry.angle_min + geometry.angle_increment * np.arange(beams) + mount.heading
    first = int(((angles + math.pi) % math.tau).argmin())
    order = np.roll(np.arange(beams)[::-1], first + 1) if clockwise else np.roll(np.arange(beams), -first)
    return None if beams == geometry.beams and not clockwise and first == 0 else order


_NOTHING = np.empty(0)
_EMPTY_FAN = BeamTable(_NOTHING, _NOTHING, _NOTHING, Pose(), math.inf)


def is_plausible(scan: Scan) -> bool:
    """Whether a scan can be read at all: finite angles, positive ranges and as many readings as beams."""
    geometry = scan.geometry
    return (
        np.shape(scan.ranges) == (geometry.beams,)
        and geometry.beams > 0
        and math.isfinite(geometry.angle_min)
        and math.isfinite(geometry.angle_increment)
        and 0 < abs(geometry.angle_increment) * geometry.beams <= 2 * math.tau
        and geometry.range_max > max(geometry.range_min, 0.0)
    )


@compiled
def sort_readings(ranges: Floats, shortest: float, reach: float) -> None:
    """Give readings their meaning, in place.

    Args:
        ranges: as the sensor reports them, m, shape (n,); then infinity where a beam hit nothing, NaN where nothing is
            known.
        shortest: replaces minus infinity; anything shorter counts as missing echo, m.
        reach: from here on, a reading is none, m.
    """
    others = (~((ranges >= shortest) & (ranges < reach))).nonzero()[0]
    if len(others):
        readings = ranges[others]
        free = np.where(np.isnan(readings), np.nan, np.inf)
        ranges[others] = np.where(readings == -np.inf, shortest, free)


@compiled
def points_of(ranges: Floats, cosines: Floats, sines: Floats, place: tuple[float, float]) -> Floats:
    """Where beams end, m in the robot's frame, shape (2, n).

    Args:
        ranges: their lengths, m, shape (n,).
        cosines: of their directions, shape (n,).
        sines: the same.
        place: the sensor's, m.
    """
    columns = np.empty((2, len(ranges)))
    np.multiply(ranges, cosines, out=columns[0])
    np.multiply(ranges, sines, out=columns[1])
    if place[0] or place[1]:
        columns += [[place[0]], [place[1]]]
    return columns


@dataclass(frozen=True, eq=False)
class ScanPoints:
    """The readings of one scan with their meaning.

    Attributes:
        fan: directions of the beams in the robot's frame, counter-clockwise.
        ranges: metres from the sensor, shape (n,); infinity where the beam hit nothing, NaN where nothing is known.
        reach: how far a beam that hit nothing is known to be free, m.
    """

    fan: BeamTable
    ranges: Floats
    reach: float

    @classmethod
    def of(cls, scan: Scan, mount: Pose = ORIGIN) -> ScanPoints:
        """Sort the readings of a scan; a scan that cannot be read gives a sweep without beams."""
        if not is_plausible(scan):
            return cls(_EMPTY_FAN, _NOTHING, 0.0)
        geometry = scan.geometry
        reach = min(geometry.range_max, LONGEST_RANGE)
        ranges, order, shortest = np.array(scan.ranges, dtype=np.float64), _order(geometry, mount), geometry.range_min
        if order is not None:
            # Beams that the sensor leaves out are unknown.
            ranges = np.append(ranges, [np.nan] * max(0, len(order) - len(ranges)))[order]
        sort_readings(ranges, max(shortest, 0.0), reach)
        return cls(fan_of(geometry, mount), ranges, reach)

    def without(self, beams: Indices) -> ScanPoints:
        """The same with nothing known of some beams."""
        ranges = self.ranges.copy()
        ranges[beams] = np.nan
        return ScanPoints(self.fan, ranges, self.reach)

    @cached_property
    def hit(self) -> Mask:
        """Which beams hit something, shape (n,)."""
        return np.isfinite(self.ranges)

    @cached_property
    def complete(self) -> bool:
        """Whether every beam hit something."""
        return all_hit(self.ranges)

    @cached_property
    def beams(self) -> Indices:
        """The beams that hit something, shape (k,)."""
        return self.fan.every if self.complete else self.hit.nonzero()[0]

    @cached_property
    def distances(self) -> Floats:
        """The readings of the beams that hit something, m, shape (k,)."""
        return self._of_hits(self.ranges)

    def _of_hits(self, values: Floats) -> Floats:
        """What belongs to the beams that hit something; mostly that is all of them, and nothing is copied."""
        return values if self.complete else values[self.beams]

    @cached_property
    def points(self) -> Floats:
        """The hits in the robot's frame, m, shape (k, 2), counter-clockwise as the sensor sees them."""
        fan, ranges = self.fan, self.distances
        # The columns lie apart in memory: most uses want all x or all y.
        return points_of(ranges, self._of_hits(fan.cosines), self._of_hits(fan.sines), fan.place).T

    @property
    def free(self) -> Floats:
        """How far each beam is known to be free, m from the sensor, shape (n,); 0 where nothing is known."""
        if self.complete:
            return self.ranges
        return np.fmax(np.minimum(self.ranges, self.reach), 0.0)

    @cached_property
    def known(self) -> Mask:
        """Of which beams anything is known, shape (n,)."""
        return ~np.isnan(self.ranges)

    @cached_property
    def known_share(self) -> float:
        """The share of such beams, 0 to 1; 0 without beams."""
        if self.complete:
            return 1.0 if len(self.ranges) else 0.0
        return float(np.count_nonzero(self.known) / len(self.ranges))
