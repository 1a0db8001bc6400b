"""Nodes: the ends and corners of the walls in sight, and the walls between them (2017)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

from perception.lines import LinePieces
from perception.settings import NodeSettings
from perception.sweep import Floats, ScanPoints
from transport.arithmetic import atan2, distance_between, norm
from transport.description import Point

MOST = 250
"""The neighbours of the right-angle test are at most this many hits away."""


class NodeKind(StrEnum):
    """What a node is."""

    END = "end"
    CORNER = "corner"


class Node(NamedTuple):
    """An end or a corner of a wall.

    Attributes:
        id: number of the node, from right to left as the sensor looks, from 0.
        kind: end or corner.
        x: in the robot's frame, m.
        y: the same.
        distance: from the robot's origin, m.
        bearing: rad from the robot's x axis.
        beam: the beam that hit it.
        connections: ids of the nodes that a wall joins to it.
    """

    id: int
    kind: NodeKind
    x: float
    y: float
    distance: float
    bearing: float
    beam: int
    connections: tuple[int, ...] = ()

    @property
    def point(self) -> Point:
        """Its place in the robot's frame, m."""
        return (self.x, self.y)


@dataclass(frozen=True, slots=True)
class WallSegment:
    """A wall between two nodes, by their ids."""

    first: int
    second: int


def find_nodes(sweep: ScanPoints, pieces: LinePieces, settings: NodeSettings) -> tuple[Node, ...]:
    """The nodes of a scan.

    Where a run of hits begins or ends with a jump, at the first and at the last hit, is an end. Where the walls bend,
    the right-angle test decides: with one hit some distance before and one some distance behind, Pythagoras' theorem
    must hold. The nodes of a run are connected one to the next.

    Args:
        sweep: the scan.
        pieces: where the runs of hits begin and end and where their chords bend.
        settings: distances and tolerances.
    """
    points = sweep.points
    found: list[_Found] = []
    for first, last in pieces.runs:
        if last - first < settings.min_hits:
            continue
        inner = [bend for bend in pieces.bends if first < bend < last]
        corners = [bend for bend in inner if is_right_angle(points, (first, bend, last), settings)]
        found.append(_Found(first, NodeKind.END, connected=False))
        found += [_Found(corner, NodeKind.CORNER, connected=True) for corner in corners]
        found.append(_Found(last, NodeKind.END, connected=True))
    return _numbered(sweep, _apart(points, found, settings.apart))


class _Found(NamedTuple):
    """A node as it was found.

    Attributes:
        hit: its number among the hits.
        kind: what it is.
        connected: with the node before it.
    """

    hit: int
    kind: NodeKind
    connected: bool


def _apart(points: Floats, found: Sequence[_Found], distance: float) -> list[_Found]:
    """Of connected nodes closer than a distance keep the first; an end stays an end."""
    kept: list[_Found] = []
    for one in found:
        before = kept[-1] if kept and one.connected else None
        if before is None or distance_between(_point(points, one.hit), _point(points, before.hit)) >= distance:
            kept.append(one)
        elif one.kind is NodeKind.END and before.kind is NodeKind.CORNER:
            kept[-1] = one._replace(connected=before.connected)
    return kept


def _numbered(sweep: ScanPoints, found: Sequence[_Found]) -> tuple[Node, ...]:
    nodes, points = [], sweep.points
    for number, (index, kind, connected) in enumerate(found):
        x, y = _point(points, index)
        before = (number - 1,) if connected and number else ()
        after = (number + 1,) if number + 1 < len(found) and found[number + 1].connected else ()
        beam = sweep.beams.item(index)
        nodes.append(Node(number, kind, x, y, norm(x, y), atan2(y, x), beam, before + after))
    return tuple(nodes)


def is_right_angle(points: Floats, place: tuple[int, int, int], settings: NodeSettings) -> bool:
    """The right-angle test of 2017 at one hit.

    Args:
        points: hits in order, m, shape (n, 2).
        place: first hit of the run, the hit to test, last hit of the run.
        settings: at which distance the neighbours are taken, and how far their distance may be from Pythagoras'.
    """
    first, middle, last = place
    start = max(first, middle - MOST)
    corner = middle - start
    x, y = points[start : min(last, middle + MOST) + 1].T
    dx, dy = x - x[corner], y - y[corner]
    away = dx * dx + dy * dy >= settings.arm * settings.arm
    # How many hits back and on the first one is that is far enough; none where there is no such.
    back, on = int(away[corner::-1].argmax()), int(away[corner:].argmax())
    if not back or not on:
        return False
    before = slice(max(corner - back - 4, 0), corner - back + 1)
    after = slice(corner + on, corner + on + 5)
    one, other = (_mean(dx[before]), _mean(dy[before])), (_mean(dx[after]), _mean(dy[after]))
    return abs(distance_between(one, other) / _hypotenuse(one, other) - 1.0) <= settings.pythagoras


def _hypotenuse(one: Point, other: Point) -> float:
    """How far two legs' ends were apart if there were a right angle between the legs."""
    return math.sqrt(one[0] * one[0] + one[1] * one[1] + other[0] * other[0] + other[1] * other[1])


def _mean(values: Floats) -> float:
    """The mean of a few values."""
    numbers = values.tolist()
    return math.fsum(numbers) / len(numbers)


def _point(points: Floats, index: int) -> Point:
    return (points.item(index, 0), points.item(index, 1))


def wall_segments(nodes: Sequence[Node]) -> tuple[WallSegment, ...]:
    """The walls between connected nodes."""
    return tuple(WallSegment(node.id, other) for node in nodes for other in node.connections if node.id < other)
