"""Results of perception in a tick, for a picture: landmarks, nodes, ways of a junction, a door, the minimap, the map.

Everything except the map is in the robot's frame; it influences no decision.
"""

from __future__ import annotations

import math
from typing import Any

from perception.facts import Facts, turned
from perception.mapping.surveyor import Surveyor
from perception.ways import Way
from transport.messages import Pose

MAP_POINTS = 2000
"""The largest number of map points that are shown."""


def sights(facts: Facts) -> dict[str, Any]:
    """The results, as JSON values; lengths in m.

    Returns:
        ``landmarks`` (x1, y1, x2, y2), ``nodes`` (x, y, kind), ``ways`` (outlines), ``door`` (x1, y1, x2, y2) if there
        may be one, ``minimap`` (``size`` cells of ``cell`` m a side, turned by ``turn``, rows ahead, columns to the
        left, ``2`` where something is), ``pose`` of the robot in the frame of the ``map``: its keyframes' ``poses``,
        ``points`` on walls, the ``ellipse`` of the robot's place (two standard deviations along two axes, direction
        of the first), and ``knowledge`` of it (``known``, ``doubtful``, ``lost``).
    """
    minimap, pose, surveyor = facts.minimap, facts.pose, facts.world.surveyor
    found: dict[str, Any] = {
        "landmarks": [_rounded(*one.start, *one.end) for one in facts.landmarks],
        "nodes": [[*_rounded(node.x, node.y), node.kind.value] for node in facts.nodes],
        "ways": _ways(facts),
        "minimap": {
            "size": len(minimap.cells),
            "cell": minimap.cell,
            "turn": -facts.misalignment,
            "rows": ["".join(map(str, row)) for row in minimap.cells.tolist()],
        },
        "pose": _rounded(pose.x, pose.y, pose.heading),
    }
    if facts.door is not None:
        found["door"] = _rounded(*facts.door.right, *facts.door.left)
    if surveyor is not None and surveyor.mapper.clouds:
        found["map"] = _map(surveyor, pose)
    return found


def _rounded(*values: float) -> list[float]:
    return [round(value, 3) for value in values]


def _ways(facts: Facts) -> list[list[list[float]]]:
    """The open ways to the sides as rectangles in the robot's frame."""
    junction, outlines = facts.junction, []
    for way, wall, side in ((junction.left, junction.left_wall, 1), (junction.right, junction.right_wall, -1)):
        if _drawable(way, wall):
            inner, outer = side * wall, side * (wall + way.depth)
            outlines.append([(way.near, inner), (way.far, inner), (way.far, outer), (way.near, outer)])
    cosine, sine = math.cos(facts.misalignment), math.sin(facts.misalignment)
    return [[_rounded(cosine * x - sine * y, sine * x + cosine * y) for x, y in outline] for outline in outlines]


def _drawable(way: Way, wall: float) -> bool:
    return way.open and all(map(math.isfinite, (way.near, way.far, way.depth, wall)))


def _map(surveyor: Surveyor, pose: Pose) -> dict[str, Any]:
    """The map in the world model's frame."""
    count = len(surveyor.mapper.clouds)
    poses = [surveyor.keyframe(number) for number in range(min(count, len(surveyor.mapper.graph.poses)))]
    every = max(1, math.ceil(sum(len(cloud) for cloud in surveyor.mapper.clouds) / MAP_POINTS))
    points: list[list[float]] = []
    for cloud, place in zip(surveyor.mapper.clouds, poses, strict=False):
        rows = turned(cloud.points.T[::every], place.heading)
        points += [[round(place.x + x, 2), round(place.y + y, 2)] for x, y in rows.tolist()]
    first, second, direction = surveyor.covariance.ellipse
    return {
        "poses": [_rounded(one.x, one.y) for one in poses],
        "points": points,
        "ellipse": _rounded(2 * first, 2 * second, pose.heading + direction),
        "knowledge": surveyor.knowledge.value,
    }
