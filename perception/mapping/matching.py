"""Matching a scan with what was seen before: point-to-line ICP from a good guess, a correlative search from a bad one.

Point to line: a point is moved across the wall on which its nearest neighbour lies, along it it is free (Censi, "An ICP
variant using a point-to-line metric", 2008). What odometry says enters as a prior, so that along a bare corridor, where
the walls say nothing, odometry decides.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import KDTree

from perception.mapping.cloud import Cloud
from perception.mapping.frames import between, compose, placed, turned
from perception.mapping.information import Symmetric
from perception.mapping.settings import MatchSettings
from perception.sweep import Floats
from transport.arithmetic import atan2, cos_sin
from transport.messages import Pose


@dataclass(frozen=True, eq=False)
class Reference:
    """The reference of a match: a cloud in some frame, prepared for looking up neighbours."""

    cloud: Cloud

    @cached_property
    def tree(self) -> KDTree:
        """The points for looking up the nearest one."""
        return KDTree(self.cloud.points.T, compact_nodes=False, balanced_tree=False)


@dataclass(frozen=True, slots=True)
class Match:
    """Where a scan fits.

    Attributes:
        pose: of the robot in the reference's frame.
        seen: what the points alone say of it, with axes of the robot's frame at `pose`.
        information: the same with the prior.
        share: of the scan's points that lie on the reference's walls, 0 to 1.
        deviation: of these from the walls, root mean square, m.
    """

    pose: Pose
    seen: Symmetric
    information: Symmetric
    share: float
    deviation: float


@dataclass(frozen=True, eq=False, slots=True)
class _Pairs:
    """Points of a scan, each with the wall nearest to it.

    Attributes:
        points: in the robot's frame, m, shape (2, n).
        walls: points on the walls, in the reference's frame, m, shape (2, n).
        normals: of the walls, shape (2, n).
        variances: of a point's distance from its wall, m^2, shape (n,).
        share: of the scan's points that have a wall.
    """

    points: Floats
    walls: Floats
    normals: Floats
    variances: Floats
    share: float


@dataclass(frozen=True, slots=True)
class _Equations:
    """The constraint of pairs on a pose: information and gradient in the robot's frame.

    Attributes:
        information: of the pose.
        gradient: of half the squared deviations.
        scale: how many times as far apart as the noise of readings makes them, at least 1.
    """

    information: Symmetric
    gradient: tuple[float, float, float]
    scale: float


def matched(
    cloud: Cloud,
    reference: Reference,
    guess: Pose,
    prior: Symmetric | None,
    settings: MatchSettings,
    *,
    start: Pose | None = None,
) -> Match | None:
    """Move a scan onto a reference; None where too few points find a wall.

    Args:
        cloud: the scan, in the robot's frame.
        reference: the walls.
        guess: of the robot's pose in the reference's frame.
        prior: information of the guess, with axes of the robot's frame; None for a guess that shall not weigh.
        settings: how near, how often.
        start: where to begin, where that is not the guess; then walls are looked for as near as at the end.
    """
    if len(cloud) < settings.least_points or len(reference.cloud) < settings.least_points:
        return None
    pose, scale = start or guess, settings.first_scale
    reach = settings.reach if prior is None or start is not None else _reach_of(prior, settings)
    for _ in range(settings.rounds):
        found = _paired(cloud, reference, pose, reach, settings)
        if found is None:
            return None
        pairs, before = found, pose
        for _ in range(STEPS):
            said = _equations(pairs, pose, scale, settings)
            scale = max(min(said.scale, scale), 1.0)
            dx, dy, turn = _step(said, guess, pose, prior)
            pose = compose(pose, Pose(dx, dy, turn))
            if abs(dx) + abs(dy) + abs(turn) < settings.settled:
                break
        moved = between(before, pose)
        if reach == settings.closest and abs(moved.x) + abs(moved.y) + abs(moved.heading) < settings.paired:
            break
        reach = max(settings.closest, reach * 0.7)
    said = _equations(pairs, pose, scale, settings)
    deviation = said.scale * math.sqrt(_median(pairs.variances))
    seen = said.information.limited(settings.common * deviation, settings.common_lever)
    return Match(pose, seen, seen.plus(prior) if prior is not None else seen, pairs.share, deviation)


def _reach_of(prior: Symmetric, settings: MatchSettings) -> float:
    """How far from its wall a point may be at a guess that is known as well as a prior says, m."""
    known = prior.inverse()
    spread = math.sqrt(max(known.xx, known.yy)) + LEVER * math.sqrt(known.tt)
    return min(max(3 * spread, settings.closest), settings.reach)


LEVER = 2.0
"""Points are about so far from the robot, m."""
STEPS = 3
"""Gauss-Newton steps between two searches for neighbours."""


def _step(said: _Equations, guess: Pose, pose: Pose, prior: Symmetric | None) -> tuple[float, ...]:
    """The Gauss-Newton step from pairs and prior, in the robot's frame."""
    # A unit of information keeps the equations solvable where the walls leave a direction free.
    total, gradient = said.information.plus(Symmetric.diagonal(1.0, 1.0, 1.0)), said.gradient
    if prior is not None:
        off = between(guess, pose)
        pull = prior.turned(-off.heading).applied(*_in_the_frame_of(off))
        gradient = (gradient[0] + pull[0], gradient[1] + pull[1], gradient[2] + pull[2])
        total = total.plus(prior)
    return tuple(-value for value in total.inverse().applied(*gradient))


def _in_the_frame_of(off: Pose) -> tuple[float, float, float]:
    cosine, sine = cos_sin(off.heading)
    return off.x * cosine + off.y * sine, off.y * cosine - off.x * sine, off.heading


def _paired(cloud: Cloud, reference: Reference, pose: Pose, reach: float, settings: MatchSettings) -> _Pairs | None:
    """Each point with its nearest neighbour in the reference, where that lies on a wall that it may be on."""
    points = placed(cloud.points, pose)
    apart, nearest = reference.tree.query(points.T, distance_upper_bound=reach + settings.along)
    hit = apart < math.inf
    nearest[~hit] = 0
    walls, normals = reference.cloud.points[:, nearest], reference.cloud.normals[:, nearest]
    own = turned(cloud.normals, pose.heading)
    off = (points[0] - walls[0]) * normals[0] + (points[1] - walls[1]) * normals[1]
    same = own[0] * normals[0] + own[1] * normals[1] >= settings.same_way
    good = (hit & same & (np.abs(off) <= reach)).nonzero()[0]
    if len(good) < settings.least_points:
        return None
    variances = cloud.variances[good] + reference.cloud.variances[nearest[good]]
    return _Pairs(cloud.points[:, good], walls[:, good], normals[:, good], variances, len(good) / len(cloud))


def _equations(pairs: _Pairs, pose: Pose, scale: float, settings: MatchSettings) -> _Equations:
    """The normal equations of pairs at a pose."""
    points = placed(pairs.points, pose)
    off = (points[0] - pairs.walls[0]) * pairs.normals[0] + (points[1] - pairs.walls[1]) * pairs.normals[1]
    ratio = off / np.sqrt(pairs.variances)
    measured = max(1.4826 * _median(np.abs(ratio)), 1.0)
    # Cauchy's weights: a large deviation has a small weight.
    ratio *= 1.0 / (3.0 * scale)
    weights = 1.0 / ((1.0 + ratio * ratio) * pairs.variances * (measured * measured * settings.correlated))
    nx, ny = turned(pairs.normals, -pose.heading)
    x, y = pairs.points
    rows = np.empty((4, len(weights)))
    rows[0], rows[1], rows[3] = nx, ny, off
    np.subtract(x * ny, y * nx, out=rows[2])
    weighed = rows[:3] * weights
    along_x = np.sum(weighed[0] * rows, axis=1).tolist()
    along_y = np.sum(weighed[1] * rows[1:], axis=1).tolist()
    turn = np.sum(weighed[2] * rows[2:], axis=1).tolist()
    information = Symmetric(along_x[0], along_x[1], along_x[2], along_y[0], along_y[1], turn[0])
    information, gradient = _without_noise_of_normals(information, (along_x[3], along_y[2], turn[1]), settings.weak)
    return _Equations(information, gradient, measured)


def _without_noise_of_normals(
    information: Symmetric, gradient: tuple[float, float, float], weak: float
) -> tuple[Symmetric, tuple[float, float, float]]:
    """Information and gradient with less weight along the axis that the walls do not fix.

    Along a bare corridor the normals' noise alone pretends to know where the robot is, and holds it where it was. An
    axis that is known that much worse than the other counts the less.
    """
    axis = atan2(2 * information.xy, information.xx - information.yy) / 2
    cosine, sine = cos_sin(axis)
    main, _, main_turn, minor, minor_turn, turn = information.turned(-axis)
    share = minor / (minor + weak * main) if main > 0 else 1.0
    pull, aside = gradient[0] * cosine + gradient[1] * sine, (gradient[1] * cosine - gradient[0] * sine) * share
    less = Symmetric(main, 0.0, main_turn, minor * share, minor_turn * share, turn).turned(axis)
    return less, (pull * cosine - aside * sine, pull * sine + aside * cosine, gradient[2])


def _median(values: Floats) -> float:
    middle = len(values) // 2
    return float(np.partition(values, middle)[middle])
