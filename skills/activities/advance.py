"""Driving a distance straight on."""

from __future__ import annotations

from hsm.model.registry import Outcome
from hsm.model.types import Length, Speed
from perception.facts import Facts
from skills.activities.drive import Drive
from skills.frames import Frame
from skills.library import LIBRARY
from skills.motion import DONE, above_zero
from skills.passage import Passage


@LIBRARY.activity("advance", outcomes=("done", "blocked"), holds=("base",))
class Advance(Drive):
    """Drive a distance straight on, like `drive`.

    The robot does not stop at the end, so the next activity need not start from rest; `move` stops. Outcomes: `done`
    after the distance, `blocked` when the robot makes no progress.
    """

    def __init__(self, distance: Length, speed: Speed = 0.5) -> None:
        super().__init__(speed)
        self._distance = above_zero("distance", distance)
        self._start: Frame | None = None

    def _ended(self, facts: Facts, passage: Passage) -> Outcome | None:
        pose = facts.observation.odometry.pose
        if self._start is None:
            self._start = Frame(pose)
        return DONE if self._start.local(pose).x >= self._distance or self._arrived(facts) else None

    def _arrived(self, facts: Facts) -> bool:
        """Whether the robot is where it should be before it has driven the distance."""
        return False
