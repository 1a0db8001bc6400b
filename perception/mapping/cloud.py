"""A scan as a small cloud of points with the normals of the walls on which they lie.

Neighbouring hits are averaged until the points are some centimetres apart: a thousand beams in a corridor become some
hundred and fifty points whose noise is a third of the laser's, while the hundred and eighty beams of a coarse laser
stay as they are. The normals point towards the sensor, which keeps the two faces of a thin wall apart.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from perception.mapping.frames import placed, turned
from perception.mapping.settings import CloudSettings
from perception.sweep import Floats, Mask, ScanPoints
from transport.arithmetic import square
from transport.messages import Pose


@dataclass(frozen=True, eq=False, slots=True)
class Cloud:
    """Points on walls.

    Attributes:
        points: m, shape (2, n).
        normals: of the walls there, towards the sensor, of length one, shape (2, n).
        variances: of the points' places across the walls, m^2, shape (n,).
    """

    points: Floats
    normals: Floats
    variances: Floats

    def __len__(self) -> int:
        return int(self.points.shape[1])

    @property
    def arrays(self) -> tuple[Floats, Floats, Floats]:
        """Points, normals and variances."""
        return self.points, self.normals, self.variances

    def seen_from(self, pose: Pose) -> Cloud:
        """The same cloud, given in the robot's frame, in the frame in which the robot is at ``pose``."""
        return Cloud(placed(self.points, pose), turned(self.normals, pose.heading), self.variances)

    @classmethod
    def joined(cls, clouds: list[Cloud]) -> Cloud:
        """Several clouds, given in one frame, as one."""
        if not clouds:
            return NOTHING
        points = np.concatenate([cloud.points for cloud in clouds], axis=1)
        normals = np.concatenate([cloud.normals for cloud in clouds], axis=1)
        return cls(points, normals, np.concatenate([cloud.variances for cloud in clouds]))

    def merged(self, cell: float) -> Cloud:
        """Points in one cell with normals that point much the same way as one, weighed by what each is known by.

        Args:
            cell: width of a cell, m.
        """
        if not len(self):
            return self
        x, y = np.floor(self.points / cell).astype(np.int64)
        keys = (x * 1_000_003 + y) * 8 + _octants(*self.normals)
        order = np.argsort(keys, kind="stable")
        starts = np.flatnonzero(np.concatenate([[True], np.diff(keys[order]) != 0]))
        weights = 1.0 / self.variances[order]
        total = np.add.reduceat(weights, starts)
        points = np.add.reduceat(self.points[:, order] * weights, starts, axis=1) / total
        normals = np.add.reduceat(self.normals[:, order] * weights, starts, axis=1)
        normals /= np.maximum(np.sqrt(normals[0] * normals[0] + normals[1] * normals[1]), 1e-12)
        return Cloud(points, normals, 1.0 / total)


NOTHING = Cloud(np.empty((2, 0)), np.empty((2, 0)), np.empty(0))


def cloud_of(sweep: ScanPoints, settings: CloudSettings) -> Cloud:
    """The walls in a scan, in the robot's frame; hits on nothing straight are left out."""
    averaged = _averaged(sweep, settings)
    if averaged is None:
        return NOTHING
    points, apart, counts = averaged
    mount = sweep.fan.mount
    normals, straight = _normals(points, _joined(points, apart, settings), settings)
    dx, dy = mount.x - points[0], mount.y - points[1]
    towards = dx * normals[0] + dy * normals[1]
    normals *= np.where(towards < 0, -1.0, 1.0)
    # The error of a range is along its beam: across a wall that the beam grazes the point is more accurate.
    slant = towards * towards / np.maximum(dx * dx + dy * dy, 1e-9)
    variances = square(settings.range_noise) * slant / counts + square(settings.least_noise)
    return Cloud(points[:, straight], normals[:, straight], variances[straight])


def _averaged(sweep: ScanPoints, settings: CloudSettings) -> tuple[Floats, Floats, Floats] | None:
    """Means of neighbouring hits, shape (2, n), how far beams are apart there, m, and of how many hits, shape (n,).

    How far hits are apart on their wall is taken over several of them: noise alone puts neighbours a centimetre apart.
    """
    ranges, step, points = sweep.distances, sweep.fan.step, sweep.points.T
    near = ranges <= settings.reach
    if not near.all():
        ranges, points = ranges[near], points[:, near]
        beams = sweep.beams[near]
    else:
        beams = sweep.beams
    if len(ranges) < 3:
        return None
    across = ranges * step
    half = min(max(round(settings.spacing / (4.0 * step)), 1), len(ranges) // 2)
    padded = np.concatenate([np.full(half, ranges[0]), ranges, np.full(half, ranges[-1])])
    along = (padded[2 * half :] - padded[: -2 * half]) / (2 * half)
    cut = np.abs(ranges[1:] - ranges[:-1]) > settings.jump + settings.steep * np.minimum(across[1:], across[:-1])
    cut |= beams[1:] - beams[:-1] > settings.max_missing + 1
    lengths = np.minimum(np.sqrt(across * across + along * along), settings.spacing)
    runs = np.concatenate([[0], np.cumsum(cut)])
    bins = np.floor(np.cumsum(lengths) / settings.spacing)
    starts = np.flatnonzero(np.concatenate([[True], (bins[1:] != bins[:-1]) | (runs[1:] != runs[:-1])]))
    counts = np.diff(np.append(starts, len(ranges)))
    return np.add.reduceat(points, starts, axis=1) / counts, np.add.reduceat(across, starts) / counts, counts


def _joined(points: Floats, apart: Floats, settings: CloudSettings) -> Mask:
    """Whether each point and the next one are on one wall, shape (n - 1,)."""
    dx, dy = points[:, 1:] - points[:, :-1]
    most = np.maximum(settings.jump, settings.steep * np.minimum(apart[1:], apart[:-1])) + settings.spacing
    joined: Mask = dx * dx + dy * dy <= most * most
    return joined


def _normals(points: Floats, joined: Mask, settings: CloudSettings) -> tuple[Floats, Mask]:
    """Normals of the lines through each point and its neighbours, and where those are on a line."""
    x, y = points
    count = len(x)
    sums = [np.ones(count), x.copy(), y.copy(), x * x, x * y, y * y]
    terms = [value.copy() for value in sums]
    reach_before = np.ones(count, dtype=bool)
    reach_after = np.ones(count, dtype=bool)
    for away in range(1, min(settings.neighbours, count - 1) + 1):
        # The neighbour `away` after a point belongs to it if all links between are joined.
        reach_after[: count - away] &= joined[away - 1 :]
        reach_after[count - away :] = False
        reach_before[away:] &= joined[: count - away]
        reach_before[:away] = False
        for total, term in zip(sums, terms, strict=True):
            total[:-away] += np.where(reach_after[:-away], term[away:], 0.0)
            total[away:] += np.where(reach_before[away:], term[:-away], 0.0)
    number, of_x, of_y, of_xx, of_xy, of_yy = sums
    mean_x, mean_y = of_x / number, of_y / number
    cxx = of_xx / number - mean_x * mean_x
    cxy = of_xy / number - mean_x * mean_y
    cyy = of_yy / number - mean_y * mean_y
    # The eigenvalues of a symmetric matrix of two rows.
    middle, half = (cxx + cyy) / 2, np.sqrt(square((cxx - cyy) / 2) + cxy * cxy)
    straight: Mask = (number >= 3) & (middle - half <= square(settings.crooked) * (middle + half))
    return np.stack(_bisected((cyy - cxx) / 2, -cxy, half)), straight


def _octants(x: Floats, y: Floats) -> NDArray[np.int64]:
    """Which of the eight directions from x counter-clockwise, in steps of 45 degrees, vectors are nearest to."""
    across, along = np.abs(y), np.abs(x)
    diagonal = np.where(x > 0, np.where(y > 0, 1, 7), np.where(y > 0, 3, 5))
    straight = np.where(along > across, np.where(x > 0, 0, 4), np.where(y > 0, 2, 6))
    narrow = np.minimum(across, along) <= (math.sqrt(2) - 1) * np.maximum(across, along)  # tan 22.5 degrees
    return np.where(narrow, straight, diagonal).astype(np.int64)


def _bisected(x: Floats, y: Floats, length: Floats) -> tuple[Floats, Floats]:
    """Cosine and sine of half the directions of vectors, by the half-angle formulas; x where a vector has no length."""
    length = np.where(length > 0, length, 1.0)
    cosine, sine = np.where((x == 0) & (y == 0), 1.0, x / length), y / length
    # Of the two halves the one that is not small is taken from the root, the other from it: sin a = 2 sin a/2 cos a/2.
    large = np.sqrt((1 + np.abs(cosine)) / 2)
    small = np.abs(sine) / (2 * large)
    sign = np.where(sine < 0, -1.0, 1.0)
    return np.where(cosine >= 0, large, small), sign * np.where(cosine >= 0, small, large)


def thinned(cloud: Cloud, most: int) -> Cloud:
    """At most this many of a cloud's points, evenly taken."""
    stride = max(math.ceil(len(cloud) / most), 1)
    if stride == 1:
        return cloud
    return Cloud(cloud.points[:, ::stride], cloud.normals[:, ::stride], cloud.variances[::stride])
