"""A maze in another size."""

from __future__ import annotations

from dataclasses import replace

from sim.maze import Maze, MazeDoor, MovingObject, Point, Reach, Start
from transport.messages import Pose


def scaled(maze: Maze, size: float) -> Maze:
    """A maze in which every length, and the speed of all that moves, is multiplied; angles and times stay."""

    def point(at: Point) -> Point:
        return size * at[0], size * at[1]

    def start(at: Start) -> Start:
        spread = Pose(size * at.spread.x, size * at.spread.y, at.spread.heading)
        return Start(Pose(size * at.pose.x, size * at.pose.y, at.pose.heading), spread)

    def door(one: MazeDoor) -> MazeDoor:
        return replace(one, leaf=(point(one.leaf[0]), point(one.leaf[1])), speed=size * one.speed)

    def thing(one: MovingObject) -> MovingObject:
        outline, path = tuple(map(point, one.outline)), tuple(map(point, one.path))
        return replace(one, outline=outline, path=path, speed=size * one.speed, near=size * one.near)

    goal = (
        replace(maze.goal, place=point(maze.goal.place), radius=size * maze.goal.radius)
        if isinstance(maze.goal, Reach)
        else maze.goal
    )
    return replace(
        maze,
        walls=size * maze.walls,
        start=start(maze.start),
        exits=size * maze.exits,
        doors=tuple(map(door, maze.doors)),
        objects=tuple(map(thing, maze.objects)),
        others=tuple(map(start, maze.others)),
        unknown=size * maze.unknown,
        goal=goal,
    )
