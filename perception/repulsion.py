"""The artificial potential field: walls push the robot away (2017)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from perception.settings import RepulsionSettings
from perception.sweep import ScanPoints

NEAREST = 0.05
"""A corrected distance below this is taken as this, m: the force stays finite."""


@dataclass(frozen=True, slots=True)
class Force:
    """A push in the robot's frame, scaled by the gain to read as a velocity in m/s.

    Attributes:
        forward: along x; negative pushes back.
        left: along y.
    """

    forward: float = 0.0
    left: float = 0.0


def repulsion_of(sweep: ScanPoints, settings: RepulsionSettings) -> Force:
    """The mean push of all beams: against each beam with 1 / (range - width correction)^2.

    The beams ahead make the force along x, the beams on the sides the force along y, so that a wall beside does not
    brake and one ahead does not push sideways.
    """
    if not len(sweep.beams):
        return Force()
    ranges = np.minimum(sweep.ranges, settings.influence)
    near = ranges < settings.influence
    strength = near / np.square(np.maximum(ranges - settings.width_correction, NEAREST))
    strength[np.isnan(strength)] = 0.0
    ahead = sweep.fan.sector(0.0, settings.front)
    forward = strength[ahead] * sweep.fan.cosines[ahead]
    sideways = strength * sweep.fan.sines
    sideways[ahead] = 0.0
    others = max(len(sideways) - len(ahead), 1)
    return Force(
        forward=-settings.gain * float(forward.sum()) / max(len(ahead), 1),
        left=-settings.gain * float(sideways.sum()) / others,
    )
