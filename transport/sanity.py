"""Whether what a robot's sensors say can be believed, before anything drives by it."""

from __future__ import annotations

import math

import numpy as np

from transport.arithmetic import norm
from transport.description import Laser
from transport.messages import Odometry, Scan

_ANGLE, _RANGE = 0.01, 0.05
_SEEING = 0.1


def scan_fault(scan: Scan, laser: Laser) -> str:
    """Why a scan does not come from the laser that the profile describes, or nothing."""
    expected, given = laser.geometry(), scan.geometry
    if given.beams != expected.beams:
        return f"the scan has {given.beams} beams, the profile says {expected.beams}"
    ends = (given.angle_min, given.angle_max), (expected.angle_min, expected.angle_max)
    if not np.allclose(*ends, rtol=0, atol=_ANGLE):
        return (
            f"the scan reaches from {given.angle_min:.3f} to {given.angle_max:.3f} rad, "
            f"the profile says {laser.angle_min:.3f} to {laser.angle_max:.3f} rad"
        )
    if abs(given.range_max - expected.range_max) > _RANGE * expected.range_max:
        return f"the scan's longest range is {given.range_max:g} m, the profile says {laser.range_max:g} m"
    ranges = scan.ranges
    if bool((ranges < 0).any()):
        return "the scan has negative ranges"
    measured = np.count_nonzero((ranges >= given.range_min) & (ranges <= given.range_max))
    if measured < _SEEING * given.beams:
        return f"the laser sees next to nothing: {measured} of {given.beams} beams measure a distance"
    return ""


def odometry_fault(odometry: Odometry) -> str:
    """Why odometry makes no sense, or nothing."""
    twist = odometry.twist
    if not all(map(math.isfinite, (odometry.x, odometry.y, twist.forward, twist.left, twist.turn))):
        return "the odometry is not finite"
    length = norm(odometry.qz, odometry.qw)
    if not abs(length - 1) < 0.01:
        return f"the odometry's heading is no unit quaternion about the vertical: its norm is {length:.3f}"
    return ""
