"""Finding a lost robot again: where on its whole map a scan fits, and which of several such places is the right one.

The scan is laid on the grid of free space, wherever the robot could be, with each heading in which the walls in sight
would run as those of the map do; the best places are matched in full. Several often look alike. So all that fit are
followed while the robot moves, and one is accepted when no other one is left and enough wall has come into sight where
the map has it. The work is done in small pieces, a fixed number per tick.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from perception.mapping.agreement import agreement_of, walls_shown
from perception.mapping.cloud import Cloud, cloud_of, thinned
from perception.mapping.frames import between, compose, placed
from perception.mapping.free_space import FreeSpace
from perception.mapping.information import Symmetric
from perception.mapping.mapper import Mapper
from perception.mapping.matching import Match, matched
from perception.mapping.reckoning import Reckoning
from perception.mapping.settings import MappingSettings, PlaceSettings
from perception.sweep import Floats, ScanPoints
from transport.arithmetic import directions, norm, square
from transport.messages import Pose, wrap_angle

WALL, BESIDE = 4, 2
"""What a point counts on a cell with a wall, and on one beside it."""
SIDE = 2
"""Places are first tried in blocks of this many cells a side."""
GUESSED = Symmetric.diagonal(1 / square(0.1), 1 / square(0.1), 1 / square(0.05))
"""What is known of a place that was found on the grid: it keeps the robot from sliding along a bare corridor."""
TURNED = 0.3
"""Two places with headings farther apart than this are two, rad."""


def likely_headings(scan: Cloud, walls: Floats, settings: PlaceSettings) -> list[float]:
    """The headings in which a scan's walls run as the map's do, the best first, rad.

    Args:
        scan: in the robot's frame.
        walls: the normals of the map's walls, shape (2, n).
        settings: how fine, how many.
    """
    count = settings.headings
    step = 2 * np.pi / count

    def histogram(normals: Floats) -> NDArray[np.int64]:
        bins = np.rint(directions(normals[0], normals[1]) / step).astype(np.int64) % count
        return np.bincount(bins, minlength=count)

    seen, known = histogram(scan.normals), histogram(walls)
    blurred = known + np.roll(known, 1) + np.roll(known, -1)
    fits = np.array([int(np.sum(np.roll(seen, turn) * blurred)) for turn in range(count)])
    order = np.argsort(-fits, kind="stable")[: settings.most_headings]
    return [float(turn * step) for turn in order.tolist() if fits[turn] >= settings.likely * fits[order[0]]]


def likely_places(
    scan: Cloud, space: FreeSpace, headings: list[float], settings: PlaceSettings
) -> Generator[None, None, list[Pose]]:
    """The best places of a scan on a grid, wherever that is free, the best first; in small pieces of work."""
    points = thinned(scan, settings.points).points / space.settings.cell
    margin = int(np.ceil(np.max(np.abs(points)) * 1.5)) + SIDE
    taken = np.pad(space.taken, margin)
    beside = np.zeros(taken.shape, dtype=np.int16)
    for i in (-1, 0, 1):
        for j in (-1, 0, 1):
            beside |= np.roll(taken, (i, j), axis=(0, 1))
    values = np.where(taken, WALL, BESIDE * beside).astype(np.int16)
    corners = [(-i, -j) for i in range(SIDE) for j in range(SIDE)]
    best_of_block = np.maximum.reduce([np.roll(values, corner, axis=(0, 1)) for corner in corners])
    free = np.pad(space.free, margin)
    any_free = np.logical_or.reduce([np.roll(free, corner, axis=(0, 1)) for corner in corners])
    rows = taken.shape[1]
    columns, lines = np.nonzero(any_free[margin:-margin:SIDE, margin:-margin:SIDE])
    blocks: NDArray[np.int64] = (margin + SIDE * columns) * rows + margin + SIDE * lines
    table = best_of_block.ravel()
    found: list[tuple[int, int, int]] = []
    shifts: list[NDArray[np.int64]] = []
    for number, heading in enumerate(headings):
        # The robot is taken to be at the middle of its cell.
        at = np.floor(placed(points, Pose(0.5, 0.5, heading))).astype(np.int64)
        shift = at[0] * rows + at[1]
        shifts.append(shift)
        bounds: NDArray[np.int64] = np.sum(table[blocks[:, None] + shift[None, :]], axis=1, dtype=np.int64)
        order = np.argsort(-bounds, kind="stable")[: settings.blocks]
        found += [(-int(bounds[one]), number, int(blocks[one])) for one in order.tolist()]
        yield
    plain, free_cells = values.ravel(), free.ravel()
    scored = []
    for _, number, block in sorted(found)[: settings.blocks]:
        for cell in (block + i * rows + j for i in range(SIDE) for j in range(SIDE)):
            if free_cells[cell]:
                score = int(np.sum(plain[cell + shifts[number]], dtype=np.int64))
                column, row = divmod(cell, rows)
                place = space.middle((column - margin, row - margin))
                scored.append((-score, number, cell, Pose(*place, wrap_angle(headings[number]))))
    yield
    chosen: list[Pose] = []
    for *_, pose in sorted(scored, key=lambda one: one[:3]):
        if all(_apart(pose, other, 2 * settings.no_rival) for other in chosen):
            chosen.append(pose)
    return chosen[: settings.candidates]


def _apart(one: Pose, other: Pose, least: float) -> bool:
    return norm(one.x - other.x, one.y - other.y) > least or abs(wrap_angle(one.heading - other.heading)) > TURNED


@dataclass(slots=True)
class Hypothesis:
    """A place where the robot may be.

    Attributes:
        keyframe: the one from which it is seen.
        match: where the last scan fitted, seen from there.
        first: the robot where the first scan fitted, in the grid's frame.
        since: what odometry says of the movement since then.
        looks: how many scans have fitted.
        first_walls: the cells with a wall that the first of them has shown: by these the place was chosen.
        more_walls: the cells that later ones have shown besides: by these it was tried.
    """

    keyframe: int
    match: Match
    first: Pose
    since: Reckoning
    looks: int = 1
    first_walls: frozenset[int] = frozenset()
    more_walls: frozenset[int] = frozenset()

    def move(self, step: Pose) -> None:
        """Follow odometry."""
        self.match = replace(self.match, pose=compose(self.match.pose, step))
        self.since.move(step)


@dataclass(slots=True)
class Relocation:
    """The search for one lost robot.

    Attributes:
        mapper: the map; its frame is that of the first keyframe.
        space: the grid.
        start: of the map's frame in the grid's.
        settings: thresholds.
        hypotheses: where the robot may be.
    """

    mapper: Mapper
    space: FreeSpace
    start: Pose
    settings: MappingSettings
    hypotheses: list[Hypothesis] = field(default_factory=list)
    _search: Iterator[None] | None = None
    _since: Pose = field(default_factory=Pose)
    _walls: Floats | None = None

    def move(self, step: Pose | None) -> None:
        """Follow odometry by one tick; a step that is not known ends what was begun."""
        if step is None:
            self.hypotheses, self._search = [], None
            return
        self._since = compose(self._since, step)
        for one in self.hypotheses:
            one.move(step)

    def look(self, sweep: ScanPoints) -> Hypothesis | None:
        """Take in a scan; returns the robot's place once it is sure."""
        cloud = cloud_of(sweep, self.settings.cloud)
        if len(cloud) < self.settings.match.least_points:
            return None
        if self.hypotheses:
            self._follow(cloud, sweep)
            return self._believed()
        if self._search is None:
            self._since = Pose()
            self._search = self._searched(cloud, sweep)
        for _ in range(self.settings.place.pieces):
            if next(self._search, self) is self:
                self._search = None
                break
        return None

    def _searched(self, cloud: Cloud, sweep: ScanPoints) -> Iterator[None]:
        """Look for the scan all over the map; what fits becomes hypotheses."""
        place = self.settings.place
        headings = likely_headings(cloud, self._normals(), place)
        yield
        poses = yield from likely_places(cloud, self.space, headings, place)
        fitting: list[Hypothesis] = []
        for pose in poses:
            found = self._fitted(cloud, sweep, pose)
            if found is not None and all(self._apart(found, other) for other in fitting):
                fitting.append(found)
            yield
        for one in fitting[: place.hypotheses]:
            one.move(self._since)
        self.hypotheses = fitting[: place.hypotheses]

    def _normals(self) -> Floats:
        """The normals of the map's walls, shape (2, n)."""
        if self._walls is None:
            poses = self.mapper.graph.poses
            clouds = zip(self.mapper.clouds, poses, strict=False)
            turned = [cloud.seen_from(compose(self.start, pose)).normals for cloud, pose in clouds]
            self._walls = np.concatenate(turned, axis=1)
        return self._walls

    def _fitted(self, cloud: Cloud, sweep: ScanPoints, guess: Pose) -> Hypothesis | None:
        """The place near a guess, in the grid's frame, where a scan fits map and grid."""
        near = self._nearest(guess)
        base = near[0]
        frame = compose(self.start, self.mapper.graph.poses[base])
        from_base = between(frame, guess)
        found = matched(cloud, self.mapper.loops.reference(base, near), from_base, GUESSED, self.settings.match)
        if found is None:
            return None
        here = compose(frame, found.pose)
        if not agreement_of(self.space, sweep, here, self.settings.place).shows(self.settings.place):
            return None
        walls = walls_shown(self.space, sweep, here)
        return Hypothesis(base, found, here, Reckoning(self.settings.reckoning), first_walls=walls)

    def _nearest(self, place: Pose) -> list[int]:
        """The keyframes nearest to a place, the nearest first."""
        poses = [compose(self.start, pose) for pose in self.mapper.graph.poses[: len(self.mapper.clouds)]]
        order = sorted(range(len(poses)), key=lambda one: (norm(poses[one].x - place.x, poses[one].y - place.y), one))
        return order[: self.settings.place.keyframes]

    def _pose(self, one: Hypothesis) -> Pose:
        """Where a hypothesis puts the robot, in the grid's frame."""
        return compose(compose(self.start, self.mapper.graph.poses[one.keyframe]), one.match.pose)

    def _apart(self, one: Hypothesis, other: Hypothesis) -> bool:
        return _apart(self._pose(one), self._pose(other), self.settings.place.no_rival)

    def _follow(self, cloud: Cloud, sweep: ScanPoints) -> None:
        """Drop the hypotheses that a scan does not fit."""
        left: list[Hypothesis] = []
        for one in self.hypotheses:
            found = self._fitted(cloud, sweep, self._pose(one))
            if found is None or not one.since.allows(between(one.first, self._pose(found))):
                continue
            if all(self._apart(found, other) for other in left):
                more = one.more_walls | (found.first_walls - one.first_walls)
                left.append(
                    replace(one, keyframe=found.keyframe, match=found.match, looks=one.looks + 1, more_walls=more)
                )
        self.hypotheses = left

    def _believed(self) -> Hypothesis | None:
        """The one hypothesis that is left, if enough has been seen there."""
        place = self.settings.place
        if len(self.hypotheses) != 1:
            return None
        one = self.hypotheses[0]
        shown = len(one.more_walls) * self.space.settings.cell
        enough = one.looks >= place.looks and one.since.way >= place.way and shown >= place.walls
        return one if enough else None
