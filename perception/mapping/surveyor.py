"""The map during a run: from the ticks' odometry and scans to the pose and the seen area."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property

from perception.mapping.agreement import agreement_of
from perception.mapping.cloud import cloud_of
from perception.mapping.confidence import Confidence, Knowledge
from perception.mapping.frames import between, compose
from perception.mapping.free_space import FreeSpace
from perception.mapping.information import Symmetric
from perception.mapping.mapper import Mapper
from perception.mapping.matching import Match
from perception.mapping.planning import EdgeAhead, ShortestWays, plan_from
from perception.mapping.reckoning import Reckoning, Slip
from perception.mapping.relocating import Relocation
from perception.mapping.settings import MappingSettings
from perception.sweep import ScanPoints
from transport.arithmetic import norm
from transport.messages import Pose

FORGETTING = 0.9
"""The decay per scan of the estimated odometry error."""


AHEAD = 5.5
"""The direction of a way is that of the place this many radii of the robot along it."""


@dataclass(frozen=True, eq=False)
class KnownWays:
    """What the map says of ways, until it changes.

    Attributes:
        changes: how often the map had been changed.
        plan: the ways from where the robot was then.
    """

    changes: int
    plan: ShortestWays

    @cached_property
    def edges(self) -> tuple[EdgeAhead, ...]:
        """The pieces of the edge of what has been seen, each with its direction; asked for before the map changes."""
        return self.plan.edges(AHEAD * self.plan.radius)


@dataclass(frozen=True, slots=True)
class Supposition:
    """Where a robot is said to be on a map.

    Attributes:
        keyframe: the one from which it is seen.
        pose: seen from there.
        around: how far its heading may be off, rad.
    """

    keyframe: int = 0
    pose: Pose = field(default_factory=Pose)
    around: float = math.pi


@dataclass(slots=True)
class Surveyor:
    """Keeps a map up to date, tick by tick, at a cost that is bounded by counts.

    Attributes:
        settings: thresholds.
        start: where the map begins, in the world model's frame.
        mapper: the map.
        free_space: where the robot can drive.
        confidence: whether it knows where the robot is; while it does not, nothing enters the map.
        sure: whether this tick's scan has been looked at and fits the map.
        surprised: whether the last scan that was looked at shows something amid free cells, such as a door that has
            shut; such scans are drawn at once.
        supposed: where the robot is said to be on a map that was made before, until a scan shows it.
        began: where the run began on the map; None where nobody has said it.
    """

    settings: MappingSettings
    start: Pose
    mapper: Mapper = field(init=False)
    free_space: FreeSpace = field(init=False)
    confidence: Confidence = field(init=False)
    sure: bool = False
    surprised: bool = False
    supposed: Supposition | None = None
    began: Supposition | None = field(default_factory=Supposition)
    _ticks: int = 0
    _undrawn: int = field(init=False)
    _since_fit: Reckoning = field(init=False)
    _slip: Slip = field(default_factory=Slip)
    _rough: float = 0.0
    _relocation: Relocation | None = None
    _ways: KnownWays | None = None

    def __post_init__(self) -> None:
        self.mapper = Mapper(self.settings)
        self.free_space = FreeSpace(self.settings.free_space)
        self.confidence = Confidence(self.settings.place)
        self._since_fit = Reckoning(self.settings.reckoning)
        self._undrawn = self.settings.free_space.every

    @property
    def pose(self) -> Pose:
        """The robot in the world model's frame."""
        if self.supposed is not None:
            return compose(self.keyframe(self.supposed.keyframe), self.supposed.pose)
        return compose(self.start, self.mapper.pose)

    @property
    def covariance(self) -> Symmetric:
        """Of the pose as seen from the last keyframe, with axes of the robot's frame."""
        return self.mapper.covariance

    def keyframe(self, number: int) -> Pose:
        """Where a keyframe was made, in the world model's frame."""
        return compose(self.start, self.mapper.graph.poses[number])

    def plan(self, radius: float) -> ShortestWays:
        """The ways from where the robot is, for one of a radius, m."""
        pose = self.pose
        return plan_from(self.free_space, (pose.x, pose.y), radius, self.settings.plan)

    def ways(self, radius: float) -> KnownWays:
        """The ways from about where the robot is: from where it was when the map has last changed.

        Args:
            radius: of the robot, m.
        """
        if self._ways is None or self._ways.changes != self.free_space.changes:
            self._ways = KnownWays(self.free_space.changes, self.plan(radius))
        return self._ways

    @property
    def knowledge(self) -> Knowledge:
        """Whether the place is known, doubtful or lost."""
        return self.confidence.knowledge

    @property
    def deviation(self) -> float:
        """Standard deviation of the place along its worse axis, as seen from the last keyframe, m."""
        return math.sqrt(max(self.covariance.xx, self.covariance.yy, 0.0))

    @classmethod
    def resumed(cls, mapper: Mapper, free_space: FreeSpace, start: Pose, supposed: Supposition | None) -> Surveyor:
        """A surveyor for a robot that begins on a map that was made before.

        Args:
            mapper: the map.
            free_space: its grid.
            start: where the map begins.
            supposed: where the robot is said to be; None where nothing is known: it is lost until it has been found.
        """
        again = cls(mapper.settings, start)
        again.mapper, again.free_space, again.supposed, again.began = mapper, free_space, supposed, supposed
        if supposed is None:
            again.confidence.knowledge = Knowledge.LOST
        return again

    def from_the_start(self) -> Surveyor:
        """A surveyor with the same map for a robot that is back where the run began."""
        return Surveyor.resumed(self.mapper, self.free_space, self.start, self.began)

    def began_at_start(self, within: float) -> bool:
        """Whether the run began where the map was begun, or at most so far from there, m."""
        if self.began is None:
            return False
        place, start = compose(self.keyframe(self.began.keyframe), self.began.pose), self.keyframe(0)
        return norm(place.x - start.x, place.y - start.y) <= within

    def suppose(self, pose: Pose) -> Supposition:
        """A robot that is said to be at a pose in the world model's frame, as seen from the nearest keyframe."""
        nearest = min(
            range(len(self.mapper.clouds)),
            key=lambda number: norm(self.keyframe(number).x - pose.x, self.keyframe(number).y - pose.y),
        )
        return Supposition(nearest, between(self.keyframe(nearest), pose), self.settings.track.around)

    def move(self, step: Pose | None) -> None:
        """Follow odometry by one tick; None where the step is not known."""
        reckoning = self.settings.reckoning
        if step is not None and (norm(step.x, step.y) > reckoning.most_step or abs(step.heading) > reckoning.most_turn):
            step = None
        if self.supposed is not None and step is not None:
            self.supposed = replace(self.supposed, pose=compose(self.supposed.pose, step))
        self.mapper.move(step)
        if self._relocation is not None:
            self._relocation.move(step)
        self._since_fit.move(step)

    @property
    def _measured(self) -> bool:
        """Whether odometry has measured all of the way since the last scan that fitted."""
        return not self._since_fit.unmeasured

    def see(self, sweep: ScanPoints) -> None:
        """Process the tick's scan, if it is its turn, and a part of the work on loops.

        Where the last matches had to correct odometry much, each scan is looked at, else every second one.
        """
        known, looked = self.knowledge is Knowledge.KNOWN, True
        if self.supposed is not None:
            self._begin(sweep, self.supposed)
        elif self.knowledge is Knowledge.LOST:
            self._seek(sweep)
        elif self._ticks % self.settings.track.every == 0 or self._rough > 1 or not self._measured or not known:
            self._look(sweep)
        else:
            looked = False
        # Only what has been looked at enters the map: the robot may have been carried since the last scan.
        self.sure = looked and self.knowledge is Knowledge.KNOWN and self.mapper.fits
        self._undrawn += 1
        if self.sure and (self.surprised or self._undrawn >= self.settings.free_space.every):
            self.free_space.see(sweep, self.pose)
            self._undrawn = 0
        self._ticks += 1
        self.mapper.work(self.settings.loops.pieces)

    def _begin(self, sweep: ScanPoints, said: Supposition) -> None:
        """Find the robot where it is said to be, with its first scan that shows walls; else it is lost."""
        cloud = cloud_of(sweep, self.settings.cloud)
        if len(cloud) < self.settings.match.least_points:
            self.confidence.knowledge = Knowledge.DOUBTFUL
            return
        self.supposed = None
        fits = self.mapper.resume(cloud, said.keyframe, said.pose, said.around)
        self.confidence.knowledge = Knowledge.KNOWN if fits else Knowledge.LOST
        self._since_fit = Reckoning(self.settings.reckoning)

    def _look(self, sweep: ScanPoints) -> None:
        """Match a scan with what was seen before; where the grid agrees, take it in."""
        cloud = cloud_of(sweep, self.settings.cloud)
        mapper, track = self.mapper, self.settings.track
        if not mapper.clouds:
            mapper.take(cloud, None)
            return
        if len(cloud) < self.settings.match.least_points:
            mapper.match = None
            self.confidence.saw_nothing(self.deviation)
            return
        found = mapper.fit(cloud, measured=self._measured, possible=self._possible)
        if not self._agrees(sweep, found):
            mapper.match, self._rough = None, math.inf
            self.confidence.saw(fits=False)
            return
        self.confidence.saw(fits=True)
        mapper.take(cloud, found, learn=self.knowledge is Knowledge.KNOWN)
        if found is None:
            self._rough = math.inf
            return
        by = mapper.correction
        self._slip = self._slip.corrected(by, self.settings.reckoning)
        self._since_fit = Reckoning(self.settings.reckoning, self._slip)
        rough = max(norm(by.x, by.y) / track.good, abs(by.heading) / track.good_turn)
        self._rough = max(rough, FORGETTING * self._rough if math.isfinite(self._rough) else 0.0)

    def _agrees(self, sweep: ScanPoints, found: Match | None) -> bool:
        """Whether the grid agrees with where a scan fits the last keyframes, or else with where odometry has led."""
        self.surprised = False
        if found is None and not self._measured:
            return False
        offset = found.pose if found is not None else self.mapper.offset
        place = compose(self.start, compose(self.mapper.graph.poses[-1], offset))
        agreement = agreement_of(self.free_space, sweep, place, self.settings.place)
        self.surprised = agreement.contradicted > 0
        return self.confidence.believes(found, agreement)

    def _possible(self, offset: Pose) -> bool:
        """Whether the robot, seen from the last keyframe, can have got there; else it would have been carried.

        A robot that was carried may as well be at another place that looks the same.
        """
        since = self._since_fit
        return since.allows(compose(since.moved, between(self.mapper.offset, offset)))

    def _seek(self, sweep: ScanPoints) -> None:
        """Look for the lost robot all over the map, and continue from where it is found."""
        if self._relocation is None:
            self._relocation = Relocation(self.mapper, self.free_space, self.start, self.settings)
        place = self._relocation.look(sweep)
        if place is not None:
            self.mapper.go_on(cloud_of(sweep, self.settings.cloud), place.keyframe, place.match)
            self.confidence.found()
            self._relocation, self._since_fit, self._rough = None, Reckoning(self.settings.reckoning), math.inf
