"""Where a robot is on a path that it is to follow."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class OnPath:
    """A path as a robot sees it that is beside it.

    Attributes:
        aside: how far to the left of the robot the path is, across the path, m.
        error: how far to turn to be along it, rad, counter-clockwise.
        curvature: of the path there, 1/m, positive to the left.
    """

    aside: float
    error: float
    curvature: float = 0.0
