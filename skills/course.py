"""The heading that a driving skill keeps: along the walls where the compass knows them, by odometry elsewhere."""

from __future__ import annotations

import math

from perception.facts import Facts
from transport.messages import wrap_angle

TRUSTED = math.radians(30)
"""A larger compass reading belongs to another axis of the maze than the one that is kept."""


class Course:
    """A heading in the odometry frame that the compass keeps correcting."""

    def __init__(self) -> None:
        self._heading: float | None = None

    def error(self, facts: Facts) -> float:
        """How far to turn to be on course, rad, counter-clockwise positive.

        The first call sets the course: along the nearest wall axis, or the robot's heading where there are none.
        """
        heading = facts.observation.odometry.pose.heading
        along_walls = heading + facts.misalignment
        if self._heading is None or (facts.compass.known and abs(wrap_angle(along_walls - self._heading)) < TRUSTED):
            self._heading = along_walls
        return wrap_angle(self._heading - heading)
