"""The compass: how the robot must turn to stand along the walls."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from perception.lines import Lines
from perception.settings import CompassSettings
from perception.sweep import Floats


@dataclass(frozen=True, slots=True)
class Compass:
    """The robot's misalignment with its surroundings.

    Attributes:
        misalignment: the smallest turn that brings the robot along the walls, rad, counter-clockwise positive, within
            half a world angle; equally the direction of the walls seen from the robot. Zero where it is not known.
        confidence: share of the walls' weight that agrees with it, 0 to 1; 0 where nothing is known.
        deviation: standard deviation that the hits' noise leaves in it, rad.
    """

    misalignment: float = 0.0
    confidence: float = 0.0
    deviation: float = math.inf

    @property
    def known(self) -> bool:
        """Whether there are straight walls enough to say anything."""
        return self.confidence > 0


UNKNOWN = Compass()


def compass_of(lines: Lines, settings: CompassSettings) -> Compass:
    """The misalignment that most of the walls agree upon.

    Directions are compared modulo the world angle, so that it does not matter which way a wall runs. The wall with
    which most of the others agree names the direction; the walls near it are averaged with the inverse variances of
    their angles as weights, which grow with the third power of a wall's length. Valid for every heading.

    Args:
        lines: the walls, in the robot's frame.
        settings: the world angle and when the walls suffice.
    """
    if not len(lines):
        return UNKNOWN
    world_angle = settings.world_angle
    offsets = _modulo(lines.alpha[:, None] - lines.alpha, world_angle)
    near = np.abs(offsets) <= settings.spread
    lengths = lines.lengths
    # Agreement is counted in length: long walls decide, and a single very well seen one does not outvote all others.
    squares = lengths * lengths
    agreement = near @ squares
    best = int(agreement.argmax())
    agreeing = near[best]
    if _sum(lengths[agreeing]) < settings.min_length:
        return UNKNOWN
    confidence = agreement.item(best) / _sum(squares)
    if confidence < settings.min_confidence:
        return UNKNOWN
    weights = np.minimum(lines.information[agreeing], 1e12)
    total = _sum(weights)
    mean = _sum(weights * offsets[agreeing, best]) / total
    # A wall's normal is a right angle away from its direction.
    direction = lines.alpha.item(best) + mean - math.pi / 2
    return Compass(math.remainder(direction, world_angle), confidence, settings.range_noise / math.sqrt(total))


def _modulo(angles: Floats, period: float) -> Floats:
    """The same angles within half a period of zero."""
    return angles - period * np.rint(angles / period)


def _sum(values: Floats) -> float:
    """What ``values.sum()`` gives, without its way through Python."""
    return float(np.add.reduce(values))
