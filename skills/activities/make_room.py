"""Moving away from obstacles that are too near."""

from __future__ import annotations

from hsm.model.registry import Outcome
from hsm.model.types import Duration
from perception.facts import Facts
from skills.library import LIBRARY
from skills.motion import BLOCKED, DONE, Skill, not_negative
from transport.arithmetic import norm, norms, square
from transport.messages import Command


@LIBRARY.activity("make_room", outcomes=("done", "blocked"), holds=("base",))
class MakeRoom(Skill):
    """Move away from obstacles until there is room around the robot.

    Each hit within reach pushes the robot, less with distance. A base that cannot move sideways drives forward or back,
    and turns if it is pushed to a side. Outcomes: `done` when there is room; `blocked` when that takes too long, for
    example in a narrow place.
    """

    def __init__(self, timeout: Duration = 2.0) -> None:
        self._timeout = not_negative("timeout", timeout)
        self._began: float | None = None

    def tick(self, facts: Facts) -> Command | Outcome:
        """The next velocity."""
        clear = self.settings.safety.clear
        if self._began is None:
            self._began = facts.time
        if facts.clearance > clear:
            return DONE
        if facts.time - self._began > self._timeout:
            return BLOCKED
        distance = norms(facts.points[:, 0], facts.points[:, 1])
        near = facts.points[distance < facts.robot.radius + 2 * clear]
        push = -(near / square(near).sum(axis=1, keepdims=True)).sum(axis=0)
        size = norm(*push.tolist()) or 1.0
        direction = float(push[0]) / size, float(push[1]) / size
        return Command(self.steering(facts).away(direction, self.settings.motion.lateral_speed))
