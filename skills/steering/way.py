"""Driving along a way over the map."""

from __future__ import annotations

import math

from perception.mapping.frames import between
from perception.mapping.planning import Way
from skills.steering.law import Steering
from transport.arithmetic import atan2, distance_between
from transport.messages import Pose, Twist
from transport.section import Point

NEAREST, FARTHEST = 0.25, 0.6
"""The robot heads for the middle of this stretch of its way, m ahead: corners become arcs."""
BACK = math.radians(100)
"""What is farther round than this the laser does not see: the robot turns to it on the spot first, rad."""
TURNING = 1.0
"""It turns at this rate, rad/s."""
ARRIVING = 1.5
"""Speed for each metre that is left where the robot is to come to rest, 1/s."""


def ahead_on(way: Way, here: Point) -> tuple[Point, float]:
    """The place to head for, and how much of the way is left from where the robot is, m.

    Args:
        way: of at least one place.
        here: where the robot is.
    """
    nearest = min(range(len(way)), key=lambda index: distance_between(way[index], here))
    total, stretch = 0.0, []
    before = way[nearest]
    for place in way[nearest:]:
        total += distance_between(before, place)
        before = place
        if NEAREST <= total <= FARTHEST:
            stretch.append(place)
    if not stretch or total < FARTHEST:
        return way[-1], total
    count = len(stretch)
    return (math.fsum(place[0] for place in stretch) / count, math.fsum(place[1] for place in stretch) / count), total


def along_way(steering: Steering, way: Way, pose: Pose, speed: float, *, to_rest: bool) -> Twist:
    """The velocity along a way.

    Args:
        steering: the law of the robot's base.
        way: of at least one place, in the world model's frame.
        pose: the robot's.
        speed: m/s.
        to_rest: whether the robot stops at the end.
    """
    place, left = ahead_on(way, (pose.x, pose.y))
    target = between(pose, Pose(*place))
    bearing = atan2(target.y, target.x)
    if abs(bearing) > BACK:
        return steering.turn(math.copysign(TURNING, bearing), (0.0, 0.0))
    if to_rest:
        speed = min(speed, ARRIVING * left + 0.05)
    return steering.to_point(Pose(target.x, target.y, bearing), speed)
