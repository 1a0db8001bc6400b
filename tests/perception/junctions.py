"""Random junctions of every kind with their truth, by seed."""

from __future__ import annotations

import math
from dataclasses import dataclass

from tests.perception.scenes import PICO
from transport.messages import Pose

FAR = 6.0
LEFT, RIGHT = 1, -1

OPEN_WAYS = {
    "corridor": "A",
    "dead_end": "",
    "corner_left": "L",
    "corner_right": "R",
    "t": "LR",
    "t_left": "LA",
    "t_right": "AR",
    "crossing": "LAR",
}
KINDS = (*OPEN_WAYS, "open_space")
GROUPS = ("plain", "offset", "slanted", "narrow_gap", "alcove", "niche", "wide")


@dataclass
class Scene:
    """A junction and what a robot in it should say."""

    kind: str
    group: str
    walls: list
    pose: Pose


@dataclass
class SidePath:
    """A way to a side: where it begins and ends along the corridor, how deep it is, whether a wall ends it."""

    near: float
    far: float
    depth: float = FAR
    ended: bool = False

    def walls(self, side, level):
        """Its walls; it begins in a wall at ``level``."""
        inner, outer = side * level, side * (level + self.depth)
        walls = [(self.near, inner, self.near, outer), (self.far, inner, self.far, outer)]
        return [*walls, (self.near, outer, self.far, outer)] if self.ended else walls


def make(rng, kind: str, group: str) -> Scene:
    """A junction of a kind; the group says what makes it difficult.

    The corridor is 0.7 to 1.5 m wide, the robot anywhere in it 6 cm from the walls, misaligned to 10 degrees.
    """
    half = rng.uniform(0.35, 0.75)
    robot_y = rng.uniform(-1, 1) * max(half - PICO.half_width - 0.06, 0.0)
    pose = Pose(0.0, robot_y, math.radians(rng.uniform(-10, 10)))
    walls = _open_space(rng, half) if kind == "open_space" else _corridor(rng, half, OPEN_WAYS[kind], group)
    if group == "slanted":
        walls = [_slanted(rng, wall) for wall in walls]
    return Scene(kind, group, walls, pose)


def _corridor(rng, half, open_ways, group):
    """The walls of a corridor and of the ways that lead on from it."""
    paths = {side: _path(rng, group) for side, name in ((LEFT, "L"), (RIGHT, "R")) if name in open_ways}
    if len(paths) == 2:
        _shift(rng, paths, half, group)
    end = max((path.far for path in paths.values()), default=rng.uniform(0.35, 1.0))
    leads_on = "A" in open_ways
    stop = FAR if leads_on else end
    after = {side: half + (rng.uniform(-0.15, 0.2) if group == "offset" else 0.0) for side in (LEFT, RIGHT)}
    if after[LEFT] + after[RIGHT] < 0.65:
        after = {LEFT: half, RIGHT: half}
    walls = []
    for side in (LEFT, RIGHT):
        path = paths.get(side)
        if path:
            walls += [(-FAR, side * half, path.near, side * half), *path.walls(side, half)]
            if stop > path.far:
                walls += _step(side, path.far, half, after[side], stop)
        elif leads_on and group == "offset":
            step = rng.uniform(0.2, 0.8)
            walls += [(-FAR, side * half, step, side * half), *_step(side, step, half, after[side], stop)]
        else:
            walls += _closed_side(rng, side, half, stop, group)
    if not leads_on:
        reaches = {side: FAR if side in paths and paths[side].far == end else max(after[side], half) for side in after}
        walls.append((end, -reaches[RIGHT], end, reaches[LEFT]))
    return walls


def _path(rng, group):
    """A way to a side; a niche begins where the wall before it can still be seen."""
    near = rng.uniform(0.05, 0.2) if group == "niche" else rng.uniform(-0.25, 0.2)
    width = rng.uniform(1.5, 2.0) if group == "wide" else rng.uniform(0.75, 1.5)
    if group == "niche":
        return SidePath(near, near + width, rng.uniform(0.32, 0.9), ended=True)
    return SidePath(near, near + width)


def _shift(rng, paths, half, group):
    """Let two ways begin at the same place or, offset, up to half a corridor apart."""
    first, second = paths[LEFT], paths[RIGHT]
    near = first.near
    if group == "offset":
        near = min(max(near + rng.uniform(-1, 1) * half, -0.45), 0.2)
    second.near, second.far = near, near + second.far - second.near


def _step(side, x, before, after, stop):
    return [(x, side * before, x, side * after), (x, side * after, stop, side * after)]


def _closed_side(rng, side, half, stop, group):
    """A side wall without a way, in some groups with something in it that is none."""
    near = rng.uniform(-0.2, 0.1)
    if group == "narrow_gap" and stop > 0.8:
        path = SidePath(near, near + rng.uniform(0.05, 0.4), 2.0)
    elif group == "alcove" and stop > 1.0:
        path = SidePath(near, min(near + rng.uniform(0.5, 1.2), stop), rng.uniform(0.02, 0.2), ended=True)
    else:
        return [(-FAR, side * half, stop, side * half)]
    level = side * half
    return [(-FAR, level, path.near, level), (path.far, level, stop, level), *path.walls(side, half)]


def _slanted(rng, wall):
    """The same wall built by hand: turned about its middle, its ends up to 4 cm off."""
    x0, y0, x1, y1 = wall
    length = math.hypot(x1 - x0, y1 - y0)
    shift = rng.uniform(-1, 1) * min(0.02, 0.04 / max(length, 0.01))
    dx, dy = -(y1 - y0) * shift, (x1 - x0) * shift
    return (x0 + dx, y0 + dy, x1 - dx, y1 - dy)


def _open_space(rng, half):
    """A corridor that ends in a hall."""
    mouth = rng.uniform(-0.2, 0.2)
    left, right, back = half + rng.uniform(2.0, 4.0), -half - rng.uniform(2.0, 4.0), mouth + rng.uniform(3.0, 6.0)
    return [
        (-FAR, half, mouth, half),
        (-FAR, -half, mouth, -half),
        (mouth, half, mouth, left),
        (mouth, -half, mouth, right),
        (back, left, back, right),
        (mouth, left, back, left),
        (mouth, right, back, right),
    ]


def scenes(rng, count: int):
    """Scenes in turn of every kind and group."""
    for index in range(count):
        yield make(rng, KINDS[index % len(KINDS)], GROUPS[(index // len(KINDS)) % len(GROUPS)])
