"""Checks whether sensor data can be trusted, before it is used."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from transport.arithmetic import norm
from transport.compiled import compiled
from transport.description import Laser
from transport.messages import NANOSECONDS, DoorReply, LinkStatus, Observation, Odometry, Scan, ScanGeometry

_ANGLE, _RANGE = 0.01, 0.05
_FEW, _FEW_SHARE = 3, 0.02
"""The number of beams may differ by this many, and by this share of them."""
_SEEING = 0.1
_REACHED = 1.5
"""A direction is measured if a beam is this near to it, in steps from beam to beam."""


class ScanError(ValueError):
    """A scan that cannot be trusted; the message says why."""


def conformed(scan: Scan, laser: Laser) -> Scan:
    """A scan as the profile's laser gives it.

    A laser that turns clockwise, whose number of beams varies by a few, or that sees all round from anywhere on, gives
    scans of the same directions. They are put into the profile's order, each direction with its nearest beam; one
    that no beam measures reads NaN.

    Args:
        scan: as it came.
        laser: what the profile says.

    Raises:
        ScanError: the scan is of another laser, or shows almost nothing.
    """
    expected, given = laser.geometry(), scan.geometry
    if np.shape(scan.ranges) != (given.beams,):
        raise ScanError(f"the scan has {np.size(scan.ranges)} ranges for {given.beams} beams")
    if fault := _fan_fault(given, expected) or _range_fault(given, expected):
        raise ScanError(fault)
    taken = _beams(given, expected)
    if taken is not None:
        shape = replace(expected, range_min=given.range_min, range_max=given.range_max)
        scan = Scan(scan.stamp, shape, np.where(taken < 0, np.float32(math.nan), scan.ranges[taken]))
    if fault := blindness(scan):
        raise ScanError(fault)
    return scan


def _fan_fault(given: ScanGeometry, expected: ScanGeometry) -> str:
    """Why a scan's directions are not those of the profile's laser, or nothing."""
    few = max(_FEW, round(_FEW_SHARE * expected.beams))
    if abs(given.beams - expected.beams) > few or given.beams < 2:
        return f"the scan has {given.beams} beams, the profile says {expected.beams} (robot.laser.beams)"
    step = abs(given.angle_increment)
    first, last = sorted((given.angle_min, given.angle_max))
    tolerance = max(_ANGLE, (abs(given.beams - expected.beams) + _REACHED) * abs(expected.angle_increment))
    turned = 0.0 if given.all_round and expected.all_round else math.remainder(first - expected.angle_min, math.tau)
    longer = (last - first) - (expected.angle_max - expected.angle_min)
    if step > 0 and abs(turned) <= tolerance and abs(turned + longer) <= tolerance:
        return ""
    return (
        f"the scan reaches from {given.angle_min:.3f} to {given.angle_max:.3f} rad, "
        f"the profile says {expected.angle_min:.3f} to {expected.angle_max:.3f} rad (robot.laser.angle_min, angle_max)"
    )


def _range_fault(given: ScanGeometry, expected: ScanGeometry) -> str:
    if abs(given.range_max - expected.range_max) <= _RANGE * expected.range_max:
        return "" if 0 <= given.range_min < given.range_max else f"the scan's shortest range is {given.range_min:g} m"
    return (
        f"the scan's longest range is {given.range_max:g} m, "
        f"the profile says {expected.range_max:g} m (robot.laser.range_max)"
    )


@lru_cache(maxsize=16)
def _beams(given: ScanGeometry, expected: ScanGeometry) -> NDArray[np.intp] | None:
    """The beam for each of the profile's directions, -1 where there is none; None where they are the same."""
    step = abs(given.angle_increment)
    first = min(given.angle_min, given.angle_max)
    if given.beams == expected.beams and given.angle_increment > 0 and abs(first - expected.angle_min) < step / 2:
        return None
    away = expected.angles() - first
    away = (away + step / 2) % math.tau - step / 2 if given.all_round else away - math.tau * round(away[0] / math.tau)
    nearest = np.rint(away / step).astype(np.intp)
    last = given.beams - 1
    if given.all_round:
        # What lies between the last beam and the first one is measured by the nearer of them.
        nearest = np.where(away / step > last + (math.tau / step - last) / 2, 0, np.minimum(nearest, last))
    beams = np.clip(nearest, 0, last)
    apart = np.abs((away - beams * step + math.pi) % math.tau - math.pi)
    beams[apart > _REACHED * step] = -1
    # Beams that turn clockwise are counted from the other end.
    return np.where(beams < 0, -1, last - beams) if given.angle_increment < 0 else beams


def blindness(scan: Scan) -> str:
    """That a laser sees almost nothing, or nothing.

    A beam that reads below the shortest range, as of a laser that has stopped turning, measures nothing; one that reads
    minus infinity, infinity or more than the longest range does.
    """
    beams = scan.geometry.beams
    seeing, too_near, negative = counted(np.asarray(scan.ranges, dtype=np.float32), scan.geometry.range_min)
    if seeing < _SEEING * beams:
        seeing += too_near
    if seeing < _SEEING * beams:
        return f"the laser sees almost nothing: {seeing} of {beams} beams measure anything"
    return "the scan has negative ranges" if negative else ""


@compiled
def counted(ranges: NDArray[np.float32], shortest: float) -> tuple[int, int, bool]:
    """How many readings are at least the shortest range, how many are minus infinity, and whether others are negative.

    Args:
        ranges: m, shape (n,).
        shortest: m, in single precision.
    """
    negative = (ranges < 0) & np.isfinite(ranges)
    return int(np.count_nonzero(ranges >= shortest)), int(np.count_nonzero(ranges == -np.inf)), bool(negative.any())


def odometry_fault(odometry: Odometry) -> str:
    """Why odometry makes no sense, or nothing."""
    twist = odometry.twist
    parts = (odometry.x, odometry.y, twist.forward, twist.left, twist.turn)
    if not (
        math.isfinite(odometry.x + odometry.y + twist.forward + twist.left + twist.turn)
        or all(map(math.isfinite, parts))
    ):
        return "the odometry is not finite"
    length = norm(odometry.qz, odometry.qw)
    if not abs(length - 1) < 0.01:
        return f"the odometry's heading is not a unit quaternion about the vertical: its norm is {length:.3f}"
    return ""


def observed(stamp: int, scan: Scan, odometry: Odometry, door: DoorReply | None = None) -> Observation:
    """An observation where one clock stamps everything, as in lockstep: ages and faults follow from the data alone.

    Args:
        stamp: now, ns.
        scan: the newest scan.
        odometry: the newest odometry.
        door: the answer to a ring, if one came.
    """
    refused = blindness(scan) or odometry_fault(odometry)
    if not refused and scan.stamp == odometry.stamp == stamp:
        return Observation(stamp, scan, odometry, door)
    ages = (stamp - scan.stamp) / NANOSECONDS, (stamp - odometry.stamp) / NANOSECONDS
    return Observation(stamp, scan, odometry, door, LinkStatus(*ages, refused=refused))
