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
from numpy.typing import NDArray
from scipy.spatial import KDTree

from perception.mapping.cloud import Cloud
from perception.mapping.frames import between, compose, placed, turned
from perception.mapping.information import Symmetric
from perception.mapping.settings import MatchSettings
from perception.sweep import Floats
from transport.arithmetic import atan2, cos_sin
from transport.compiled import compiled
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
        rows: of a pair the point in the robot's frame, the wall's point and its normal in the reference's frame, and
            the variance of their distance; m and m^2, shape (7, n).
        share: of the scan's points that have a wall.
    """

    rows: Floats
    share: float

    @property
    def variances(self) -> Floats:
        """Of a point's distance from its wall, m^2, shape (n,)."""
        *_, variances = self.rows
        return np.asarray(variances)


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
        start: where to begin, where that is not the guess; then walls are searched for as near as at the end.
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
        (x, y, turn), (dx, dy, dt) = gradient, prior.turned(-off.heading).applied(*_in_the_frame_of(off))
        gradient = x + dx, y + dy, turn + dt
        total = total.plus(prior)
    return tuple(-value for value in total.inverse().applied(*gradient))


def _in_the_frame_of(off: Pose) -> tuple[float, float, float]:
    cosine, sine = cos_sin(off.heading)
    return off.x * cosine + off.y * sine, off.y * cosine - off.x * sine, off.heading


def _paired(cloud: Cloud, reference: Reference, pose: Pose, reach: float, settings: MatchSettings) -> _Pairs | None:
    """Each point with its nearest neighbour in the reference, where that lies on a wall that it may be on."""
    points = placed(cloud.points, pose)
    apart, nearest = reference.tree.query(points.T, distance_upper_bound=reach + settings.along)
    given = pose.x, pose.y, pose.heading, reach, settings.same_way
    rows = on_walls(cloud.arrays, reference.cloud.arrays, apart, nearest, given)
    return _Pairs(rows, rows.shape[1] / len(cloud)) if rows.shape[1] >= settings.least_points else None


Arrays = tuple[Floats, Floats, Floats]
"""Points, normals and variances of a cloud."""
Triple = tuple[float, float, float]


@compiled
def on_walls(
    scan: Arrays, reference: Arrays, apart: Floats, nearest: NDArray[np.intp], given: tuple[float, ...]
) -> Floats:
    """The points of a scan that may be on the wall nearest to them, as rows of `_Pairs`.

    Args:
        scan: the scan, in the robot's frame.
        reference: the walls.
        apart: how far each point is from the nearest one of the reference, m; infinite where none is near.
        nearest: the number of that one.
        given: the robot's x, y and heading in the reference's frame, how far a point is off its wall at most, m, and
            the least cosine between its normal and the wall's.
    """
    (points, own, variances), (x, y, heading, reach, same_way) = scan, given
    wall_points, wall_normals, wall_variances = reference
    pose = Pose(x, y, heading)
    hit = apart < math.inf
    walls = np.where(hit, nearest, 0)
    beside, normals = placed(points, pose) - wall_points[:, walls], wall_normals[:, walls]
    own = turned(own, pose.heading)
    off = beside[0] * normals[0] + beside[1] * normals[1]
    same = own[0] * normals[0] + own[1] * normals[1] >= same_way
    good = (hit & same & (np.abs(off) <= reach)).nonzero()[0]
    walls = walls[good]
    return np.concatenate(
        [
            points[:, good],
            wall_points[:, walls],
            wall_normals[:, walls],
            (variances[good] + wall_variances[walls])[None],
        ]
    )


def _equations(pairs: _Pairs, pose: Pose, scale: float, settings: MatchSettings) -> _Equations:
    """The normal equations of pairs at a pose."""
    place = pose.x, pose.y, pose.heading
    *total, x, y, turn, measured = normal_equations(pairs.rows, place, (scale, settings.correlated))
    information, gradient = _without_noise_of_normals(Symmetric(*total), (x, y, turn), settings.weak)
    return _Equations(information, gradient, measured)


@compiled
def normal_equations(pairs: Floats, place: Triple, given: tuple[float, float]) -> tuple[float, ...]:
    """The normal equations of pairs: information, row by row, gradient, and how far apart they are.

    Args:
        pairs: the rows of `_Pairs`.
        place: the robot's, in the reference's frame: x, y, heading.
        given: how many times as far apart as noise makes them pairs are known to be; how many readings err as one.

    Returns:
        xx, xy, xt, yy, yt and tt of the information, x, y and t of the gradient, in the robot's frame, and how many
        times as far apart the pairs are as the noise of readings makes them, at least 1.
    """
    pose = Pose(*place)
    points, walls, normals, (variances,) = pairs[:2], pairs[2:4], pairs[4:6], pairs[6:]
    beside = placed(points, pose) - walls
    off = beside[0] * normals[0] + beside[1] * normals[1]
    ratio = off / np.sqrt(variances)
    measured = max(1.4826 * _median(np.abs(ratio)), 1.0)
    # Cauchy's weights: a large deviation has a small weight.
    ratio *= 1.0 / (3.0 * given[0])
    weights = 1.0 / ((1.0 + ratio * ratio) * variances * (measured * measured * given[1]))
    (x, y), (nx, ny) = points, turned(normals, -pose.heading)
    rows = np.stack([nx, ny, x * ny - y * nx, off])
    by_x, by_y, by_turn, _ = rows * weights
    xx, xy, xt, along_x = np.sum(by_x * rows, axis=1).tolist()
    yy, yt, along_y = np.sum(by_y * rows[1:], axis=1).tolist()
    tt, turn = np.sum(by_turn * rows[2:], axis=1).tolist()
    return xx, xy, xt, yy, yt, tt, along_x, along_y, turn, measured


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
    x, y, pull_round = gradient
    pull, aside = x * cosine + y * sine, (y * cosine - x * sine) * share
    less = Symmetric(main, 0.0, main_turn, minor * share, minor_turn * share, turn).turned(axis)
    return less, (pull * cosine - aside * sine, pull * sine + aside * cosine, pull_round)


def _median(values: Floats) -> float:
    middle = len(values) // 2
    return float(np.partition(values, middle)[middle])
