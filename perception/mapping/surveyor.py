"""The map during a run: from the ticks' odometry and scans to the pose and the seen area."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from perception.mapping.cloud import cloud_of
from perception.mapping.frames import compose
from perception.mapping.free_space import FreeSpace
from perception.mapping.information import Symmetric
from perception.mapping.mapper import Mapper
from perception.mapping.planning import ShortestWays, plan_from
from perception.mapping.settings import MappingSettings
from perception.sweep import ScanPoints
from transport.arithmetic import norm
from transport.messages import Pose

FORGETTING = 0.9
"""The decay per scan of the estimated odometry error."""


@dataclass(slots=True)
class Surveyor:
    """Keeps a map up to date, tick by tick, at a cost that is bounded by counts.

    Attributes:
        settings: thresholds.
        start: where the map begins, in the world model's frame.
        mapper: the map.
        free_space: where the robot can drive.
        drawing: whether this tick's scan has been drawn into it.
    """

    settings: MappingSettings
    start: Pose
    mapper: Mapper = field(init=False)
    free_space: FreeSpace = field(init=False)
    drawing: bool = False
    _ticks: int = 0
    _measured: bool = True
    _rough: float = 0.0
    _resumes: bool = False

    def __post_init__(self) -> None:
        self.mapper = Mapper(self.settings)
        self.free_space = FreeSpace(self.settings.free_space)

    @property
    def pose(self) -> Pose:
        """The robot in the world model's frame."""
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

    @property
    def fits(self) -> bool:
        """Whether the last scan fitted what was seen before; the first one does."""
        return self.mapper.match is not None or len(self.mapper.clouds) == 1

    @property
    def deviation(self) -> float:
        """Standard deviation of the place along its worse axis, as seen from the last keyframe, m."""
        return math.sqrt(max(self.covariance.xx, self.covariance.yy, 0.0))

    @property
    def sure(self) -> bool:
        """Whether the robot knows where it is: the last scan fitted, or odometry has not led far since one did."""
        return bool(self.mapper.clouds) and (self.fits or self.deviation < self.settings.track.lost)

    def from_the_start(self) -> Surveyor:
        """A surveyor with the same map for a robot that is back where the map began."""
        again = Surveyor(self.settings, self.start)
        again.mapper, again.free_space, again._resumes = self.mapper, self.free_space, True
        return again

    def move(self, step: Pose | None) -> None:
        """Follow odometry by one tick; None where the step is not known."""
        self.mapper.move(step)
        self._measured = self._measured and step is not None

    def see(self, sweep: ScanPoints) -> None:
        """Process the tick's scan, if it is its turn, and a part of the work on loops.

        Where the last matches had to correct odometry much, each scan is looked at, else every second one.
        """
        if self._resumes:
            self._resumes = False
            self.mapper.resume(cloud_of(sweep, self.settings.cloud), 0)
        elif self._ticks % self.settings.track.every == 0 or self._rough > 1 or not self._measured:
            self._look(sweep)
        self.drawing = self._ticks % self.settings.free_space.every == 0 and self.fits
        if self.drawing:
            self.free_space.see(sweep, self.pose)
        self._ticks += 1
        self.mapper.work(self.settings.loops.pieces)

    def _look(self, sweep: ScanPoints) -> None:
        cloud = cloud_of(sweep, self.settings.cloud)
        if not len(cloud):
            return
        self.mapper.see(cloud, measured=self._measured)
        self._measured = True
        track, by = self.settings.track, self.mapper.correction
        rough = max(norm(by.x, by.y) / track.good, abs(by.heading) / track.good_turn)
        before = FORGETTING * self._rough if math.isfinite(self._rough) else 0.0
        self._rough = max(rough, before) if self.mapper.match else math.inf
