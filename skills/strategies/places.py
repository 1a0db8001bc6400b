"""The map, for machines that use it."""

from __future__ import annotations

from hsm.model.types import Angle, Duration, Length
from perception.facts import Facts
from perception.mapping.confidence import Knowledge
from perception.mapping.planning import length_of
from perception.marks import Direction
from perception.signals import FAR
from skills.library import LIBRARY
from skills.strategies.destinations import (
    NEVER,
    Destination,
    direction_of,
    edges_of,
    route_to,
    time_of,
    turn_to,
    visited,
)
from transport.messages import wrap_angle


@LIBRARY.action("map.begin")
def map_begin(facts: Facts) -> None:
    """Begin a map where the robot is; from then on the map gives its position. Does nothing if there is a map."""
    facts.world.begin_map(facts.sweep)


@LIBRARY.signal("map.known")
def map_known(facts: Facts) -> bool:
    """Whether there is a map."""
    return facts.world.surveyor is not None


@LIBRARY.signal("map.doors")
def map_doors(facts: Facts) -> int:
    """Number of dead ends on the map that may be doors and have not been tried."""
    return len(facts.world.untried_doors())


@LIBRARY.signal("map.edges")
def map_edges(facts: Facts) -> int:
    """Number of pieces of the map's edge that the robot can reach; 0 if its place is unknown."""
    return len(edges_of(facts))


@LIBRARY.signal("map.unexplored")
def map_unexplored(facts: Facts, way: Direction) -> bool:
    """Whether the shortest way to an unexplored area begins in this direction, relative to the robot's heading.

    False if its place is unknown.
    """
    return any(direction_of(facts, edge.towards) is way for edge in edges_of(facts))


@LIBRARY.signal("place.x")
def place_x(facts: Facts) -> Length:
    """The robot's x on the map; 0 m if unknown."""
    return facts.pose.x if facts.world.place_known else 0.0


@LIBRARY.signal("place.y")
def place_y(facts: Facts) -> Length:
    """The robot's y on the map; 0 m if unknown."""
    return facts.pose.y if facts.world.place_known else 0.0


@LIBRARY.signal("place.heading")
def place_heading(facts: Facts) -> Angle:
    """The robot's heading on the map, counter-clockwise from x; 0 if unknown."""
    return wrap_angle(facts.pose.heading) if facts.world.place_known else 0.0


@LIBRARY.signal("place.visited")
def place_visited(facts: Facts) -> bool:
    """Whether the robot has been here before, within 3 of its radii, and has been elsewhere since.

    False if its place is unknown.
    """
    return visited(facts)


@LIBRARY.action("place.mark")
def place_mark(facts: Facts) -> None:
    """Mark this place as the destination `marked`, instead of an earlier one. The mark moves with the map."""
    facts.world.mark_place()


@LIBRARY.signal("way.known")
def way_known(facts: Facts, to: Destination) -> bool:
    """Whether the map shows a way to a place; false if the robot's own place is unknown."""
    return route_to(facts, to) is not None


@LIBRARY.signal("way.distance")
def way_distance(facts: Facts, to: Destination) -> Length:
    """Length of the shortest way to a place; 1000 m if none is known."""
    route = route_to(facts, to)
    return FAR if route is None else min(length_of(route), FAR)


@LIBRARY.signal("way.time")
def way_time(facts: Facts, to: Destination) -> Duration:
    """The shortest time to a place at the robot's speeds; 10000 s if no way is known."""
    route = route_to(facts, to)
    return NEVER if route is None else time_of(facts, route)


@LIBRARY.signal("way.turn")
def way_turn(facts: Facts, to: Destination) -> Angle:
    """The turn towards the beginning of the shortest way to a place; 0 if none is known."""
    route = route_to(facts, to)
    return 0.0 if route is None else turn_to(facts, route)


@LIBRARY.signal("place.known")
def place_known(facts: Facts) -> bool:
    """Whether the scan fits the map at the robot's estimated place; false without a map.

    While it is false, nothing enters the map.
    """
    return facts.world.place_known


@LIBRARY.signal("place.lost")
def place_lost(facts: Facts) -> bool:
    """Whether the robot has lost its place on the map; false without a map."""
    return facts.world.surveyor is not None and facts.world.surveyor.knowledge is Knowledge.LOST


@LIBRARY.signal("place.deviation")
def place_deviation(facts: Facts) -> Length:
    """Standard deviation of the robot's position, seen from the map near it; 1000 m without a map and when lost."""
    surveyor = facts.world.surveyor
    if surveyor is None or surveyor.knowledge is Knowledge.LOST:
        return FAR
    return min(surveyor.deviation, FAR)
