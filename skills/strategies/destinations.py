"""Places that machines name, and the ways to them over the map."""

from __future__ import annotations

from enum import StrEnum

from perception.facts import Facts
from perception.mapping.planning import EdgeAhead, ShortestWays, Way, along, left_of, length_of
from perception.mapping.surveyor import AHEAD
from perception.marks import Direction
from perception.world import DoorPlace, to_robot
from transport.arithmetic import atan2, cos, distance_between, norm, sin
from transport.description import Point

NEVER = 10_000.0
"""Seconds; the time to where no way leads, so that arithmetic on it stays finite."""
WITHIN = 0.4
"""A place on the map that the robot cannot be on is replaced by one at most this far away, m."""
HERE = 3.0
"""Places nearer to each other than this many radii of the robot are one."""
AWAY = 4.0
"""The robot has gone away after a way of this many times that."""


class Destination(StrEnum):
    """A place that a machine can name."""

    START = "start"
    """Where the map was begun."""
    WAY_OUT = "way_out"
    """Outside, beyond where an earlier attempt has left the maze."""
    EDGE = "edge"
    """The nearest place from which something unexplored can be seen."""
    DOOR = "door"
    """In front of the nearest dead end that may be a door and has not been tried."""
    MARKED = "marked"
    """Where the machine has marked a place last."""


def edges_of(facts: Facts) -> tuple[EdgeAhead, ...]:
    """The pieces of the edge of what has been seen that can be reached; none where the robot's place is not known."""
    surveyor = facts.world.surveyor
    if surveyor is None or not facts.world.place_known:
        return ()
    return surveyor.ways(facts.robot.radius).edges


def direction_of(facts: Facts, place: Point) -> Direction:
    """In which of the four directions a place of the map is, seen from the robot."""
    x, y = to_robot(facts.pose, place)
    if abs(y) > abs(x):
        return Direction.LEFT if y > 0 else Direction.RIGHT
    return Direction.AHEAD if x >= 0 else Direction.BACK


def route_to(facts: Facts, destination: Destination) -> Way | None:
    """The shortest way from the robot to a place; None where none is known, or its own place is not."""
    surveyor = facts.world.surveyor
    if surveyor is None or not facts.world.place_known:
        return None
    plan = surveyor.ways(facts.robot.radius).plan
    goal = goal_of(facts, plan, destination)
    way = way_to(plan, goal) if goal is not None else ()
    return left_of(way, (facts.pose.x, facts.pose.y)) if way else None


def way_to(plan: ShortestWays, goal: Point) -> Way:
    """The way to a place or to what can be reached beside it; empty where there is none."""
    cell = plan.nearest(goal, WITHIN)
    return plan.way_to(cell) if cell is not None else ()


def goal_of(facts: Facts, plan: ShortestWays, destination: Destination) -> Point | None:
    """Where a destination is on the map, m; None where there is none.

    Args:
        facts: of the tick; there is a map.
        plan: the ways from the robot.
        destination: what is searched for.
    """
    world = facts.world
    assert world.surveyor is not None
    match destination:
        case Destination.START:
            start = world.surveyor.keyframe(0)
            return start.x, start.y
        case Destination.WAY_OUT:
            return world.way_out
        case Destination.MARKED:
            marked = None if world.marked is None else world.marks.places.pose_of(world.marked)
            return None if marked is None else (marked.x, marked.y)
        case Destination.DOOR:
            away = plan.settings.before_door
            door = nearest_door(plan, world.untried_doors(), away)
            return None if door is None else before(door, away)
        case Destination.EDGE:
            edges = world.surveyor.ways(facts.robot.radius).edges
            nearest = min(edges, key=lambda edge: edge.frontier.distance, default=None)
            return None if nearest is None else nearest.frontier.place


def before(door: DoorPlace, away: float) -> Point:
    """The place so far in front of a dead end, m."""
    return door.centre[0] - away * cos(door.facing), door.centre[1] - away * sin(door.facing)


def nearest_door(plan: ShortestWays, doors: list[DoorPlace], away: float) -> DoorPlace | None:
    """Of several dead ends the one to whose front the way is the shortest; None where none can be reached.

    Args:
        plan: the ways from the robot.
        doors: the dead ends.
        away: the way ends so far in front of them, m.
    """
    reached = []
    for number, door in enumerate(doors):
        cell = plan.nearest(before(door, away), WITHIN)
        if cell is not None:
            reached.append((float(plan.distance[cell]), number))
    if not reached:
        return None
    _, nearest = min(reached)
    return doors[nearest]


def turn_to(facts: Facts, route: Way) -> float:
    """The turn towards the beginning of a way, rad; 0 for a robot that is at its end."""
    towards = along(route, AHEAD * facts.robot.radius) or route[-1]
    x, y = to_robot(facts.pose, towards)
    return atan2(y, x) if norm(x, y) > facts.robot.radius / 2 else 0.0


def time_of(facts: Facts, route: Way) -> float:
    """How long a way takes at the robot's greatest speed, with the turn towards its beginning, s."""
    limits = facts.robot.limits
    return length_of(route) / limits.speed + abs(turn_to(facts, route)) / limits.turn_rate


def visited(facts: Facts) -> bool:
    """Whether the robot has come back to where it was before."""
    surveyor = facts.world.surveyor
    if surveyor is None or not facts.world.place_known:
        return False
    here, gone = (facts.pose.x, facts.pose.y), 0.0
    near = HERE * facts.robot.radius
    last = here
    for number in range(len(surveyor.mapper.clouds) - 1, -1, -1):
        pose = surveyor.keyframe(number)
        place = (pose.x, pose.y)
        gone += distance_between(place, last)
        last = place
        if gone > AWAY * near and distance_between(place, here) <= near:
            return True
    return False
