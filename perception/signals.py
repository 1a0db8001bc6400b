"""The signals that a machine can name, each a value of the tick's facts.

Where a signal cannot be known, it has the neutral value that its description gives, and a companion signal ending in
``.known`` is false.
"""

from __future__ import annotations

import math

from hsm.model.registry import Library
from hsm.model.types import Angle, Duration, Length, Speed, TurnRate
from perception.facts import Facts
from perception.junction import JunctionKind
from transport.messages import Command

LIBRARY: Library[Facts, Command] = Library("perception")
"""All signals of this module, and the events that the loop sends."""

FAR = 1000.0
"""Metres; what a distance signal gives where nothing is in sight, so that arithmetic on it stays finite."""


def _number(distance: float) -> float:
    return FAR if math.isnan(distance) else min(distance, FAR)


@LIBRARY.signal("space.left")
def space_left(facts: Facts) -> bool:
    """Whether there is space to the left, square to the walls; false if unknown."""
    return facts.space.left.free


@LIBRARY.signal("space.front")
def space_front(facts: Facts) -> bool:
    """Whether there is space ahead, along the walls; false if unknown."""
    return facts.space.front.free


@LIBRARY.signal("space.right")
def space_right(facts: Facts) -> bool:
    """Whether there is space to the right, square to the walls; false if unknown."""
    return facts.space.right.free


@LIBRARY.signal("space.known")
def space_known(facts: Facts) -> bool:
    """Whether the beams to the left, ahead and to the right are all readable."""
    return facts.space.left.known and facts.space.front.known and facts.space.right.known


@LIBRARY.signal("distance.left")
def distance_left(facts: Facts) -> Length:
    """Distance from the laser to the hit of the left beam, square to the walls; 0 if unknown."""
    return facts.space.left.distance


@LIBRARY.signal("distance.front")
def distance_front(facts: Facts) -> Length:
    """Distance from the laser to the hit of the beam ahead, along the walls; 0 if unknown."""
    return facts.space.front.distance


@LIBRARY.signal("distance.right")
def distance_right(facts: Facts) -> Length:
    """Distance from the laser to the hit of the right beam, square to the walls; 0 if unknown."""
    return facts.space.right.distance


@LIBRARY.signal("exit.crossed")
def exit_crossed(facts: Facts) -> bool:
    """Whether the whole robot has been outside the maze for some ticks; false if unknown.

    It is outside when its lane's walls have ended behind it and nothing is in that lane within the laser's range.
    """
    return facts.world.outside_ticks >= facts.settings.exit.ticks


@LIBRARY.signal("misalignment")
def misalignment(facts: Facts) -> Angle:
    """The turn that aligns the robot with the walls: by the compass, otherwise by dead reckoning, otherwise 0."""
    return facts.misalignment


@LIBRARY.signal("misalignment.known")
def misalignment_known(facts: Facts) -> bool:
    """Whether the compass finds enough straight walls in this scan."""
    return facts.compass.known


@LIBRARY.signal("misalignment.confidence")
def misalignment_confidence(facts: Facts) -> float:
    """Share of the walls that agree with the compass, 0 to 1; 0 if unknown."""
    return facts.compass.confidence


@LIBRARY.signal("misalignment.hough")
def misalignment_hough(facts: Facts) -> Angle:
    """The misalignment by the Hough transform, as in 2015: whole degrees; 0 if unknown."""
    return facts.hough_compass.misalignment


@LIBRARY.signal("misalignment.hough.known")
def misalignment_hough_known(facts: Facts) -> bool:
    """Whether the Hough transform found a line with enough hits."""
    return facts.hough_compass.known


@LIBRARY.signal("centre.error")
def centre_error(facts: Facts) -> Length:
    """Distance of the corridor's middle to the left of the robot; 0 unless both walls are seen."""
    return facts.centre.error


@LIBRARY.signal("centre.known")
def centre_known(facts: Facts) -> bool:
    """Whether walls on both sides make a corridor."""
    return facts.centre.known


@LIBRARY.signal("corridor.width")
def corridor_width(facts: Facts) -> Length:
    """Width of the corridor; 1000 m unless both walls are seen."""
    return _number(facts.centre.width)


@LIBRARY.signal("wall.left")
def wall_left(facts: Facts) -> Length:
    """Distance from the robot's origin to the nearest wall on the left; 1000 m if there is none."""
    return _number(facts.wall_left.distance)


@LIBRARY.signal("wall.left.angle")
def wall_left_angle(facts: Facts) -> Angle:
    """The turn that brings the robot parallel to the wall on the left; 0 if there is none."""
    return facts.wall_left.angle


@LIBRARY.signal("wall.left.known")
def wall_left_known(facts: Facts) -> bool:
    """Whether there is a wall on the left."""
    return facts.wall_left.known


@LIBRARY.signal("wall.right")
def wall_right(facts: Facts) -> Length:
    """Distance from the robot's origin to the nearest wall on the right; 1000 m if there is none."""
    return _number(facts.wall_right.distance)


@LIBRARY.signal("wall.right.angle")
def wall_right_angle(facts: Facts) -> Angle:
    """The turn that brings the robot parallel to the wall on the right; 0 if there is none."""
    return facts.wall_right.angle


@LIBRARY.signal("wall.right.known")
def wall_right_known(facts: Facts) -> bool:
    """Whether there is a wall on the right."""
    return facts.wall_right.known


@LIBRARY.signal("junction")
def junction(facts: Facts) -> JunctionKind:
    """The kind of the junction that the robot is in or about to enter; `unknown` if a way is unknown."""
    return facts.junction.kind


@LIBRARY.signal("junction.known")
def junction_known(facts: Facts) -> bool:
    """Whether all ways of the junction are known."""
    return facts.junction.kind is not JunctionKind.UNKNOWN


@LIBRARY.signal("junction.left")
def junction_left(facts: Facts) -> bool:
    """Whether the robot fits into a way to the left; false if unknown."""
    return facts.junction.left.open


@LIBRARY.signal("junction.front")
def junction_front(facts: Facts) -> bool:
    """Whether the robot fits into the way ahead, beyond the ways to the sides; false if unknown."""
    return facts.junction.ahead.open


@LIBRARY.signal("junction.right")
def junction_right(facts: Facts) -> bool:
    """Whether the robot fits into a way to the right; false if unknown."""
    return facts.junction.right.open


@LIBRARY.signal("junction.door_left")
def junction_door_left(facts: Facts) -> bool:
    """Whether the way to the left ends so soon that it may be a door; false if unknown."""
    return facts.junction.door_left


@LIBRARY.signal("junction.door_front")
def junction_door_front(facts: Facts) -> bool:
    """Whether the way ahead is a dead end, which may be a door; false if unknown."""
    return facts.junction.door_ahead


@LIBRARY.signal("junction.door_right")
def junction_door_right(facts: Facts) -> bool:
    """Whether the way to the right ends so soon that it may be a door; false if unknown."""
    return facts.junction.door_right


@LIBRARY.signal("junction.begin")
def junction_begin(facts: Facts) -> Length:
    """How far ahead the first way to a side begins (d2), negative if passed; 1000 m if there is none."""
    return _number(facts.junction.d2)


@LIBRARY.signal("junction.length")
def junction_length(facts: Facts) -> Length:
    """Distance from the beginning of the first way to a side to the end of the last (d3); 1000 m if there is none."""
    return _number(facts.junction.d3)


@LIBRARY.signal("side_path.left")
def side_path_left(facts: Facts) -> bool:
    """Whether the robot has come to the middle of a way to the left; false if unknown."""
    return facts.junction.left.is_beside


@LIBRARY.signal("side_path.right")
def side_path_right(facts: Facts) -> bool:
    """Whether the robot has come to the middle of a way to the right; false if unknown."""
    return facts.junction.right.is_beside


@LIBRARY.signal("open_space")
def open_space(facts: Facts) -> bool:
    """Whether the robot is in or before an open space: a way wider than any corridor, or nothing ahead."""
    return facts.junction.wide


@LIBRARY.signal("corner.left")
def corner_left(facts: Facts) -> Length:
    """Distance to the nearest corner or end of a wall on the left; 1000 m if there is none."""
    return _nearest_node(facts, 1.0)


@LIBRARY.signal("corner.right")
def corner_right(facts: Facts) -> Length:
    """Distance to the nearest corner or end of a wall on the right; 1000 m if there is none."""
    return _nearest_node(facts, -1.0)


def _nearest_node(facts: Facts, side: float) -> float:
    first, last = facts.sweep.fan.ends
    seen = (node for node in facts.nodes if first < node.beam < last)
    return min((node.distance for node in seen if side * node.bearing > 0), default=FAR)


@LIBRARY.signal("minimap.known")
def minimap_known(facts: Facts) -> float:
    """Share of the minimap's cells that are known to be free or occupied, 0 to 1."""
    return facts.minimap.known_share


@LIBRARY.signal("exit.ahead")
def exit_ahead(facts: Facts) -> bool:
    """Whether nothing is ahead of the robot within the range of its laser (2015); false if unknown."""
    return facts.exit_ahead


@LIBRARY.signal("junction.end")
def junction_end(facts: Facts) -> Length:
    """Free length of a lane of the robot's width straight ahead (d4); 1000 m if nothing is in it."""
    return _number(facts.junction.end)


@LIBRARY.signal("clearance")
def clearance(facts: Facts) -> Length:
    """Distance from the robot's outline to the nearest hit; 1000 m if nothing is seen."""
    return _number(facts.clearance)


@LIBRARY.signal("clearance.known")
def clearance_known(facts: Facts) -> bool:
    """Whether the scan is readable."""
    return facts.sweep.known_share > 0


@LIBRARY.signal("repulsion.forward")
def repulsion_forward(facts: Facts) -> Speed:
    """The push of the walls ahead, as a velocity along x; 0 if nothing is near."""
    return facts.repulsion.forward


@LIBRARY.signal("repulsion.left")
def repulsion_left(facts: Facts) -> Speed:
    """The push of the walls on the sides, as a velocity along y; 0 if nothing is near."""
    return facts.repulsion.left


@LIBRARY.signal("door.near")
def door_near(facts: Facts) -> bool:
    """Whether a possible door is ahead and the whole robot is within the area from which it may ring."""
    return facts.door is not None


@LIBRARY.signal("door.tried")
def door_tried(facts: Facts) -> bool:
    """Whether the possible door ahead has been remembered before; false if there is none."""
    return facts.door is not None and facts.world.has_tried(facts.door)


@LIBRARY.signal("door.distance")
def door_distance(facts: Facts) -> Length:
    """Distance from the robot's origin to the possible door ahead; 1000 m if there is none."""
    return facts.door.distance if facts.door else FAR


@LIBRARY.signal("door.open")
def door_open(facts: Facts) -> bool:
    """Whether the door remembered last is fully open; false if none was remembered."""
    return facts.door_open_share >= 0.9


@LIBRARY.signal("door.passable")
def door_passable(facts: Facts) -> bool:
    """Whether the way through the door remembered last is wide enough for the robot; false if there is none."""
    return facts.door_passable


@LIBRARY.action("door.remember")
def door_remember(facts: Facts) -> None:
    """Remember the possible door ahead as tried; does nothing if there is none."""
    if facts.door:
        facts.world.remember_door(facts.door)


@LIBRARY.signal("door.accepted")
def door_accepted(facts: Facts) -> bool:
    """Whether the answer to the last ring came in this tick and a door will open."""
    return facts.observation.door is not None and facts.observation.door.accepted


@LIBRARY.signal("door.refused")
def door_refused(facts: Facts) -> bool:
    """Whether the answer to the last ring came in this tick and no door will open."""
    return facts.observation.door is not None and not facts.observation.door.accepted


@LIBRARY.signal("moved.distance")
def moved_distance(facts: Facts) -> Length:
    """Length of the path since the run began, by odometry."""
    return facts.world.travelled


@LIBRARY.signal("moved.turn")
def moved_turn(facts: Facts) -> Angle:
    """Sum of all turns since the run began, counter-clockwise, not wrapped, by odometry."""
    return facts.world.turned


@LIBRARY.signal("position.x")
def position_x(facts: Facts) -> Length:
    """The robot's x in the world model's frame, which begins where the run began."""
    return facts.pose.x


@LIBRARY.signal("position.y")
def position_y(facts: Facts) -> Length:
    """The robot's y in the world model's frame."""
    return facts.pose.y


@LIBRARY.signal("heading")
def heading(facts: Facts) -> Angle:
    """The robot's heading in the world model's frame, whose axes run along the walls; within half a turn of zero."""
    return facts.pose.heading


@LIBRARY.signal("speed")
def speed(facts: Facts) -> Speed:
    """How fast the base moves, by odometry."""
    return facts.observation.odometry.twist.speed


@LIBRARY.signal("turn_rate")
def turn_rate(facts: Facts) -> TurnRate:
    """How fast the base turns counter-clockwise, by odometry."""
    return facts.observation.odometry.twist.turn


@LIBRARY.signal("link.scan_age")
def link_scan_age(facts: Facts) -> Duration:
    """Age of the newest scan."""
    return facts.observation.link.scan_age


@LIBRARY.signal("link.odometry_age")
def link_odometry_age(facts: Facts) -> Duration:
    """Age of the newest odometry."""
    return facts.observation.link.odometry_age


@LIBRARY.signal("link.reconnects")
def link_reconnects(facts: Facts) -> int:
    """Number of times that the link was lost and found again in this run."""
    return facts.observation.link.reconnects


@LIBRARY.signal("link.blind")
def link_blind(facts: Facts) -> bool:
    """Whether the base is stopped because scan or odometry is too old, refused, or only just back."""
    return bool(facts.observation.link.blind)


@LIBRARY.signal("link.stopped")
def link_stopped(facts: Facts) -> bool:
    """Whether the robot's command time-out has stopped it."""
    return facts.observation.link.stopped


@LIBRARY.signal("navigation.distance")
def navigation_distance(facts: Facts) -> Length:
    """Remaining path of the robot's own navigation, from its feedback; 1000 m without feedback."""
    news = facts.observation.navigation
    return FAR if news is None or news.distance is None else min(news.distance, FAR)


@LIBRARY.signal("navigation.recoveries")
def navigation_recoveries(facts: Facts) -> int:
    """Number of recoveries of the robot's own navigation on the way to the current goal."""
    news = facts.observation.navigation
    return 0 if news is None else news.recoveries


LIBRARY.event("blinded", "the base was stopped because scan or odometry is too old or was refused; see link.blind")
LIBRARY.event("lost", "the robot no longer knows where it is on its map; see place.lost")
LIBRARY.event("found", "the robot that was lost knows again where it is on its map; see place.known")
