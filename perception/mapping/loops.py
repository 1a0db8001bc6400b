"""Loop closure: which old keyframes may show the same place, whether they match, and when to accept it.

A match is accepted only if it lies within what the graph knows of the two poses, fixes the place in both directions and
has no rival elsewhere in the window. Another match a few keyframes on must say the same.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

from perception.mapping.cloud import Cloud
from perception.mapping.frames import between, compose
from perception.mapping.graph import Link, PoseGraph
from perception.mapping.information import Symmetric
from perception.mapping.matching import Match, Reference, matched
from perception.mapping.searching import BlurredWalls, Window, search
from perception.mapping.settings import MappingSettings
from perception.mapping.uncertainty import Moments, Paths
from transport.arithmetic import norm, square
from transport.messages import Pose, wrap_angle

MATCHING = Symmetric.diagonal(square(0.03), square(0.03), square(0.01))
"""Covariance of what a match itself may be off where the graph's poses bend the walls, m and rad."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """An old keyframe that may show the same place.

    Attributes:
        keyframe: its number.
        covariance: of the new pose as seen from it, with axes of the graph's frame.
    """

    keyframe: int
    covariance: Symmetric

    @property
    def deviation(self) -> float:
        """Standard deviation of the place along its worse axis, m."""
        return math.sqrt(max(self.covariance.xx, self.covariance.yy))


@dataclass(slots=True)
class Loops:
    """Finds loops in a graph that grows."""

    settings: MappingSettings
    graph: PoseGraph
    clouds: list[Cloud]
    paths: Paths = field(default_factory=Paths)
    _waiting: list[Link] = field(default_factory=list)
    _unsolved: int = 0

    def reference(self, base: int, keyframes: Iterable[int]) -> Reference:
        """Keyframes' clouds in the frame of one of them."""
        poses = self.graph.poses
        seen = [self.clouds[number].seen_from(between(poses[base], poses[number])) for number in keyframes]
        return Reference(Cloud.joined(seen).merged(self.settings.match.cell))

    def find(self, number: int) -> Iterator[None]:
        """Search for loops of a new keyframe and close the confirmed ones, in small pieces of work."""
        if not any(self._near(number, old, self.settings.loops.most_reach) for old in self._old(number)):
            return
        paths = yield from self.paths.from_pose(self.graph, number, self.settings.loops.caution)
        worth = False
        for candidate in self._candidates(number, paths):
            loop = self._matched(number, candidate)
            if loop is not None:
                worth |= self._confirmed(loop)
            yield
        if worth:
            self._unsolved = 0
            yield from self.graph.optimise()

    def _old(self, number: int) -> range:
        return range(number - self.settings.loops.gap)

    def _near(self, one: int, other: int, more: float) -> bool:
        a, b = self.graph.poses[one], self.graph.poses[other]
        return norm(a.x - b.x, a.y - b.y) < self.settings.loops.reach + more

    def _candidates(self, number: int, paths: dict[int, Moments]) -> list[Candidate]:
        """The nearest keyframe of each stretch of the way that may show the same place, the best first."""
        settings, here = self.settings.loops, self.graph.poses[number]
        found = []
        for old in self._old(number):
            if old not in paths or not self._near(number, old, settings.most_reach):
                continue
            candidate = Candidate(old, paths[old].at(here))
            if self._near(number, old, min(2 * candidate.deviation, settings.most_reach)):
                pose = self.graph.poses[old]
                turned = abs(wrap_angle(pose.heading - here.heading))
                found.append((norm(pose.x - here.x, pose.y - here.y) + turned / 2, old, candidate))
        chosen: list[Candidate] = []
        for _, old, candidate in sorted(found, key=lambda one: one[:2]):
            if all(abs(old - other.keyframe) > settings.stretch for other in chosen):
                chosen.append(candidate)
            if len(chosen) == settings.candidates:
                break
        return chosen

    def _matched(self, number: int, candidate: Candidate) -> Link | None:
        """The loop between a new keyframe and an old one, if their scans fit within what the graph allows."""
        settings, old = self.settings.loops, candidate.keyframe
        poses, cloud = self.graph.poses, self.clouds[number]
        around = range(max(0, old - settings.around), min(old + settings.around + 1, number - settings.gap))
        reference = self.reference(old, around)
        guess = between(poses[old], poses[number])
        found: Match | None = None
        if candidate.deviation < settings.near:
            found = matched(cloud, reference, guess, None, self.settings.match)
        if found is None or found.share < settings.share:
            found = self._searched(cloud, reference, guess, candidate)
        if found is None or found.share < settings.share:
            return None
        own = found.seen.inverse()
        if own.xx + own.yy > square(settings.place_known) or own.tt > square(settings.heading_known):
            return None
        seen, here = compose(poses[old], found.pose), poses[number]
        allowed = candidate.covariance.plus(own.turned(seen.heading)).plus(MATCHING)
        off = (seen.x - here.x, seen.y - here.y, wrap_angle(seen.heading - here.heading))
        if allowed.inverse().square(*off) > settings.gate:
            return None
        return Link(old, number, found.pose, found.seen)

    def _searched(self, cloud: Cloud, reference: Reference, guess: Pose, candidate: Candidate) -> Match | None:
        settings = self.settings.loops
        if not len(cloud) or not len(reference.cloud):
            return None
        across = min(max(3 * candidate.deviation, 0.3), settings.most_across)
        turn = min(max(3 * math.sqrt(candidate.covariance.tt), 0.1), settings.most_around)
        found = search(cloud, BlurredWalls.of(reference.cloud, self.settings.search), guess, Window(across, turn))
        if found.rival > self.settings.search.distinct * found.score:
            return None
        return matched(cloud, reference, found.pose, None, self.settings.match)

    def _confirmed(self, loop: Link) -> bool:
        """Close a loop with those that it agrees with; returns whether the graph is worth solving again."""
        settings = self.settings.loops
        self._waiting = [other for other in self._waiting if loop.second - other.second <= settings.waiting]
        agreeing = [other for other in self._waiting if self._agree(loop, other)]
        self._waiting.append(loop)
        if not agreeing:
            return False
        worth = False
        for link in [*agreeing, loop]:
            if link in self.graph.loops:
                continue
            off = between(self.graph.poses[link.second], compose(self.graph.poses[link.first], link.measured))
            worth |= norm(off.x, off.y) > settings.worth or abs(off.heading) > settings.worth_turn
            self.close(link)
        return worth or self._unsolved >= settings.every

    def close(self, loop: Link) -> None:
        """Add a loop that is accepted."""
        self.graph.close(loop)
        self.paths.add(loop)
        self._unsolved += 1

    def _agree(self, loop: Link, other: Link) -> bool:
        """Whether two loops put the new keyframe at the same place."""
        settings, poses = self.settings.loops, self.graph.poses
        if other.second >= loop.second or abs(other.first - loop.first) > settings.stretch:
            return False
        there = compose(compose(poses[other.first], other.measured), between(poses[other.second], poses[loop.second]))
        off = between(there, compose(poses[loop.first], loop.measured))
        allowed = settings.agreeing + settings.agreeing_way * (loop.second - other.second)
        return norm(off.x, off.y) < allowed and abs(off.heading) < settings.agreeing_turn
