"""Ringing the bell of a door."""

from __future__ import annotations

from hsm.registry import Outcome
from perception.facts import Facts
from skills.library import LIBRARY
from skills.motion import Skill
from transport.messages import Command


@LIBRARY.activity("ring", outcomes=("accepted", "refused"), holds=("base", "bell"))
class Ring(Skill):
    """Stand still, ring the bell once, and wait for the answer.

    Outcomes: `accepted` when a door will open, `refused` when none will. A robot whose door does not
    answer has neither.
    """

    def __init__(self) -> None:
        self._since: float | None = None
        self._rung = False

    def tick(self, facts: Facts) -> Command | Outcome:
        """The zero velocity, with the bell once the robot has come to rest."""
        reply = facts.observation.door
        if self._rung and reply is not None:
            return Outcome("accepted" if reply.accepted else "refused")
        if self._since is None:
            self._since = facts.time
        rings = not self._rung and facts.time - self._since >= self.settings.door.settle
        self._rung = self._rung or rings
        return Command(ring=rings)
