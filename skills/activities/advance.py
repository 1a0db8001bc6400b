"""Driving a distance straight on."""

from __future__ import annotations

from hsm.registry import Outcome
from hsm.types import Length, Speed
from perception.facts import Facts
from skills.activities.drive import Drive
from skills.frames import Frame
from skills.library import LIBRARY
from transport.messages import Command


@LIBRARY.activity("advance", outcomes=("done", "blocked"), holds=("base",))
class Advance(Drive):
    """Drive a distance straight on, like `drive`.

    Outcomes: `done` when it is driven, `blocked` when the robot gets no farther.
    """

    def __init__(self, distance: Length, speed: Speed = 0.5) -> None:
        super().__init__(speed)
        self._distance = distance
        self._start: Frame | None = None

    def tick(self, facts: Facts) -> Command | Outcome:
        """The next velocity."""
        pose = facts.observation.odometry.pose
        if self._start is None:
            self._start = Frame(pose)
        if self._start.local(pose).x >= self._distance:
            return Outcome("done")
        return super().tick(facts)
