"""How well one pose of a graph is known as seen from another.

The shortest path through steps and loops bounds the covariance from above (Olson's Dijkstra projection, "Robust and
efficient robotic mapping", 2008). An error in heading on the way moves the far end by the lever from there to it; with
the moments of these errors summed up along the path, the covariance at any point follows at once.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Generator
from typing import NamedTuple

from perception.mapping.graph import Link, PoseGraph
from perception.mapping.information import Symmetric
from transport.messages import Pose

SLICE = 60
"""Poses settled between two pauses."""
LEVER = 4.0
"""Square of the lever at which an error in heading weighs like one in place when paths are compared, m^2."""


class Moments(NamedTuple):
    """Sums over the links of a path of their covariance, with axes of the graph's frame, and its moments.

    Attributes:
        own: the covariances.
        tx: of the heading's variance times x.
        ty: times y.
        txx: times x x.
        txy: times x y.
        tyy: times y y.
        xt_x: of the covariance of x and heading, times x.
        xt_y: times y.
        yt_x: of the covariance of y and heading, times x.
        yt_y: times y.
    """

    own: Symmetric = Symmetric()
    tx: float = 0.0
    ty: float = 0.0
    txx: float = 0.0
    txy: float = 0.0
    tyy: float = 0.0
    xt_x: float = 0.0
    xt_y: float = 0.0
    yt_x: float = 0.0
    yt_y: float = 0.0

    def with_link(self, covariance: Symmetric, at: Pose) -> Moments:
        """The path with one more link, whose second pose is ``at``."""
        t, xt, yt, x, y = covariance.tt, covariance.xt, covariance.yt, at.x, at.y
        own, tx, ty, txx, txy, tyy, xt_x, xt_y, yt_x, yt_y = self
        return Moments(
            own.plus(covariance),
            tx + t * x,
            ty + t * y,
            txx + t * x * x,
            txy + t * x * y,
            tyy + t * y * y,
            xt_x + xt * x,
            xt_y + xt * y,
            yt_x + yt * x,
            yt_y + yt * y,
        )

    @property
    def cost(self) -> float:
        """The cost of a path."""
        return self.own.xx + self.own.yy + LEVER * self.own.tt

    def at(self, place: Pose) -> Symmetric:
        """The covariance of a pose at the end of the path, with axes of the graph's frame."""
        own, x, y = self.own, place.x, place.y
        across = own.tt * y * y - 2 * self.ty * y + self.tyy
        along = own.tt * x * x - 2 * self.tx * x + self.txx
        both = own.tt * x * y - self.tx * y - self.ty * x + self.txy
        return Symmetric(
            own.xx + across - 2 * (own.xt * y - self.xt_y),
            own.xy - both + (own.xt * x - self.xt_x) - (own.yt * y - self.yt_y),
            own.xt - (own.tt * y - self.ty),
            own.yy + along + 2 * (own.yt * x - self.yt_x),
            own.yt + (own.tt * x - self.tx),
            own.tt,
        )


class Paths:
    """The links of a graph, for finding the surest paths."""

    def __init__(self) -> None:
        self._links: list[list[tuple[int, Link]]] = [[]]

    def add(self, link: Link) -> None:
        """Take in a link; poses come in order."""
        while len(self._links) <= max(link.first, link.second):
            self._links.append([])
        self._links[link.first].append((link.second, link))
        self._links[link.second].append((link.first, link))

    def from_pose(self, graph: PoseGraph, start: int, caution: float) -> Generator[None, None, dict[int, Moments]]:
        """The surest path from a pose to each other one, in small pieces of work."""
        settled: dict[int, Moments] = {}
        waiting: list[tuple[float, int, Moments]] = [(0.0, start, Moments())]
        while waiting:
            _, here, moments = heapq.heappop(waiting)
            if here in settled:
                continue
            settled[here] = moments
            if len(settled) % SLICE == 0:
                yield
            for there, link in self._links[here]:
                if there in settled:
                    continue
                at = graph.poses[link.second]
                covariance = link.covariance.times(caution * caution).turned(at.heading)
                longer = moments.with_link(covariance, at)
                heapq.heappush(waiting, (longer.cost, there, longer))
        return settled


def certainties(graph: PoseGraph, paths: Paths, shared: int) -> list[Symmetric]:
    """The covariance of each pose as seen from the first one, with axes of the graph's frame.

    The sum over a path is a bound: it takes all steps as independent. They are not, for each scan is matched with what
    many keyframes before have shown, so their errors do not add up until the scans have no keyframe in common.

    Args:
        graph: the poses.
        paths: its links.
        shared: how many keyframes a scan is matched with.
    """
    work = paths.from_pose(graph, 0, 1.0 / math.sqrt(shared))
    while True:
        try:
            next(work)
        except StopIteration as end:
            settled: dict[int, Moments] = end.value
            return [settled[number].at(pose) for number, pose in enumerate(graph.poses)]
