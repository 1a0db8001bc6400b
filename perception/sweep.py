"""One scan made ready for use: readings sorted into hits, free beams and unknown ones, hits as points of the robot.

A reading at the end of the sensor's range or beyond, infinity and a reading below the sensor's shortest range all mean
that the beam hit nothing (PICO's sensor reports what it cannot see as a distance near zero). NaN and minus infinity (an
object too close to be measured, REP 117) mean that nothing is known of the beam.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from transport.arithmetic import cosines, sines
from transport.messages import Pose, Scan, ScanGeometry

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]
Mask = NDArray[np.bool_]

ORIGIN = Pose()

LONGEST_RANGE = 1000.0
"""A range sensor that claims to see farther, in metres, is not believed."""


@dataclass(frozen=True, eq=False)
class Fan:
    """The directions of a sensor's beams in the robot's frame; worked out once for a geometry and a mounting.

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

    def sector(self, centre: float, width: float) -> Indices:
        """The beams whose direction is within ``width / 2`` of ``centre`` (both in rad), shape (k,)."""
        return _sector(self, centre, width)


@lru_cache(maxsize=1024)
def _sector(fan: Fan, centre: float, width: float) -> Indices:
    offset = np.abs((fan.angles - centre + math.pi) % math.tau - math.pi)
    return np.flatnonzero(offset <= width / 2 + 1e-9)


@lru_cache(maxsize=8)
def fan_of(geometry: ScanGeometry, mount: Pose) -> Fan:
    """The beams of a geometry seen by a sensor at ``mount``, in counter-clockwise order."""
    angles = geometry.angles() + mount.heading
    if geometry.angle_increment < 0:
        angles = angles[::-1]
    angles = (angles + math.pi) % math.tau - math.pi
    return Fan(angles, cosines(angles), sines(angles), mount, abs(geometry.angle_increment))


_NOTHING = np.empty(0)
_EMPTY_FAN = Fan(_NOTHING, _NOTHING, _NOTHING, Pose(), math.inf)


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


@dataclass(frozen=True, eq=False)
class Sweep:
    """The readings of one scan with their meaning.

    Attributes:
        fan: directions of the beams in the robot's frame, counter-clockwise.
        ranges: metres from the sensor, shape (n,); infinity where the beam hit nothing, NaN where nothing is known.
        reach: how far a beam that hit nothing is known to be free, m.
    """

    fan: Fan
    ranges: Floats
    reach: float

    @classmethod
    def of(cls, scan: Scan, mount: Pose = ORIGIN) -> Sweep:
        """Sort the readings of a scan; a scan that cannot be read gives a sweep without beams."""
        if not is_plausible(scan):
            return cls(_EMPTY_FAN, _NOTHING, 0.0)
        geometry = scan.geometry
        reach = min(geometry.range_max, LONGEST_RANGE)
        ranges = np.array(scan.ranges, dtype=np.float64)
        if geometry.angle_increment < 0:
            ranges = ranges[::-1].copy()
        others = (~((ranges >= max(geometry.range_min, 0.0)) & (ranges < reach))).nonzero()[0]
        if len(others):
            unknown = np.isnan(ranges[others]) | (ranges[others] == -np.inf)
            ranges[others] = np.where(unknown, np.nan, np.inf)
        return cls(fan_of(geometry, mount), ranges, reach)

    @cached_property
    def hit(self) -> Mask:
        """Which beams hit something, shape (n,)."""
        return np.isfinite(self.ranges)

    @cached_property
    def beams(self) -> Indices:
        """The beams that hit something, shape (k,)."""
        return self.hit.nonzero()[0]

    @cached_property
    def distances(self) -> Floats:
        """The readings of the beams that hit something, m, shape (k,)."""
        return self._of_hits(self.ranges)

    def _of_hits(self, values: Floats) -> Floats:
        """What belongs to the beams that hit something; mostly that is all of them, and nothing is copied."""
        return values if len(self.beams) == len(values) else values[self.beams]

    @cached_property
    def points(self) -> Floats:
        """The hits in the robot's frame, m, shape (k, 2), counter-clockwise as the sensor sees them."""
        fan, ranges = self.fan, self.distances
        # The columns lie apart in memory: most uses want all x or all y.
        x, y = columns = np.empty((2, len(ranges)))
        np.multiply(ranges, self._of_hits(fan.cosines), out=x)
        np.multiply(ranges, self._of_hits(fan.sines), out=y)
        if fan.mount.x or fan.mount.y:
            columns += [[fan.mount.x], [fan.mount.y]]
        return columns.T

    @property
    def free(self) -> Floats:
        """How far each beam is known to be free, m from the sensor, shape (n,); 0 where nothing is known."""
        if len(self.beams) == len(self.ranges):
            return self.ranges
        return np.fmax(np.minimum(self.ranges, self.reach), 0.0)

    @cached_property
    def known(self) -> Mask:
        """Of which beams anything is known, shape (n,)."""
        return ~np.isnan(self.ranges)

    @cached_property
    def known_share(self) -> float:
        """The share of such beams, 0 to 1; 0 without beams."""
        if len(self.beams) == len(self.ranges):
            return 1.0 if len(self.beams) else 0.0
        return float(np.count_nonzero(self.known) / len(self.ranges))
