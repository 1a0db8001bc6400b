"""The map that grows while the robot drives: keyframes, each matched with the last ones, and loops between them."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from perception.mapping.cloud import Cloud
from perception.mapping.frames import between, compose
from perception.mapping.graph import Link, PoseGraph
from perception.mapping.information import Symmetric
from perception.mapping.loops import Loops
from perception.mapping.matching import Match, Reference, matched
from perception.mapping.searching import BlurredWalls, Window, search
from perception.mapping.settings import DriftSettings, MappingSettings
from perception.mapping.uncertainty import certainties
from transport.arithmetic import norm, square
from transport.messages import Pose


def drift_of(step: Pose, settings: DriftSettings) -> Symmetric:
    """The covariance of a step that odometry has measured, with axes of the robot's frame."""
    way, turn = norm(step.x, step.y), abs(step.heading)
    least = square(settings.least)
    place = square(settings.way) * way + square(settings.turn_place) * turn + least
    heading = square(settings.way_turn) * way + square(settings.turn) * turn + least
    return Symmetric.diagonal(place, place, heading)


UNKNOWN_STEP = Symmetric.diagonal(1.0, 1.0, 1.0)
"""Covariance of an unmeasured step: about a metre and a radian."""


@dataclass(slots=True)
class Mapper:
    """Follows the robot and remembers its scans.

    Attributes:
        settings: thresholds.
        graph: the keyframes' poses.
        clouds: what was seen at each keyframe, in the robot's frame there.
        offset: the robot as seen from the last keyframe.
        covariance: of the offset, with axes of the robot's frame.
        match: how the last scan fitted; None where it did not.
        correction: how far it moved the robot from where odometry had put it, in the robot's frame.
    """

    settings: MappingSettings
    graph: PoseGraph = field(init=False)
    clouds: list[Cloud] = field(default_factory=list)
    offset: Pose = field(default_factory=Pose)
    covariance: Symmetric = field(default_factory=Symmetric)
    match: Match | None = None
    correction: Pose = field(default_factory=Pose)
    loops: Loops = field(init=False)
    _since: list[Cloud] = field(default_factory=list)
    _refreshed: bool = False
    _reference: Reference | None = None
    _work: deque[Iterator[None]] = field(default_factory=deque)

    def __post_init__(self) -> None:
        self.graph = PoseGraph(self.settings.graph)
        self.loops = Loops(self.settings, self.graph, self.clouds)

    @classmethod
    def of(
        cls, settings: MappingSettings, poses: list[Pose], clouds: list[Cloud], steps: list[Link], loops: list[Link]
    ) -> Mapper:
        """The mapper of a map that was made before; the robot is taken to be at its last keyframe."""
        mapper = cls(settings, clouds=clouds)
        graph = mapper.graph
        graph.poses, graph.steps, graph.loops = poses, steps, loops
        for link in (*steps, *loops):
            mapper.loops.paths.add(link)
        return mapper

    @property
    def pose(self) -> Pose:
        """The robot in the map's frame, which is that of the first scan."""
        return compose(self.graph.poses[-1], self.offset) if self.graph.poses else self.offset

    @property
    def fits(self) -> bool:
        """Whether the last scan fitted what was seen before; the first one does."""
        return self.match is not None or len(self.clouds) == 1

    def move(self, step: Pose | None) -> None:
        """Follow odometry.

        Args:
            step: the movement in the robot's frame before it; None if it is not measured.
        """
        if step is None:
            self.covariance = self.covariance.plus(UNKNOWN_STEP)
            return
        self.offset = compose(self.offset, step)
        self.covariance = carried(self.covariance, step).plus(drift_of(step, self.settings.drift))

    def see(self, cloud: Cloud, *, measured: bool = True) -> None:
        """Take in a scan: match it with the last keyframes and keep it where the robot has got on.

        Args:
            cloud: the scan's points, in the robot's frame.
            measured: whether odometry has measured the way since the last scan.
        """
        self.take(cloud, self.fit(cloud, measured=measured))

    def take(self, cloud: Cloud, match: Match | None, *, learn: bool = True) -> None:
        """Put the robot to where a scan fits, and keep the scan where the robot has got on or much is new in it.

        Args:
            cloud: the scan's points, in the robot's frame.
            match: where it fits; None where it does not, and odometry alone is followed.
            learn: whether it may enter the map.
        """
        if not self.clouds:
            self._keep(cloud)
            return
        self.match = match
        if match is not None:
            self.correction = between(self.offset, match.pose)
            self.offset = match.pose
            self.covariance = match.information.inverse()
            if learn:
                self._since.append(cloud.seen_from(self.offset))
        settings = self.settings.track
        got_on = norm(self.offset.x, self.offset.y) >= settings.way or abs(self.offset.heading) >= settings.turn
        # Until a keyframe holds what is new, only what was known before fixes the place: perhaps a bare corridor.
        fresh = match is not None and match.share < settings.fresh and not self._refreshed
        if learn and (got_on or fresh):
            self._keep(cloud)
            self._refreshed = not got_on

    def resume(self, cloud: Cloud, at: int, guess: Pose, around: float) -> bool:
        """Continue with the map from another place: where a keyframe was made, or near it.

        Args:
            cloud: what is seen there, in the robot's frame.
            at: the keyframe's number.
            guess: of the robot as seen from there.
            around: the heading is searched for this far to either side, rad.

        Returns:
            Whether the scan fits; if not, nothing has changed.
        """
        track = self.settings.track
        near = range(max(0, at - track.neighbours), min(at + track.neighbours + 1, len(self.clouds)))
        reference = self.loops.reference(at, near)
        if not len(cloud) or not len(reference.cloud):
            return False
        window = Window(track.blind_across, around)
        start = search(cloud, BlurredWalls.of(reference.cloud, self.settings.search), guess, window).pose
        found = matched(cloud, reference, start, None, self.settings.match)
        if found is None or found.share < track.sure:
            return False
        self.go_on(cloud, at, found)
        return True

    def go_on(self, cloud: Cloud, at: int, match: Match) -> None:
        """Continue the map from where a scan fits.

        Args:
            cloud: the scan, in the robot's frame.
            at: the keyframe from which the robot is seen.
            match: where the scan fits, seen from there.
        """
        poses = self.graph.poses
        self.match = match
        self.offset = between(poses[-1], compose(poses[at], match.pose))
        self.covariance = UNKNOWN_STEP
        self._keep(cloud)
        self.loops.close(Link(at, len(self.clouds) - 1, match.pose, match.seen))

    def work(self, pieces: int) -> None:
        """Do this many pieces of the work of finding and closing loops, if there are as many."""
        while pieces and self._work:
            if next(self._work[0], self) is self:
                self._work.popleft()
            pieces -= 1

    def certainties(self) -> list[Symmetric]:
        """How well each keyframe is known as seen from the first one, with axes of the graph's frame."""
        return certainties(self.graph, self.loops.paths, self.settings.track.recent)

    def finish(self) -> None:
        """Do all work that is left, and solve the graph."""
        self._work.append(self.graph.optimise())
        while self._work:
            self.work(1)

    def _keep(self, cloud: Cloud) -> None:
        """Make the scan a keyframe, and put what was seen since the last one to what was seen there."""
        if self._since:
            self.clouds[-1] = Cloud.joined([self.clouds[-1], *self._since]).merged(self.settings.cloud.spacing)
        self._since = []
        number = self.graph.add(self.offset, self.covariance.inverse() if self.clouds else Symmetric())
        self.clouds.append(cloud)
        self.offset, self.covariance, self._reference = Pose(), Symmetric(), None
        if number:
            self.loops.paths.add(self.graph.steps[-1])
            self._work.append(self.loops.find(number))

    def _reference_of_last(self) -> Reference:
        """The last keyframes, seen from the last one."""
        if self._reference is None:
            last = len(self.clouds) - 1
            recent = range(max(0, last + 1 - self.settings.track.recent), last + 1)
            self._reference = self.loops.reference(last, recent)
        return self._reference

    def fit(
        self, cloud: Cloud, *, measured: bool = True, possible: Callable[[Pose], bool] = lambda _: True
    ) -> Match | None:
        """Where a scan fits the last keyframes, seen from the last one; None where it does not, or there are none.

        Args:
            cloud: the scan's points, in the robot's frame.
            measured: whether odometry has measured the way since the last scan.
            possible: whether the robot can be somewhere, seen from the last keyframe.
        """
        if not self.clouds:
            return None
        track, reference, guess = self.settings.track, self._reference_of_last(), self.offset
        prior = self.covariance.plus(Symmetric.diagonal(1e-8, 1e-8, 1e-8)).inverse() if measured else None
        found = matched(cloud, reference, guess, prior, self.settings.match)
        if (found is None or found.share < track.sure) and len(cloud) and len(reference.cloud):
            window = Window(track.across, track.around) if measured else Window(track.blind_across, math.pi)
            start = search(cloud, BlurredWalls.of(reference.cloud, self.settings.search), guess, window).pose
            wide = matched(cloud, reference, guess, prior, self.settings.match, start=start)
            better = wide is not None and (found is None or wide.share > found.share + track.better)
            if wide is not None and better and possible(wide.pose):
                found = wide
        if found is not None and not possible(found.pose):
            return None
        return found if found is not None and self._believed(found, guess, prior) else None

    def _believed(self, found: Match, guess: Pose, prior: Symmetric | None) -> bool:
        """Whether a match fits the map well, or less well but what odometry says, too."""
        track = self.settings.track
        if found.share >= track.least or prior is None:
            return found.share >= track.least
        off = between(guess, found.pose)
        return found.share >= track.new and prior.square(off.x, off.y, off.heading) <= track.gate


def carried(covariance: Symmetric, step: Pose) -> Symmetric:
    """The covariance of a pose, with axes of the robot's frame, after an exact step.

    An error in heading becomes one in place: the robot was moved along another direction.
    """
    xx, xy, xt, yy, yt, tt = covariance
    a, b = -step.y, step.x
    return Symmetric(
        xx + 2 * a * xt + a * a * tt,
        xy + a * yt + b * xt + a * b * tt,
        xt + a * tt,
        yy + 2 * b * yt + b * b * tt,
        yt + b * tt,
        tt,
    ).turned(-step.heading)
