"""Ringing the bell of a door."""

from __future__ import annotations

from hsm.model.registry import Outcome
from perception.facts import Facts
from skills.library import LIBRARY
from skills.motion import Skill
from transport.messages import Command

AT_REST = 0.02
"""A robot that is slower than this stands still, m/s."""


@LIBRARY.activity("ring", outcomes=("accepted", "refused"), holds=("base", "bell"))
class Ring(Skill):
    """Stand still, ring the bell once, and wait for the answer.

    Outcomes: `accepted` when a door will open, `refused` when none will. Without an answer from the door there is no
    outcome.
    """

    def __init__(self) -> None:
        self._began: float | None = None
        self._moved = 0.0
        self._rung = False

    def tick(self, facts: Facts) -> Command | Outcome:
        """The zero velocity, with the bell once the robot has come to rest."""
        reply = facts.observation.door
        if self._rung and reply is not None:
            return Outcome("accepted" if reply.accepted else "refused")
        time, settle = facts.time, self.settings.door.settle
        if self._began is None:
            self._began = self._moved = time
        if facts.observation.odometry.twist.speed > AT_REST:
            self._moved = time
        # A robot that avoids something is never quite at rest; while ringing it still stands still.
        rings = not self._rung and (time - self._moved >= settle or time - self._began >= 2 * settle)
        self._rung = self._rung or rings
        return Command(ring=rings)
