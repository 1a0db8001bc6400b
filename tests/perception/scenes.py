"""Scenes of straight walls and what a laser range finder sees in them: an exact ray caster, made for small scenes."""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import pairwise

import numpy as np

from transport.description import Laser, RobotDescription
from transport.messages import Observation, Odometry, Pose, Scan, Twist

PICO = RobotDescription()
NOISE = 0.01


def polyline(*points):
    """The walls along a chain of points, shape (n - 1, 4)."""
    return [(*first, *second) for first, second in pairwise(points)]


def cast(walls, pose: Pose, laser: Laser = PICO.laser) -> np.ndarray:
    """Exact ranges in metres, infinity where a beam hits nothing within reach."""
    walls = np.asarray(walls, dtype=float).reshape(-1, 4)
    cosine, sine = math.cos(pose.heading), math.sin(pose.heading)
    origin = np.array(
        [
            pose.x + laser.mount_x * cosine - laser.mount_y * sine,
            pose.y + laser.mount_x * sine + laser.mount_y * cosine,
        ]
    )
    angles = laser.geometry().angles() + pose.heading + laser.mount_heading
    rays = np.stack((np.cos(angles), np.sin(angles)), axis=1)
    ranges = np.full(len(angles), np.inf)
    for x0, y0, x1, y1 in walls:
        ax, ay, dx, dy = x0 - origin[0], y0 - origin[1], x1 - x0, y1 - y0
        across = rays[:, 0] * dy - rays[:, 1] * dx
        with np.errstate(divide="ignore", invalid="ignore"):
            along = (ax * dy - ay * dx) / across
            share = (ax * rays[:, 1] - ay * rays[:, 0]) / across
        hit = (along > 0) & (share >= 0) & (share <= 1)
        ranges[hit] = np.minimum(ranges[hit], along[hit])
    ranges[ranges > laser.range_max] = np.inf
    return ranges


def scan_of(walls, pose: Pose, laser: Laser = PICO.laser, rng=None, *, noise=NOISE, stamp=0) -> Scan:
    """A scan with uniform noise of +-1 cm on every beam, or without noise where there is no generator."""
    ranges = cast(walls, pose, laser)
    if rng is not None:
        ranges = ranges + rng.uniform(-noise, noise, len(ranges))
    return Scan(stamp, laser.geometry(), ranges.astype(np.float32))


def observation_of(scan: Scan, pose: Pose | None = None, stamp: int = 0, **more) -> Observation:
    """An observation with perfect odometry."""
    return Observation(stamp, scan, Odometry.at(stamp, pose or Pose(), Twist()), **more)


def observe(walls, pose: Pose, robot: RobotDescription = PICO, rng=None, stamp: int = 0) -> Observation:
    """What a robot at ``pose`` is told."""
    return observation_of(scan_of(walls, pose, robot.laser, rng, stamp=stamp), pose, stamp)


def corridor(width: float, length: float = 8.0) -> list[tuple[float, float, float, float]]:
    """A corridor along x, open at both ends."""
    half = width / 2
    return [(-length / 2, -half, length / 2, -half), (-length / 2, half, length / 2, half)]


def cells(rows: Iterable[str], size: float = 1.0) -> list[tuple[float, float, float, float]]:
    """The walls around the free cells (dots) of a drawing; the first row is the farthest in x, columns run to -y."""
    grid = [list(row) for row in rows][::-1]
    free = {(i, j) for i, row in enumerate(grid) for j, mark in enumerate(row) if mark != "#"}
    walls = []
    for i, j in sorted(free):
        x, y = i * size, -j * size
        for di, dj, wall in (
            (1, 0, (x + size, y, x + size, y - size)),
            (-1, 0, (x, y, x, y - size)),
            (0, -1, (x, y, x + size, y)),
            (0, 1, (x, y - size, x + size, y - size)),
        ):
            if (i + di, j + dj) not in free:
                walls.append(wall)
    return walls
