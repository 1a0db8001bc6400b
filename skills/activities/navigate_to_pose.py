"""Driving with the robot's own navigation."""

from __future__ import annotations

from hsm.model.registry import Outcome
from hsm.model.types import Angle, Duration, Length
from perception.facts import Facts
from skills.library import LIBRARY
from skills.motion import BLOCKED, DONE, Headway, Skill, Stopwatch, above_zero, finite
from transport.messages import Command, Pose

ANSWER = 5.0
"""A navigation that has not accepted the goal after this long counts as absent, s."""


@LIBRARY.activity("navigate_to_pose", outcomes=("done", "blocked", "unavailable"), holds=("base",))
class NavigateToPose(Skill):
    """Drive to a pose in the robot's map with its own navigation (the ROS 2 action of Nav2).

    The navigation drives, with its planner, costmaps and recoveries; the guard of this library is not used. The goal is
    cancelled when the state is left, and when the base must stop because sensor data is missing. Outcomes: `done` when
    the navigation reports success; `blocked` when it refuses the goal, fails, or makes no progress for the time
    `patience`; `unavailable` without a server for the action, as with a simulated robot and behind a gate.
    """

    def __init__(self, x: Length, y: Length, heading: Angle = 0.0, patience: Duration = 30.0) -> None:
        self._goal = Pose(finite("x", x), finite("y", y), finite("heading", heading))
        self._patience = above_zero("patience", patience)
        self._headway = Headway(patience)
        self._watch = Stopwatch()
        self._asked = False

    def tick(self, facts: Facts) -> Command | Outcome:
        """The goal; the first tick has none, so that an older one is given up."""
        news = facts.observation.navigation
        if not self._asked:
            self._asked = True
            return Command()
        if news is None or news.goal != self._goal or news.state == "asked":
            return Outcome("unavailable") if self._watch.update(facts) > ANSWER else Command(goal=self._goal)
        if news.state == "missing":
            return Outcome("unavailable")
        if news.state == "arrived":
            return DONE
        if news.state == "failed" or self._headway.lost(facts):
            return BLOCKED
        return Command(goal=self._goal)
