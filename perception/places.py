"""Places that the robot has noted, held where they were seen from: when a loop moves the map, they move with it."""

from __future__ import annotations

from dataclasses import dataclass, field

from perception.mapping.frames import between, compose
from perception.mapping.surveyor import Surveyor
from transport.arithmetic import distance_between
from transport.messages import Pose


@dataclass(slots=True)
class NotedPlace:
    """A place.

    Attributes:
        pose: the place, seen from its keyframe; in the world model's frame where it has none.
        keyframe: number of the keyframe from which it is seen; None for a place noted without a map.
        marks: at the ways from it towards +x, +y, -x and -y, for strategies that count them.
    """

    pose: Pose
    keyframe: int | None = None
    marks: list[int] = field(default_factory=lambda: [0, 0, 0, 0])


@dataclass(slots=True)
class Places:
    """All places of a run.

    Attributes:
        surveyor: keeps the map; None without one: then places are where dead reckoning has put them.
        kept: in the order in which they were noted.
    """

    surveyor: Surveyor | None = None
    kept: list[NotedPlace] = field(default_factory=list)

    def note(self, pose: Pose) -> NotedPlace:
        """Keep a pose in the world model's frame as a place."""
        place = self.fixed(pose)
        self.kept.append(place)
        return place

    def fixed(self, pose: Pose) -> NotedPlace:
        """A pose in the world model's frame as a place that moves with the map, without keeping it."""
        if self.surveyor is None or not self.surveyor.mapper.clouds:
            return NotedPlace(pose)
        last = len(self.surveyor.mapper.clouds) - 1
        return NotedPlace(between(self.surveyor.keyframe(last), pose), last)

    def move(self, place: NotedPlace, pose: Pose) -> None:
        """Put a place to where it is seen now."""
        now = self.fixed(pose)
        place.pose, place.keyframe = now.pose, now.keyframe

    def pose_of(self, place: NotedPlace) -> Pose:
        """Where a place is now, in the world model's frame."""
        if place.keyframe is None or self.surveyor is None:
            return place.pose
        return compose(self.surveyor.keyframe(place.keyframe), place.pose)

    def apart(self, place: NotedPlace, pose: Pose) -> float:
        """How far a place is from a pose, m."""
        there = self.pose_of(place)
        return distance_between((there.x, there.y), (pose.x, pose.y))

    def nearest(self, pose: Pose, within: float) -> NotedPlace | None:
        """The kept place nearest to a pose, at most so far away, m; None where there is none."""
        near = min(self.kept, key=lambda place: self.apart(place, pose), default=None)
        return near if near is not None and self.apart(near, pose) <= within else None
