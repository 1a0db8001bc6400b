"""The physics: robots, walls, doors and moving objects as bodies that stop each other."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pymunk
from pymunk.autogeometry import convex_decomposition

from sim.doors import SlidingDoor
from sim.geometry import edges, outline_distance, placed
from sim.maze import Maze, Point, Segments
from sim.objects import Traveller
from transport.description import Limits, RobotDescription
from transport.messages import Pose, Twist, wrap_angle

SLOP = 1e-4
"""How deep the solver lets bodies overlap, m."""
_ROBOT, _SOLID = 1, 2


@dataclass(frozen=True, slots=True)
class Contact:
    """A robot touched something.

    Attributes:
        time: simulated time, s.
        robot: the robot's name.
        other: what it touched: ``wall``, or the name of a door, an object or a robot.
        place: where in the world, m.
        speed: how fast the two approached each other there, m/s.
    """

    time: float
    robot: str
    other: str
    place: Point
    speed: float

    def __str__(self) -> str:
        x, y = self.place
        return f"touched {self.other} at ({x:.2f}, {y:.2f}) m with {self.speed:.2f} m/s"


def limited(twist: Twist, limits: Limits) -> Twist:
    """The twist that the base makes of a command: within its speed limits, as the profile says by norm or by axis."""
    forward, left = twist.forward, twist.left
    if limits.translation == "axis":
        forward = min(max(forward, -limits.speed), limits.speed)
        left = min(max(left, -limits.speed), limits.speed)
    else:
        speed = math.hypot(forward, left)
        if speed > limits.speed:
            forward, left = forward * limits.speed / speed, left * limits.speed / speed
    return Twist(forward, left, min(max(twist.turn, -limits.turn_rate), limits.turn_rate))


def approach(twist: Twist, target: Twist, limits: Limits, duration: float) -> Twist:
    """The twist after a while of getting from one velocity to another within the acceleration limits."""
    dx, dy, dw = target.forward - twist.forward, target.left - twist.left, target.turn - twist.turn
    change, most = math.hypot(dx, dy), limits.acceleration * duration
    share = 1.0 if change <= most else most / change
    most = limits.turn_acceleration * duration
    return Twist(
        twist.forward + share * dx if share < 1.0 else target.forward,
        twist.left + share * dy if share < 1.0 else target.left,
        twist.turn + math.copysign(most, dw) if abs(dw) > most else target.turn,
    )


class Base:
    """A robot's body: it takes a velocity and goes where nothing solid is in the way."""

    def __init__(self, description: RobotDescription, pose: Pose) -> None:
        self.description = description
        self.outline = np.asarray(description.footprint, dtype=np.float64)
        self.body = pymunk.Body(1.0, pymunk.moment_for_poly(1.0, list(description.footprint)))
        self.shapes: list[pymunk.Shape] = [pymunk.Poly(self.body, part) for part in convex_parts(description.footprint)]
        self.twist = Twist()
        self._wanted: tuple[Point, float] = (0.0, 0.0), 0.0
        self.put(pose)

    def put(self, pose: Pose) -> None:
        """Place it, at rest."""
        self.body.position = pose.x, pose.y
        self.body.angle = pose.heading
        self.body.velocity = 0.0, 0.0
        self.body.angular_velocity = 0.0
        self.twist = Twist()

    @property
    def pose(self) -> Pose:
        """Where it is."""
        x, y = self.body.position
        return Pose(x, y, wrap_angle(self.body.angle))

    def drive(self, target: Twist, duration: float, *, touching: bool) -> None:
        """Set the body's velocity for one step so that a constant twist is followed exactly along its arc.

        The solver moves bodies first and then stops those that touch something. Hence a robot in contact takes its
        velocity between the two, or what stopped it would be forgotten at every step.

        Args:
            target: the velocity to strive for.
            duration: length of the step, s.
            touching: whether the robot is in contact with something.
        """
        if self.twist != target:
            self.twist = approach(self.twist, target, self.description.limits, duration)
        twist = self.twist
        half = twist.turn * duration / 2
        chord = 1.0 if abs(half) < 1e-9 else math.sin(half) / half
        middle = self.body.angle + half
        cos, sin = chord * math.cos(middle), chord * math.sin(middle)
        velocity = cos * twist.forward - sin * twist.left, sin * twist.forward + cos * twist.left
        if touching:
            self._wanted = velocity, twist.turn
            self.body.velocity_func = self._take_wanted
        else:
            self.body.velocity_func = pymunk.Body.update_velocity
            self.body.velocity = velocity
            self.body.angular_velocity = twist.turn

    def _take_wanted(self, body: pymunk.Body, _gravity: object, _damping: float, _duration: float) -> None:
        body.velocity, body.angular_velocity = self._wanted


def convex_parts(footprint: Sequence[Point]) -> list[list[Point]]:
    """A footprint, cut into convex polygons."""
    closed = [*footprint, footprint[0]]
    return [[(float(x), float(y)) for x, y in part[:-1]] for part in convex_decomposition(closed, 0.0)]


def _velocity(shape: pymunk.Shape, place: pymunk.Vec2d) -> pymunk.Vec2d:
    return pymunk.Vec2d.zero() if shape.body is None else shape.body.velocity_at_world_point(place)


class World:
    """Everything solid in one maze, and time."""

    def __init__(self, maze: Maze, robots: Mapping[str, tuple[RobotDescription, Pose]], substep: float) -> None:
        self.maze = maze
        self.time = 0.0
        self.contacts: list[Contact] = []
        self._steps = 0
        self._substep = substep
        self._touching: dict[tuple[str, str], int] = {}
        self._in_touch: set[str] = set()
        self._space = pymunk.Space()
        self._space.collision_slop = SLOP
        self._names: dict[pymunk.Shape, str] = {}
        for ax, ay, bx, by in maze.walls.tolist():
            self._add("wall", pymunk.Segment(self._space.static_body, (ax, ay), (bx, by), 0.0), _SOLID)
        self.doors = [SlidingDoor(door) for door in maze.doors]
        self._leaves = [pymunk.Body(body_type=pymunk.Body.KINEMATIC) for _ in self.doors]
        for door, body in zip(self.doors, self._leaves, strict=True):
            self._space.add(body)
            self._add(door.door.name, pymunk.Segment(body, *door.door.leaf, 0.0), _SOLID)
        self.objects = [Traveller(thing) for thing in maze.objects]
        self._things = [pymunk.Body(body_type=pymunk.Body.KINEMATIC) for _ in self.objects]
        for thing, body in zip(self.objects, self._things, strict=True):
            body.position = thing.place
            self._space.add(body)
            for part in convex_parts(thing.thing.outline):
                self._add(thing.thing.name, pymunk.Poly(body, part), _SOLID)
        self.bases = {name: Base(description, pose) for name, (description, pose) in robots.items()}
        for name, base in self.bases.items():
            self._space.add(base.body)
            for shape in base.shapes:
                self._add(name, shape, _ROBOT)
        for other in (_SOLID, _ROBOT):
            self._space.on_collision(_ROBOT, other, begin=self._begin, separate=self._separate)

    def _add(self, name: str, shape: pymunk.Shape, kind: int) -> None:
        shape.collision_type = kind
        self._names[shape] = name
        self._space.add(shape)

    def _begin(self, arbiter: pymunk.Arbiter, _space: pymunk.Space, _data: object) -> None:
        first, second = arbiter.shapes
        place = arbiter.contact_point_set.points[0].point_a
        approach_speed = (_velocity(first, place) - _velocity(second, place)).dot(arbiter.normal)
        for robot, other in ((first, second), (second, first)):
            if robot.collision_type != _ROBOT:
                continue
            pair = self._names[robot], self._names[other]
            self._touching[pair] = self._touching.get(pair, 0) + 1
            if self._touching[pair] == 1:
                self.contacts.append(
                    Contact(self.time, *pair, (float(place.x), float(place.y)), max(float(approach_speed), 0.0))
                )

    def _separate(self, arbiter: pymunk.Arbiter, _space: pymunk.Space, _data: object) -> None:
        first, second = arbiter.shapes
        for robot, other in ((first, second), (second, first)):
            if robot.collision_type == _ROBOT:
                self._touching[self._names[robot], self._names[other]] -= 1

    def carry(self, targets: Mapping[str, Twist], substeps: int) -> None:
        """Let time pass while every robot strives for its target velocity.

        Args:
            targets: a velocity for each robot, within its limits.
            substeps: how many physics steps.
        """
        duration = self._substep
        pairs = [(self.bases[name], target) for name, target in targets.items()]
        moving = [pair for pair in zip(self.doors, self._leaves, strict=True) if not pair[0].at_rest]
        for _ in range(substeps):
            for base, target in pairs:
                base.drive(target, duration, touching=base.description.name in self._in_touch)
            for door, body in moving:
                body.velocity = door.velocity(duration, occupied=self._occupied(door))
            for thing, body in zip(self.objects, self._things, strict=True):
                body.velocity = thing.velocity(duration, self._robot_points())
            self._space.step(duration)
            if self._touching:
                self._in_touch = {robot for (robot, _), count in self._touching.items() if count}
            self._steps += 1
            self.time = self._steps * duration

    def _robot_points(self) -> list[Point]:
        return [(base.body.position.x, base.body.position.y) for base in self.bases.values()]

    def _occupied(self, door: SlidingDoor) -> bool:
        return any(
            outline_distance(placed(base.outline, base.pose), door.doorway()) < 0.1 for base in self.bases.values()
        )

    def solids(self) -> Segments:
        """Walls, doors and objects as they stand now, shape (n, 4)."""
        parts = [self.maze.walls]
        parts += [door.leaf() for door in self.doors]
        parts += [thing.sides() for thing in self.objects]
        return np.concatenate(parts) if len(parts) > 1 else self.maze.walls

    def outlines(self, but: str) -> list[Segments]:
        """The sides of all robots except one, as they stand now."""
        return [edges(placed(base.outline, base.pose)) for name, base in self.bases.items() if name != but]
