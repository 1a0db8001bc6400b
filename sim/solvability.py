"""Whether a robot can reach the goal of a maze, where its outside begins, and which way exits face."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sim.free_space import DistanceGrid, Flags, flood, within
from sim.geometry import distances
from sim.maze import Leave, Maze, Point, Reach, Segments
from transport.arithmetic import distance_between, norm, norms, square

COARSE, STEP = 0.05, 0.025
"""Grid steps of the searches for a way, m: the fine one is tried where the coarse one finds none."""
OUTSIDE_RADII = (1.0, 1.5, 2.0, 3.0, 4.0)
"""Radii of the discs that find the outside, m: openings narrower than the smallest one's diameter count as shut."""
SNAP = 0.15
"""An exit that was found on the grid is drawn to the end of a wall that is as near as this, m."""
LARGEST = 200.0
"""Mazes longer or wider than this are refused, m."""
LARGEST_AREA = 20_000.0
"""Mazes with a larger bounding box than this are refused, m^2: they would take more memory than a laptop has."""
THIN = 0.03
"""Half the width of the narrowest gap that a search on the grid finds for certain, m."""


class UnsolvableError(Exception):
    """A maze in which no robot can reach the goal.

    Attributes:
        reason: why.
        hint: how to fix it; may be empty.
        at: the place of the problem in the maze, m.
    """

    def __init__(self, reason: str, at: Point, hint: str = "") -> None:
        self.reason, self.at, self.hint = reason, at, hint
        super().__init__(reason)


class ClosedError(UnsolvableError):
    """A maze without exits whose inside and outside are not connected."""


def checked(maze: Maze, *, radius: float) -> Maze:
    """The completed maze, checked to let a robot reach the goal.

    Where the robot is to leave, exits are found if the maze has none, and a way leads out; where it is to reach a
    place, a way leads there. Exits are turned outwards.

    Args:
        maze: as it was drawn.
        radius: of the disc that the robot sweeps when it turns, which must fit everywhere, m.

    Raises:
        UnsolvableError: it has no walls or is too large, there is no room at the start, or there is no way.
    """
    if len(maze.barriers) == 0:
        raise UnsolvableError("the maze has no walls", maze.start_point)
    _refuse_large(maze)
    for start in maze.starts:
        x, y = start.pose.x, start.pose.y
        room = radius + norm(start.spread.x, start.spread.y)
        if float(distances(np.array([[x, y]]), _with_doors(maze)).min()) < room:
            raise UnsolvableError(
                f"the robot does not fit at its start ({x:.2f}, {y:.2f}) m: a wall is nearer than {room:.2f} m",
                (x, y),
                "move the start away from the walls, with `--start` for example",
            )
    if len(maze.exits):
        maze = _turned_outwards(maze)
    elif maze.goal == Leave():
        maze = _with_exits_found(maze)
    if isinstance(maze.goal, Leave | Reach) and shortest_way(maze, radius=radius) is None:
        raise _no_way(maze, radius)
    return maze


def _refuse_large(maze: Maze) -> None:
    left, bottom, right, top = maze.bounds
    for thing in maze.objects:
        reach = max(norm(x, y) for x, y in thing.outline)
        for x, y in thing.path:
            left, right = min(left, x - reach), max(right, x + reach)
            bottom, top = min(bottom, y - reach), max(top, y + reach)
    width, height = right - left, top - bottom
    if max(width, height) > LARGEST or width * height > LARGEST_AREA:
        raise UnsolvableError(
            f"the maze, with all that moves in it, is {width:.4g} by {height:.4g} m; more than {LARGEST:.0f} m or "
            f"{LARGEST_AREA:.0f} m2 is too large to search",
            (right, top),
            "check the scale",
        )


def shortest_way(maze: Maze, *, radius: float) -> float | None:
    """Length of the shortest way, in steps along x and y, from the start through an exit or to the goal, doors open.

    Args:
        maze: a maze with exits or a place to reach.
        radius: of the disc that the robot sweeps when it turns, which must fit everywhere, m.

    Returns:
        Metres, or None if no way leads there, or there is no place to reach.
    """
    way = _way_on_grid(maze, radius, COARSE)
    return way if way is not None else _way_on_grid(maze, radius, STEP)


def _space_for(maze: Maze, radius: float, step: float) -> DistanceGrid:
    """The grid for a disc of some radius; the points of grids for different radii coincide."""
    margin = COARSE * math.ceil((3 * radius + COARSE) / COARSE)
    return DistanceGrid.around(maze.barriers, maze.bounds, limit=radius + step, step=step, margin=margin)


def _way_on_grid(maze: Maze, radius: float, step: float) -> float | None:
    space = _space_for(maze, radius, step)
    # A point of the grid may miss the middle of a gap by half a step.
    fits = space.clearance >= radius - (STEP / 4 if step == STEP else 0.0)
    start = space.nearest(maze.start_point, fits)
    if start is None:
        return None
    steps = flood(fits, _only(fits, start))
    reached = [cell for cell in _targets(maze, radius, space) if space.holds(cell) and steps[cell] >= 0]
    return min(int(steps[cell]) for cell in reached) * step if reached else None


def _targets(maze: Maze, radius: float, space: DistanceGrid) -> list[tuple[int, int]]:
    """The points of the grid one of which must be reached; some may lie outside of the grid."""
    if isinstance(maze.goal, Reach):
        x, y = maze.goal.place
        row, column = space.cell((x, y))
        most = math.floor(maze.goal.radius / space.step)
        around = range(-most, most + 1)
        near = [(row + i, column + j) for i in around for j in around if norm(i, j) <= most]
        return near or [(row, column)]
    cells = []
    for ax, ay, bx, by in maze.exits.tolist() if maze.goal == Leave() else []:
        length = norm(bx - ax, by - ay)
        out_x, out_y = -radius * (by - ay) / length, radius * (bx - ax) / length
        for along in np.linspace(0.0, 1.0, 41).tolist():
            cells.append(space.cell((ax + along * (bx - ax) + out_x, ay + along * (by - ay) + out_y)))
    return cells


def _with_doors(maze: Maze) -> Segments:
    leaves = [[*door.leaf[0], *door.leaf[1]] for door in maze.doors]
    return np.concatenate([maze.barriers, np.asarray(leaves, dtype=np.float64).reshape(-1, 4)])


def _only(like: Flags, cell: tuple[int, int]) -> Flags:
    flags = np.zeros_like(like)
    flags[cell] = True
    return flags


def _no_way(maze: Maze, radius: float) -> UnsolvableError:
    """Distinguish a way that is too narrow, and where, from no way at all."""
    leaves = maze.goal == Leave()
    if shortest_way(maze, radius=THIN) is None:
        x, y = maze.start_point
        where = "an exit" if leaves else "the goal"
        return UnsolvableError(
            f"no way leads from the start ({x:.2f}, {y:.2f}) m to {where}",
            (x, y),
            "open a wall on the way, or choose another start or exit",
        )
    fitting, stuck = THIN, radius
    while stuck - fitting > STEP / 2:
        middle = (fitting + stuck) / 2
        fitting, stuck = (fitting, middle) if shortest_way(maze, radius=middle) is None else (middle, stuck)
    x, y = _bottleneck(maze, fitting, stuck)
    return UnsolvableError(
        f"the way {'out' if leaves else 'to the goal'} is only about {2 * fitting:.2f} m wide at ({x:.2f}, {y:.2f}) m; "
        f"the robot needs {2 * radius:.2f} m to turn",
        (x, y),
        "widen the passage",
    )


def _bottleneck(maze: Maze, fitting: float, stuck: float) -> Point:
    """Where a disc that fits through gets farther than one that is stuck."""
    space = _space_for(maze, stuck, STEP)
    slim, wide = space.clearance >= fitting - STEP / 4, space.clearance >= stuck - STEP / 4
    start = space.nearest(maze.start_point, wide)
    # Where nothing wide lies beyond, it is the goal itself that is too near to a wall.
    end = maze.goal.place if isinstance(maze.goal, Reach) else maze.start_point
    if start is None:
        return maze.start_point
    # Nearest to the area that the wide one reaches, of all points that only the slim one reaches.
    reached = flood(wide, _only(wide, start)) >= 0
    beyond = flood(slim & ~reached, within(reached, 1) & ~reached)
    outside = (beyond >= 0) & wide
    if not outside.any():
        return end
    exits = np.argwhere(outside)
    back = flood(slim, _only(slim, (int(exits[0][0]), int(exits[0][1]))))
    gate = np.where(reached & (back >= 0), back, np.iinfo(np.int32).max)
    row, column = np.unravel_index(int(np.argmin(gate)), gate.shape)
    return space.point(int(row), int(column))


def _turned_outwards(maze: Maze) -> Maze:
    """The maze with each exit turned so that the outside lies to its left."""
    barrier = np.concatenate([maze.barriers, maze.exits])
    space = DistanceGrid.around(barrier, maze.bounds, limit=2 * COARSE, step=COARSE, margin=1.0)
    free = space.clearance > 0.6 * COARSE
    reached = flood(free, _only(free, space.cell(maze.start_point))) >= 0
    exits = []
    for ax, ay, bx, by in maze.exits.tolist():
        length = norm(bx - ax, by - ay)
        middle = ((ax + bx) / 2, (ay + by) / 2)
        left = (-(by - ay) / length * 0.1, (bx - ax) / length * 0.1)
        inner_left = reached[space.cell((middle[0] + left[0], middle[1] + left[1]))]
        inner_right = reached[space.cell((middle[0] - left[0], middle[1] - left[1]))]
        if inner_left and inner_right:
            raise UnsolvableError(
                f"the exit at ({ax:g}, {ay:g})-({bx:g}, {by:g}) m does not separate the inside from the outside",
                middle,
                "both of its sides can be reached from the start without crossing an exit: close the other gaps",
            )
        exits.append((bx, by, ax, ay) if inner_left else (ax, ay, bx, by))
    return replace(maze, exits=np.asarray(exits, dtype=np.float64).reshape(-1, 4))


def _with_exits_found(maze: Maze) -> Maze:
    """The maze with the openings as exits through which its inside touches its outside.

    The outside is what a disc of two metres in diameter can cover that rolls in from afar without touching a wall; it
    does not fit into a corridor, so it stops where a corridor opens to the outside. Larger discs are tried as long as
    the smaller one reaches the start.
    """
    for radius in OUTSIDE_RADII:
        space = DistanceGrid.around(_with_doors(maze), maze.bounds, limit=radius, step=COARSE, margin=2 * radius)
        outside = _outside(space, radius)
        start = space.cell(maze.start_point)
        if outside[start]:
            continue
        undoored = DistanceGrid.around(maze.barriers, maze.bounds, limit=0.1, step=COARSE, margin=2 * radius)
        inside = flood((undoored.clearance > 2 * THIN) & ~outside, _only(outside, start)) >= 0
        exits = _openings(space, inside, outside, maze.barriers)
        if len(exits) == 0:
            x, y = maze.start_point
            raise ClosedError(
                f"no way leads from the start ({x:.2f}, {y:.2f}) m to the outside",
                (x, y),
                "leave an opening in the outer wall, or choose another goal with `--goal` or `goal`",
            )
        return replace(maze, exits=exits)
    x, y = maze.start_point
    raise UnsolvableError(
        f"the start ({x:.2f}, {y:.2f}) m lies outside of the maze",
        (x, y),
        "start among the walls, or choose another goal with `--goal`",
    )


def _outside(space: DistanceGrid, radius: float) -> Flags:
    centres = space.clearance >= radius - 1e-9
    border = np.zeros_like(centres)
    border[0, :] = border[-1, :] = border[:, 0] = border[:, -1] = True
    return within(flood(centres, border) >= 0, round(radius / space.step))


def _openings(space: DistanceGrid, inside: Flags, outside: Flags, walls: Segments) -> Segments:
    """One segment an opening, from the grid's fringe between inside and outside; the outside to its left."""
    remaining = inside & within(outside, 1)
    ends = walls.reshape(-1, 2)
    exits = []
    while remaining.any():
        row, column = np.argwhere(remaining)[0].tolist()
        piece = flood(within(remaining, 2), _only(remaining, (row, column))) >= 0
        rows, columns = np.nonzero(piece & remaining)
        remaining &= ~piece
        points = np.stack([space.origin[0] + space.step * columns, space.origin[1] + space.step * rows], axis=1)
        first, second = _farthest(points)
        a, b = _snapped(first, ends), _snapped(second, ends)
        if distance_between(a, b) < 2 * COARSE:
            continue
        beyond = _centre(outside & within(piece, 2), space)
        middle = points.mean(axis=0)
        side = (b[0] - a[0]) * (beyond[1] - middle[1]) - (b[1] - a[1]) * (beyond[0] - middle[0])
        exits.append((*a, *b) if side > 0 else (*b, *a))
    return np.asarray(exits, dtype=np.float64).reshape(-1, 4)


def _farthest(points: NDArray[np.float64]) -> tuple[Point, Point]:
    first = points[int(np.argmax(square(points - points[0]).sum(axis=1)))]
    second = points[int(np.argmax(square(points - first).sum(axis=1)))]
    return (float(first[0]), float(first[1])), (float(second[0]), float(second[1]))


def _centre(mask: Flags, space: DistanceGrid) -> Point:
    rows, columns = np.nonzero(mask)
    return space.origin[0] + space.step * float(columns.mean()), space.origin[1] + space.step * float(rows.mean())


def _snapped(point: Point, ends: NDArray[np.float64]) -> Point:
    away = norms(ends[:, 0] - point[0], ends[:, 1] - point[1])
    best = int(np.argmin(away))
    return (float(ends[best, 0]), float(ends[best, 1])) if away[best] <= SNAP else point
