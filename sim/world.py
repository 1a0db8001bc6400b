"""The physics: robots, walls, doors and moving objects as bodies that stop each other."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
import pymunk

from sim.body import Body, convex_parts
from sim.doors import SlidingDoor
from sim.geometry import edges, nearest_segment, outline_distance, placed
from sim.maze import Maze, Point, Segments
from sim.objects import MovingObstacle
from transport.description import RobotDescription
from transport.messages import Pose, Twist

SLOP = 1e-4
"""How deep the solver lets bodies overlap, m."""
DOORWAY = 0.1
"""An open door waits while a robot is nearer to the doorway than this, m."""
UNKNOWN = "the edge of the unknown"
"""What a robot touches where a map ends."""
_APART = 0.01
"""A robot that stays farther than this from everything, m, moves without the physics."""
_ROBOT, _SOLID = 1, 2


@dataclass(frozen=True, slots=True)
class Contact:
    """A robot touched something.

    Attributes:
        time: simulated time, s.
        robot: the robot's name.
        other: what it touched: ``wall``, `UNKNOWN`, or the name of a door, an object or a robot.
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


def _velocity(shape: pymunk.Shape, place: pymunk.Vec2d) -> pymunk.Vec2d:
    return pymunk.Vec2d.zero() if shape.body is None else shape.body.velocity_at_world_point(place)


class PhysicalWorld:
    """All solid bodies in one maze, and time."""

    def __init__(
        self, maze: Maze, robots: Mapping[str, tuple[RobotDescription, Pose]], substep: float, began: float = 0.0
    ) -> None:
        """Args: the maze, the robots by name with their poses, the step of the physics and the time now, s."""
        self.maze = maze
        self.time = self._began = began
        self.contacts: list[Contact] = []
        self._steps = 0
        self._substep = substep
        self._touching: dict[tuple[str, str], int] = {}
        self._in_touch: set[str] = set()
        self._solids: Segments | None = None
        self._outlines: dict[str, Segments] = {}
        self._room: dict[str, float] = {}
        self._space = pymunk.Space()
        self._space.collision_slop = SLOP
        self._names: dict[pymunk.Shape, str] = {}
        for name, barriers in (("wall", maze.walls), (UNKNOWN, maze.unknown)):
            for ax, ay, bx, by in barriers.tolist():
                self._add(name, pymunk.Segment(self._space.static_body, (ax, ay), (bx, by), 0.0), _SOLID)
        self.doors = [SlidingDoor(door) for door in maze.doors]
        self._leaves = [pymunk.Body(body_type=pymunk.Body.KINEMATIC) for _ in self.doors]
        for door, body in zip(self.doors, self._leaves, strict=True):
            self._space.add(body)
            self._add(door.door.name, pymunk.Segment(body, *door.door.leaf, 0.0), _SOLID)
        self.objects = [MovingObstacle(thing) for thing in maze.objects]
        self._things = [pymunk.Body(body_type=pymunk.Body.KINEMATIC) for _ in self.objects]
        for thing, body in zip(self.objects, self._things, strict=True):
            body.position = thing.place
            self._space.add(body)
            for part in convex_parts(thing.thing.outline):
                self._add(thing.thing.name, pymunk.Poly(body, part), _SOLID)
        self.bases = {name: Body(description, pose) for name, (description, pose) in robots.items()}
        for group, (name, base) in enumerate(self.bases.items(), start=1):
            self._space.add(base.body)
            for shape in base.shapes:
                # Shapes of one group neither touch each other nor answer each other's queries.
                shape.filter = pymunk.ShapeFilter(group=group)
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
                pair = self._names[robot], self._names[other]
                self._touching[pair] = max(self._touching.get(pair, 0) - 1, 0)

    def carry(self, targets: Mapping[str, Twist], substeps: int) -> None:
        """Let time pass while every robot accelerates to its target velocity.

        Args:
            targets: a velocity for each robot, within its limits.
            substeps: how many physics steps.
        """
        duration = self._substep
        driven = [(name, self.bases[name], target) for name, target in targets.items()]
        doors = [pair for pair in zip(self.doors, self._leaves, strict=True) if not pair[0].at_rest]
        things = list(zip(self.objects, self._things, strict=True))
        if doors or things:
            self._solids = None
        if not doors and not things and self._is_free(targets, substeps * duration):
            for _, base, target in driven:
                base.glide(target, duration, substeps)
            self._steps += substeps
            self.time = self._began + self._steps * duration
            self._room = {}
            return
        self._outlines, self._room = {}, {}
        for _ in range(substeps):
            for name, base, target in driven:
                base.drive(target, duration, touching=name in self._in_touch)
            for door, body in doors:
                body.velocity = door.velocity(duration, partial(self._occupied, door))
            for thing, body in things:
                body.velocity = thing.velocity(duration, self._robot_points())
            self._space.step(duration)
            if self._touching:
                self._in_touch = {robot for (robot, _), count in self._touching.items() if count}
            self._steps += 1
            self.time = self._began + self._steps * duration
        for door, body in doors:
            if door.at_rest:
                body.velocity = 0.0, 0.0

    def _is_free(self, targets: Mapping[str, Twist], duration: float) -> bool:
        """Whether there is one robot, and nothing that stands still around it comes near it within a time (s)."""
        if len(self.bases) > 1 or self._in_touch:
            return False
        for name, target in targets.items():
            base = self.bases[name]
            travel = max(base.twist.speed, target.speed) * duration
            if self.room(name) <= base.radius + travel + _APART:
                return False
        return True

    def _robot_points(self) -> list[Point]:
        return [base.place for base in self.bases.values()]

    def _occupied(self, door: SlidingDoor) -> bool:
        return any(
            outline_distance(placed(base.outline, base.pose), door.doorway()) < DOORWAY for base in self.bases.values()
        )

    def solids(self) -> Segments:
        """Walls, doors and objects as they are now, shape (n, 4)."""
        if self._solids is None:
            parts = [
                self.maze.barriers,
                *(door.leaf() for door in self.doors),
                *(thing.sides() for thing in self.objects),
            ]
            self._solids = np.ascontiguousarray(np.concatenate(parts))
        return self._solids

    def around(self, name: str) -> Segments:
        """All that a robot can see or touch now, other robots among it, shape (n, 4)."""
        if len(self.bases) == 1:
            return self.solids()
        if not self._outlines:
            self._outlines = {other: edges(placed(base.outline, base.pose)) for other, base in self.bases.items()}
        others = [outline for other, outline in self._outlines.items() if other != name]
        return np.concatenate([self.solids(), *others])

    def room(self, name: str) -> float:
        """The distance from a robot's origin to the nearest solid thing, m."""
        if name not in self._room:
            self._room[name] = nearest_segment(*self.bases[name].place, self.around(name))
        return self._room[name]

    def put(self, name: str, pose: Pose) -> None:
        """Lift a robot and put it down elsewhere, at rest."""
        self.bases[name].put(pose)
        self._outlines, self._room = {}, {}
        self._space.reindex_shapes_for_body(self.bases[name].body)
        for pair in [pair for pair in self._touching if name in pair]:
            del self._touching[pair]
        self._in_touch = {robot for (robot, _), count in self._touching.items() if count}
