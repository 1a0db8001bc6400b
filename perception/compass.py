"""The compass: how the robot must turn to face along the walls."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from perception.lines import Line, Lines
from perception.settings import CompassSettings
from transport.compiled import compiled


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
        """Whether there are enough straight walls for an estimate."""
        return self.confidence > 0


UNKNOWN = Compass()


def compass_of(lines: Lines, settings: CompassSettings) -> Compass:
    """The misalignment on which most of the walls agree.

    Directions are compared modulo the world angle, so that it does not matter which way a wall runs. The wall with
    which most of the others agree names the direction; the walls near it are averaged with the inverse variances of
    their angles as weights, which grow with the third power of a wall's length. Valid for every heading.

    Args:
        lines: the walls, in the robot's frame.
        settings: the world angle and when the walls suffice.
    """
    if not lines:
        return UNKNOWN
    limits = settings.world_angle, settings.spread, settings.min_length, settings.min_confidence
    found = agreed_direction(lines, limits)
    if found is None:
        return UNKNOWN
    misalignment, confidence, information = found
    return Compass(misalignment, confidence, settings.range_noise / math.sqrt(information))


@compiled
def agreed_direction(lines: Lines, limits: tuple[float, float, float, float]) -> tuple[float, float, float] | None:
    """The misalignment with the walls, rad, how confident it is, and its information for a range noise of 1 m, rad^-2.

    Args:
        lines: the walls, at least one.
        limits: the world angle and the spread, rad, the least length, m, and the least confidence.

    Returns:
        None where too few walls agree.
    """
    world_angle, spread, min_length, min_confidence = limits
    named = _named_by_most(lines, world_angle, spread)
    offsets = [math.remainder(line.alpha - named.alpha, world_angle) for line in lines]
    agreeing = [(line, offset) for line, offset in zip(lines, offsets, strict=True) if abs(offset) <= spread]
    if math.fsum([line.length for line, _ in agreeing]) < min_length:
        return None
    confidence = _agreement([line for line, _ in agreeing]) / _agreement(lines)
    if confidence < min_confidence:
        return None
    weights = [min(line.information, 1e12) for line, _ in agreeing]
    total = math.fsum(weights)
    mean = math.fsum([weight * offset for weight, (_, offset) in zip(weights, agreeing, strict=True)]) / total
    # A wall's normal is a right angle away from its direction.
    return math.remainder(named.alpha + mean - math.pi / 2, world_angle), confidence, total


def _named_by_most(lines: Lines, world_angle: float, spread: float) -> Line:
    """The first of the walls with which most of the others agree; mostly, all agree with each."""
    first = lines[0]
    if all(abs(math.remainder(line.alpha - first.alpha, world_angle)) <= spread for line in lines):
        return first
    alphas = np.array([line.alpha for line in lines])
    offsets = alphas[:, None] - alphas
    near = np.abs(offsets - world_angle * np.rint(offsets / world_angle)) <= spread
    return lines[int((near * np.array([line.length * line.length for line in lines])).sum(axis=1).argmax())]


def _agreement(lines: Sequence[Line]) -> float:
    """The total weight of walls.

    Weights are lengths: long walls decide, and a single well-measured one does not outvote all others.
    """
    return math.fsum([line.length * line.length for line in lines])
