"""Driving over the map to a place that a machine names."""

from __future__ import annotations

from hsm.model.registry import Outcome
from hsm.model.types import Speed
from perception.facts import Facts
from perception.mapping.planning import ShortestWays
from skills.activities.explore import NONE, THERE, OnMap
from skills.library import LIBRARY
from skills.motion import DONE
from skills.strategies.destinations import Destination, goal_of, way_to
from transport.arithmetic import distance_between
from transport.description import Point
from transport.messages import Command


@LIBRARY.activity("go_to", outcomes=("done", "none", "blocked"), holds=("base",))
class GoTo(OnMap):
    """Drive over the map to a place: its start, the marked place, the way out, the nearest edge or possible door.

    The nearest edge and door are chosen once. It begins a map if there is none. Outcomes: `done` when the robot is
    there, with any heading; `none` when no way leads there, or no such place is known; `blocked` when the robot makes
    no progress.
    """

    def __init__(self, to: Destination, speed: Speed = 0.5) -> None:
        super().__init__(speed)
        self._to = to
        self._chosen: Point | None = None

    def tick(self, facts: Facts) -> Command | Outcome:
        """The next velocity."""
        plan = self._new_plan(facts)
        if plan is not None:
            goal = self._goal(facts, plan)
            self._way = way_to(plan, goal) if goal is not None else ()
        if not self._way:
            return NONE
        if distance_between(self._way[-1], (facts.pose.x, facts.pose.y)) <= THERE:
            return DONE
        return self._drive(facts, to_rest=True)

    def _goal(self, facts: Facts, plan: ShortestWays) -> Point | None:
        """Where to go; a place that is fixed moves with the map."""
        if self._to not in (Destination.EDGE, Destination.DOOR):
            return goal_of(facts, plan, self._to)
        if self._chosen is None:
            self._chosen = goal_of(facts, plan, self._to)
        return self._chosen
