"""Driving to the edge of the map, and to possible doors."""

from __future__ import annotations

from hsm.model.registry import Outcome
from hsm.model.types import Speed
from perception.facts import Facts
from perception.mapping.frames import between
from perception.mapping.planning import Frontier, ShortestWays, Way
from perception.world import DoorPlace
from skills.library import LIBRARY
from skills.motion import BLOCKED, DONE, Headway, Skill, above_zero
from skills.steering.way import along_way
from skills.strategies.destinations import before, nearest_door, way_to
from transport.arithmetic import atan2, distance_between, norm
from transport.messages import Command, Pose, Twist
from transport.section import Point

EXPLORED = Outcome("explored")
NONE = Outcome("none")
SAME = 0.8
"""A piece of the map's rim nearer than this to the one that was chosen is the same one, m."""
OUTSIDE = 0.3
"""A place is outside all walls seen, or about to be, if the way out of the rectangle about them is this long, m."""
LOOKS = 0.3
"""At an edge nearer than this the robot turns to look, m."""
THERE = 0.1
"""The robot has arrived when it is this near, m."""
SQUARE = 0.06
"""And when less than this is left to turn, rad."""


class OnMap(Skill):
    """An activity that drives along paths over the map, which are replanned when the map changes."""

    def __init__(self, speed: Speed) -> None:
        self._speed = above_zero("speed", speed)
        self._headway = Headway(speed=speed)
        self._changes = -1
        self._way: Way = ()

    def _new_plan(self, facts: Facts) -> ShortestWays | None:
        """The ways from here, if the map has changed; begins a map where there is none."""
        world = facts.world
        surveyor = world.begin_map(facts.sweep)
        if surveyor.free_space.changes == self._changes:
            return None
        self._changes = surveyor.free_space.changes
        return surveyor.plan(facts.robot.radius)

    def _drive(self, facts: Facts, *, to_rest: bool) -> Command | Outcome:
        """Along the way."""
        if self._headway.lost(facts):
            return BLOCKED
        if not facts.world.place_known:
            return Command(Twist())
        twist = along_way(self.steering(facts), self._way, facts.pose, self._speed, to_rest=to_rest)
        return Command(twist)


@LIBRARY.activity("explore", outcomes=("explored", "blocked"), holds=("base",))
class Explore(OnMap):
    """Drive to the edge of the map, repeatedly, until no reachable edge is left.

    It chooses the edge with the shortest way out of the maze through it, where the unseen area counts as free. If an
    earlier attempt has found the way out, it drives there unless a wall blocks the way. It begins a map if there is
    none. Outcomes: `explored` when all reachable space has been seen; `blocked` when the robot makes no progress.
    """

    def __init__(self, speed: Speed = 0.5) -> None:
        super().__init__(speed)
        self._chosen: Frontier | None = None
        self._given_up: list[Point] = []
        self._nothing_since: float | None = None
        self._out: Way = ()

    def tick(self, facts: Facts) -> Command | Outcome:
        """The next velocity."""
        if self._nothing_since is None:
            self._nothing_since = facts.time
        plan = self._new_plan(facts)
        if plan is not None:
            self._out = _way_out(facts, plan)
            self._chosen = self._best(plan)
            if self._chosen is not None:
                self._way, self._nothing_since = plan.way_to(plan.space.cell_of(self._chosen.place)), facts.time
        if self._out:
            self._way = self._out
            return self._drive(facts, to_rest=False)
        if self._chosen is None:
            waited = facts.time - self._nothing_since
            return EXPLORED if waited >= self.settings.explore.patience else Command(Twist())
        if distance_between(self._chosen.place, (facts.pose.x, facts.pose.y)) < LOOKS:
            return self._look(facts, self._chosen)
        return self._drive(facts, to_rest=False)

    def _look(self, facts: Facts, frontier: Frontier) -> Command | Outcome:
        """Turn to what has not been seen; what stays unseen, though the robot looks at it, is given up."""
        if self._headway.lost(facts):
            return BLOCKED
        target = between(facts.pose, Pose(*frontier.beyond))
        bearing = atan2(target.y, target.x)
        if abs(bearing) < SQUARE:
            self._given_up.append(frontier.place)
            self._changes = -1
        rate = self.settings.rotate.rate
        turn = max(-rate, min(rate, self.settings.rotate.gain * bearing))
        return Command(self.steering(facts).turn(turn, (0.0, 0.0)))

    def _best(self, plan: ShortestWays) -> Frontier | None:
        """The piece of the rim to drive to: outside all walls seen, if there is one, else on the way outside.

        The one already chosen remains unless another one is better by some time.
        """
        settings = self.settings.explore

        def cost(frontier: Frontier) -> tuple[bool, float]:
            same = self._chosen is not None and distance_between(frontier.place, self._chosen.place) < SAME
            change = 0.0 if same else settings.change
            way = frontier.distance + settings.outward * frontier.outward
            return frontier.outward > OUTSIDE, way / self._speed + change

        left = [
            frontier
            for frontier in plan.frontiers()
            if all(distance_between(frontier.place, place) > LOOKS for place in self._given_up)
        ]
        return min(left, key=cost, default=None)


def _way_out(facts: Facts, plan: ShortestWays) -> Way:
    """The way to where an earlier attempt has left the maze; empty where that is not known or cannot be reached."""
    return way_to(plan, facts.world.way_out) if facts.world.way_out is not None else ()


@LIBRARY.activity("go_to_door", outcomes=("done", "none", "blocked"), holds=("base",))
class GoToDoor(OnMap):
    """Drive to the nearest dead end that may be a door and has not been tried or visited yet.

    Outcomes: `done` when the robot is in front of it, square to it; `none` when there is no such dead end; `blocked`
    when the robot makes no progress.
    """

    def __init__(self, speed: Speed = 0.5) -> None:
        super().__init__(speed)
        self._door: DoorPlace | None = None

    def tick(self, facts: Facts) -> Command | Outcome:
        """The next velocity."""
        plan = self._new_plan(facts)
        if plan is not None:
            away = plan.settings.before_door
            if self._door is None:
                self._door = nearest_door(plan, facts.world.untried_doors(), away)
            self._way = way_to(plan, before(self._door, away)) if self._door else ()
        if self._door is None:
            return NONE
        if not self._way:
            facts.world.dismiss_door(self._door)
            return NONE
        here = between(facts.pose, Pose(*self._way[-1], self._door.facing))
        if norm(here.x, here.y) > THERE:
            return self._drive(facts, to_rest=True)
        if abs(here.heading) > SQUARE and not self._headway.lost(facts):
            rate = self.settings.rotate.rate
            turn = max(-rate, min(rate, self.settings.rotate.gain * here.heading))
            return Command(self.steering(facts).turn(turn, (0.0, 0.0)))
        facts.world.dismiss_door(self._door)
        return DONE
