"""Random scenes with and without a door area, by seed."""

from __future__ import annotations

import math
from dataclasses import dataclass

from tests.perception.scenes import PICO
from transport.messages import Pose

FAR = 6.0
RULE = 1.3


@dataclass
class Scene:
    """What stands there, where the robot is, and whether it may ring."""

    kind: str
    walls: list
    pose: Pose

    @property
    def is_door(self):
        return self.kind.startswith("door")


def reach(width, pose):
    """Distance from a door on the y axis to the farthest corner of the robot's outline."""
    corners = []
    for x, y in PICO.footprint:
        cosine, sine = math.cos(pose.heading), math.sin(pose.heading)
        corners.append((pose.x + x * cosine - y * sine, pose.y + x * sine + y * cosine))
    return max(math.hypot(x, max(abs(y) - width / 2, 0.0)) for x, y in corners)


def _pose(rng, width, reached):
    """A pose in front of a dead end at x = 0, whose farthest corner is within two distances of it."""
    while True:
        y = rng.uniform(-1, 1) * max(width / 2 - PICO.half_width - 0.05, 0.0)
        pose = Pose(-rng.uniform(0.3, 2.5), y, math.radians(rng.uniform(-10, 10)))
        if reached[0] <= reach(width, pose) <= reached[1]:
            return pose


def dead_end(width, side, behind):
    """A wall across x = 0 with side walls; ``behind`` is what the side walls begin at."""
    half = width / 2
    walls = [(-side, -half, 0, -half), (0, -half, 0, half), (0, half, -side, half)]
    if behind == "walls":
        walls += [(-side, -half, -side, -half - 3), (-side, half, -side, half + 3)]
    return walls


def door(rng):
    """A dead end within the rule's sizes and a robot that may ring."""
    width = rng.uniform(0.55, 1.5)
    if rng.random() < 0.5:
        side, behind, kind = rng.uniform(1.5, FAR), "open", "door at the end of a corridor"
    else:
        side, behind, kind = rng.uniform(0.3, 0.9), "walls", "door in a niche"
    return Scene(kind, dead_end(width, side, behind), _pose(rng, width, (0.0, RULE - 0.015)))


def too_far(rng):
    """A dead end of which some part of the robot is too far away."""
    width = rng.uniform(0.55, 1.5)
    return Scene("too far", dead_end(width, FAR, "open"), _pose(rng, width, (RULE + 0.01, 2.3)))


def too_wide(rng):
    """A dead-end wall longer than a door may be."""
    width = rng.uniform(1.6, 3.0)
    return Scene("too wide", dead_end(width, FAR, "open"), _pose(rng, width, (0.0, RULE - 0.02)))


def short_sides(rng):
    """Side walls shorter than the rule asks."""
    width = rng.uniform(0.55, 1.5)
    return Scene("short sides", dead_end(width, rng.uniform(0.02, 0.2), "walls"), _pose(rng, width, (0.0, RULE - 0.02)))


def s_bend(rng):
    """One side wall on the robot's side, the other one behind: a bend."""
    width = rng.uniform(0.7, 1.5)
    half, side = width / 2, rng.choice([-1, 1])
    walls = [
        (-FAR, side * half, 0, side * half),
        (0, side * half, 0, -side * half),
        (0, -side * half, FAR, -side * half),
    ]
    walls.append((-FAR, -side * (half + 0.9), FAR, -side * (half + 0.9)))
    return Scene("S-bend", walls, _pose(rng, width, (0.0, RULE - 0.02)))


def corner(rng):
    """A corridor that continues to one side."""
    width = rng.uniform(0.7, 1.5)
    half, side, path = width / 2, rng.choice([-1, 1]), rng.uniform(0.6, 1.5)
    walls = [(-FAR, -side * half, 0, -side * half), (0, -side * half, 0, side * FAR)]
    walls += [(-FAR, side * half, -path, side * half), (-path, side * half, -path, side * FAR)]
    return Scene("corner", walls, _pose(rng, width, (0.0, RULE - 0.02)))


def open_door(rng):
    """A doorway that stands open, wholly or in part."""
    width = rng.uniform(0.6, 1.5)
    half, gap = width / 2, rng.uniform(0.15, 1.0)
    walls = [(-FAR, -half, FAR, -half), (-FAR, half, FAR, half), (0, -half + gap * width, 0, half)]
    return Scene("open door", walls, _pose(rng, width, (0.0, RULE - 0.02)))


def slanted_end(rng):
    """A wall across the corridor far from square."""
    width = rng.uniform(0.7, 1.5)
    half, slant = width / 2, rng.choice([-1, 1]) * rng.uniform(math.radians(25), math.radians(45))
    shift = half * math.tan(slant)
    walls = [(-FAR, -half, shift, -half), (shift, -half, -shift, half), (-shift, half, -FAR, half)]
    pose = _pose(rng, width, (0.0, RULE - 0.02))
    return Scene("slanted end", walls, Pose(pose.x - abs(shift), pose.y, pose.heading))


def plain_corridor(rng):
    """Nothing ahead but the corridor."""
    half = rng.uniform(0.35, 0.75)
    return Scene("corridor", [(-FAR, -half, FAR, -half), (-FAR, half, FAR, half)], _pose(rng, 2 * half, (0.0, 2.0)))


def beside(rng):
    """A niche within the rule's sizes, but beside the robot."""
    scene = door(rng)
    pose = scene.pose
    turn = rng.choice([-1, 1]) * math.radians(rng.uniform(60, 120))
    return Scene("beside", scene.walls, Pose(pose.x, pose.y, pose.heading + turn))


NEGATIVES = (too_far, too_wide, short_sides, s_bend, corner, open_door, slanted_end, plain_corridor, beside)


def scenes(rng, count):
    """As many scenes with a door area as without, in turn."""
    for index in range(count):
        yield door(rng) if index % 2 == 0 else NEGATIVES[(index // 2) % len(NEGATIVES)](rng)
