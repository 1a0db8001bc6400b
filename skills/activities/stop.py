"""Standing still."""

from __future__ import annotations

from perception.facts import Facts
from skills.library import LIBRARY
from skills.motion import Skill
from transport.messages import Command


@LIBRARY.activity("stop", holds=("base",))
class Stop(Skill):
    """Stand still."""

    def tick(self, facts: Facts) -> Command:
        """The zero velocity."""
        return Command()
