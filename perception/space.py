"""Space to the left, ahead and to the right: the beams of 2017."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from perception.settings import SpaceSettings
from perception.sweep import Floats, Indices, ScanPoints
from transport.compiled import compiled


@dataclass(frozen=True, slots=True)
class Beam:
    """What a beam of some width sees.

    Attributes:
        distance: m from the sensor to the nearest thing that is not a stray reading; the sensor's reach where there is
            nothing, 0 where nothing is known.
        free: whether that is beyond the beam's threshold; False where nothing is known.
        known: whether at least half of the readings could be used.
    """

    distance: float = 0.0
    free: bool = False
    known: bool = False


@dataclass(frozen=True, slots=True)
class Space:
    """Whether there is space to the left, ahead and to the right."""

    left: Beam
    front: Beam
    right: Beam


def look(sweep: ScanPoints, direction: float, width: float, threshold: float, bad_share: float) -> Beam:
    """Look in one direction.

    A single reading must not close a way, nor shall a thin post be overlooked: the shortest ``bad_share`` of the
    readings, and always the shortest one of three or more, are skipped; the next one is the distance.

    Args:
        sweep: the scan.
        direction: rad in the robot's frame.
        width: rad.
        threshold: m.
        bad_share: 0 to 1.
    """
    beams = sweep.fan.sector(direction, width)
    seen = seen_in_sector(sweep.ranges, beams, bad_share)
    if math.isnan(seen):
        return Beam()
    distance = min(seen, sweep.reach)
    return Beam(distance, distance >= threshold, known=True)


@compiled
def seen_in_sector(ranges: Floats, beams: Indices, bad_share: float) -> float:
    """The distance that some beams show, m: infinity where there is nothing, NaN where too few are known.

    Args:
        ranges: of all beams, m, shape (n,).
        beams: which of them, shape (k,).
        bad_share: 0 to 1; see `look`.
    """
    chosen = ranges[beams]
    known = len(beams) - int(np.count_nonzero(np.isnan(chosen)))
    if not known or 2 * known < len(beams):
        return math.nan
    passed_over = max(int(bad_share * known), int(known >= 3))
    chosen.sort()  # NaN comes behind all numbers
    return chosen.item(min(passed_over, known - 1))


def space_of(sweep: ScanPoints, misalignment: float, settings: SpaceSettings) -> Space:
    """Look to the left, ahead and to the right, along the walls whatever the robot's heading between them.

    Args:
        sweep: the scan.
        misalignment: direction of the walls seen from the robot, rad.
        settings: width and thresholds.
    """
    side, front, share = settings.side, settings.front, settings.bad_share
    return Space(
        left=look(sweep, misalignment + math.pi / 2, settings.width, side, share),
        front=look(sweep, misalignment, settings.width, front, share),
        right=look(sweep, misalignment - math.pi / 2, settings.width, side, share),
    )
