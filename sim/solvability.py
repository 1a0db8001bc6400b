"""Whether a maze can be solved at all, where its outside begins, and which way its exits face."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from sim.free_space import Flags, FreeSpace, flood, within
from sim.maze import Maze, MazeError, Point, Segments
from transport.description import RobotDescription

STEP = 0.025
"""Grid step of all searches, m."""
OUTSIDE_RADII = (1.0, 1.5, 2.0, 3.0, 4.0)
"""Radii of the discs that feel for the outside, m: openings wider than the smallest one's diameter are still closed."""
SNAP = 0.15
"""An exit that was found on the grid is drawn to the end of a wall that is as near as this, m."""


def find_exits(maze: Maze) -> Maze:
    """The maze with its exits found: the openings through which its inside touches its outside.

    The outside is what a disc of two metres in diameter can cover that rolls in from afar without touching a wall; it
    does not fit into a corridor, so it stops where a corridor opens to the outside. Larger discs are tried as long as
    the smaller one reaches the start.

    Raises:
        MazeError: the start lies outside, or nothing leads out.
    """
    walls = (
        np.concatenate([maze.walls, [[*door.leaf[0], *door.leaf[1]] for door in maze.doors]])
        if maze.doors
        else maze.walls
    )
    for radius in OUTSIDE_RADII:
        space = FreeSpace.around(walls, maze.bounds, limit=radius, step=STEP * 2, margin=2 * radius)
        outside = _outside(space, radius)
        start = space.cell(maze.start_point)
        if outside[start]:
            continue
        without_doors = FreeSpace.around(maze.walls, maze.bounds, limit=0.1, step=STEP * 2, margin=2 * radius)
        inside = flood((without_doors.clearance > 0.06) & ~outside, _seed(space, maze.start_point)) >= 0
        exits = _openings(space, inside, outside, walls)
        if len(exits):
            return replace(maze, exits=exits)
        raise MazeError(
            maze.name, "no way leads from the start to the outside", hint="leave an opening in the outer wall"
        )
    raise MazeError(
        maze.name,
        f"the start at ({maze.start_point[0]:.2f}, {maze.start_point[1]:.2f}) m lies outside of the maze",
        hint="the robot must start among the walls",
    )


def _outside(space: FreeSpace, radius: float) -> Flags:
    centres = space.clearance >= radius - 1e-9
    border = np.zeros_like(centres)
    border[0, :] = border[-1, :] = border[:, 0] = border[:, -1] = True
    return within(flood(centres, border) >= 0, round(radius / space.step))


def _openings(space: FreeSpace, inside: Flags, outside: Flags, walls: Segments) -> Segments:
    """One segment an opening, from the grid's fringe between inside and outside; the outside to its left."""
    fringe = inside & within(outside, 1)
    exits = []
    ends = walls.reshape(-1, 2)
    remaining = fringe.copy()
    while remaining.any():
        seed = np.zeros_like(remaining)
        row, column = np.argwhere(remaining)[0]
        seed[row, column] = True
        piece = flood(within(remaining, 2), seed) >= 0
        rows, columns = np.nonzero(piece & remaining)
        remaining &= ~piece
        points = np.stack([space.origin[0] + space.step * columns, space.origin[1] + space.step * rows], axis=1)
        if len(points) < 3:
            continue
        first, second = _farthest(points)
        middle = points.mean(axis=0)
        touching = _centre(outside & within(piece, 2), space)
        a, b = _snapped(first, ends), _snapped(second, ends)
        if math.dist(a, b) < 0.1:
            continue
        side = (b[0] - a[0]) * (touching[1] - middle[1]) - (b[1] - a[1]) * (touching[0] - middle[0])
        exits.append((*a, *b) if side > 0 else (*b, *a))
    return np.asarray(exits, dtype=np.float64).reshape(-1, 4)


def _farthest(points: Segments) -> tuple[Point, Point]:
    first = points[int(np.argmax(((points - points[0]) ** 2).sum(axis=1)))]
    second = points[int(np.argmax(((points - first) ** 2).sum(axis=1)))]
    return (float(first[0]), float(first[1])), (float(second[0]), float(second[1]))


def _centre(mask: Flags, space: FreeSpace) -> Point:
    rows, columns = np.nonzero(mask)
    return space.origin[0] + space.step * float(columns.mean()), space.origin[1] + space.step * float(rows.mean())


def _snapped(point: Point, ends: Segments) -> Point:
    distances = np.hypot(ends[:, 0] - point[0], ends[:, 1] - point[1])
    best = int(np.argmin(distances))
    return (float(ends[best, 0]), float(ends[best, 1])) if distances[best] <= SNAP else point


def orient_exits(maze: Maze) -> Maze:
    """The maze with each exit turned so that the outside lies to its left.

    Raises:
        MazeError: an exit does not part the inside from the outside.
    """
    exits = []
    for number, (ax, ay, bx, by) in enumerate(maze.exits.tolist(), start=1):
        length = math.hypot(bx - ax, by - ay)
        left = (-(by - ay) / length, (bx - ax) / length)
        sides = [(0.5 * (ax + bx) + sign * 0.1 * left[0], 0.5 * (ay + by) + sign * 0.1 * left[1]) for sign in (1, -1)]
        barrier = np.concatenate([maze.walls, maze.exits])
        space = FreeSpace.around(barrier, maze.bounds, limit=0.05, step=STEP, margin=1.0)
        reached = flood(space.clearance > 0.6 * STEP, _seed(space, maze.start_point)) >= 0
        inner = [bool(reached[space.cell(side)]) for side in sides]
        if inner[0] and inner[1]:
            raise MazeError(
                maze.name,
                f"exit {number} at ({ax:g}, {ay:g})-({bx:g}, {by:g}) m does not part inside from outside",
                hint="both of its sides can be reached from the start without crossing an exit",
            )
        exits.append((bx, by, ax, ay) if inner[0] else (ax, ay, bx, by))
    return replace(maze, exits=np.asarray(exits, dtype=np.float64).reshape(-1, 4))


def _seed(space: FreeSpace, point: Point) -> Flags:
    seeds = np.zeros(space.clearance.shape, dtype=np.bool_)
    seeds[space.cell(point)] = True
    return seeds


def shortest_way(maze: Maze, radius: float | None = None) -> float | None:
    """Length of the shortest way, in steps along x and y, from the start through an exit with the doors open.

    Args:
        maze: a maze with exits.
        radius: what must fit everywhere: a disc of this radius, m; by default the one that PICO sweeps when it turns.

    Returns:
        Metres, to the millimetre of the grid, or None where no way leads out.
    """
    radius = RobotDescription().radius if radius is None else radius
    space = FreeSpace.around(maze.walls, maze.bounds, limit=radius + STEP, step=STEP, margin=3 * radius)
    fits = space.clearance >= radius - STEP / 4
    start = space.nearest(maze.start_point, fits)
    if start is None:
        return None
    seeds = np.zeros_like(fits)
    seeds[start] = True
    steps = flood(fits, seeds)
    ways = []
    for ax, ay, bx, by in maze.exits.tolist():
        length = math.hypot(bx - ax, by - ay)
        outward = (-(by - ay) / length, (bx - ax) / length)
        for along in np.linspace(0.0, 1.0, 41).tolist():
            x = ax + along * (bx - ax) + radius * outward[0]
            y = ay + along * (by - ay) + radius * outward[1]
            row, column = space.cell((x, y))
            if 0 <= row < fits.shape[0] and 0 <= column < fits.shape[1] and steps[row, column] >= 0:
                ways.append(int(steps[row, column]))
    return min(ways) * STEP if ways else None


def checked(maze: Maze) -> Maze:
    """The maze, complete and known to be solvable by a robot of PICO's size.

    Raises:
        MazeError: it has no walls, no way out, or no room at the start.
    """
    if len(maze.walls) == 0:
        raise MazeError(maze.name, "the maze has no walls")
    if not np.isfinite(maze.walls).all():
        raise MazeError(maze.name, "a wall's coordinate is not a finite number")
    maze = orient_exits(maze) if len(maze.exits) else find_exits(maze)
    radius = RobotDescription().radius
    if _clearance_at(maze) < radius:
        x, y = maze.start_point
        raise MazeError(
            maze.name,
            f"the robot does not fit at its start ({x:.2f}, {y:.2f}) m: a wall is nearer than {radius:.2f} m",
            hint="move the start away from the walls",
        )
    if shortest_way(maze) is None:
        raise MazeError(
            maze.name,
            f"the maze has no way out for a robot that needs {2 * radius:.2f} m of width",
            hint="open or widen a passage from the start to an exit",
        )
    return maze


def _clearance_at(maze: Maze) -> float:
    x, y = maze.start_point
    a, d = maze.walls[:, :2], maze.walls[:, 2:] - maze.walls[:, :2]
    p = np.array([x, y]) - a
    along = np.clip((p * d).sum(axis=1) / np.maximum((d * d).sum(axis=1), 1e-300), 0.0, 1.0)
    return float(np.hypot(*(p - along[:, None] * d).T).min())
