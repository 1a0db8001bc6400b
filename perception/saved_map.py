"""From a world model to the file of its map, and back."""

from __future__ import annotations

import math

import numpy as np

from perception.map_document import (
    FINEST,
    FORMAT,
    FREE,
    UNKNOWN,
    VERSION,
    WALL,
    DoorPart,
    GridPart,
    JunctionPart,
    KeyframePart,
    LinkPart,
    MapDocument,
    Placed,
)
from perception.mapping.cloud import Cloud
from perception.mapping.free_space import FreeSpace
from perception.mapping.graph import Link
from perception.mapping.information import Symmetric
from perception.mapping.mapper import Mapper
from perception.mapping.settings import FreeSpaceSettings
from perception.mapping.surveyor import Supposition, Surveyor
from perception.places import NotedPlace, Places
from perception.settings import PerceptionSettings
from perception.world import BEYOND, DoorPlace, WorldModel, to_world
from transport.arithmetic import cosines_and_sines, directions
from transport.description import Point
from transport.messages import Pose, wrap_angle

PLACES, ANGLES, DIGITS = 4, 6, 9
"""Digits after the point of lengths and angles, and of numbers of any size."""


def document_of(world: WorldModel, *, left: bool = False) -> MapDocument | None:
    """The map of a world model for a file; None where there is none.

    Args:
        world: the world model.
        left: whether the robot has just left the maze, so that the way out is known.
    """
    surveyor = world.surveyor
    if surveyor is None or not surveyor.mapper.clouds:
        return None
    graph, clouds = surveyor.mapper.graph, surveyor.mapper.clouds
    way_out = to_world(world.pose, (BEYOND, 0.0)) if left and world.place_known else world.way_out
    return MapDocument(
        format=FORMAT,
        version=VERSION,
        robot=_placed(world.pose) if world.place_known else None,
        way_out=_point(way_out) if way_out is not None else None,
        junctions=_junctions(world, surveyor, left=left),
        doors=tuple(DoorPart(right=_point(one.right), left=_point(one.left)) for one in world.dead_ends),
        grid=_grid(surveyor.free_space),
        keyframes=tuple(_keyframe(surveyor.keyframe(number), cloud) for number, cloud in enumerate(clouds)),
        steps=tuple(map(_link, graph.steps)),
        loops=tuple(map(_link, graph.loops)),
    )


def world_of(document: MapDocument, settings: PerceptionSettings, at: Pose | None) -> WorldModel:
    """The world model of a robot that begins with the map of a file; its frame is the map's.

    Args:
        document: the map.
        settings: perception's thresholds.
        at: where the robot is said to be on it; None where nothing is known: it is lost until it has found itself.
    """
    poses = [Pose(*one.pose) for one in document.keyframes]
    clouds = [_cloud(one) for one in document.keyframes]
    steps, loops = (list(map(_measured, links)) for links in (document.steps, document.loops))
    mapper = Mapper.of(settings.mapping, poses, clouds, steps, loops)
    grid = _space(document.grid, settings.mapping.free_space)
    known = Surveyor.resumed(mapper, grid, Pose(), Supposition())
    surveyor = Surveyor.resumed(mapper, grid, Pose(), None if at is None else known.suppose(at))
    dead_ends = [DoorPlace(one.right, one.left) for one in document.doors]
    world = WorldModel.on_map(settings, surveyor, dead_ends, document.way_out)
    if surveyor.began_at_start(settings.marks.same_place):
        world.marks.known = Places(surveyor, [_noted(one, surveyor) for one in document.junctions])
    return world


def start_of(document: MapDocument) -> Pose:
    """Where the map was begun."""
    return Pose(*document.keyframes[0].pose)


def _junctions(world: WorldModel, surveyor: Surveyor, *, left: bool) -> tuple[JunctionPart, ...]:
    """The marks that lead from where the map was begun out of the maze; none of a run that began elsewhere."""
    if not surveyor.began_at_start(world.settings.marks.same_place):
        return ()
    parts, places = [], world.marks.places if left else world.marks.known
    for one in places.kept:
        ahead, to_left, back, to_right = one.marks
        parts.append(JunctionPart(place=_placed(places.pose_of(one)), marks=(ahead, to_left, back, to_right)))
    return tuple(parts)


def _noted(part: JunctionPart, surveyor: Surveyor) -> NotedPlace:
    """A junction of a file, as seen from the nearest keyframe."""
    seen = surveyor.suppose(Pose(*part.place))
    return NotedPlace(seen.pose, seen.keyframe, list(part.marks))


def _rounded(value: float, digits: int) -> float:
    return round(value, digits) + 0.0  # no negative zero


def _point(point: Point) -> Point:
    return _rounded(point[0], PLACES), _rounded(point[1], PLACES)


def _placed(pose: Pose) -> Placed:
    return _rounded(pose.x, PLACES), _rounded(pose.y, PLACES), _rounded(wrap_angle(pose.heading), ANGLES)


def _keyframe(pose: Pose, cloud: Cloud) -> KeyframePart:
    towards = np.remainder(directions(cloud.normals[0], cloud.normals[1]), math.tau).round(PLACES)
    towards = np.where(towards > math.tau, 0.0, towards)  # a whole turn, rounded up
    columns = (
        cloud.points[0].round(PLACES),
        cloud.points[1].round(PLACES),
        towards,
        np.maximum(np.sqrt(cloud.variances).round(ANGLES), FINEST),
    )
    rows = zip(*((column + 0.0).tolist() for column in columns), strict=True)
    return KeyframePart(pose=_placed(pose), points=tuple(rows))


def _cloud(part: KeyframePart) -> Cloud:
    x, y, towards, deviations = np.array(part.points, dtype=np.float64).reshape(-1, 4).T
    return Cloud(np.stack([x, y]), np.stack(cosines_and_sines(towards)), deviations * deviations)


def _link(link: Link) -> LinkPart:
    entries = [float(f"{entry:.{DIGITS}g}") + 0.0 for entry in link.information]
    xx, xy, xt, yy, yt, tt = entries
    return LinkPart(
        first=link.first, second=link.second, pose=_placed(link.measured), information=(xx, xy, xt, yy, yt, tt)
    )


def _measured(part: LinkPart) -> Link:
    return Link(part.first, part.second, Pose(*part.pose), Symmetric(*part.information))


def _grid(space: FreeSpace) -> GridPart:
    """The grid without the rows and columns at its rim in which nothing is known."""
    known = space.belief != 0
    columns, lines = np.flatnonzero(known.any(axis=1)), np.flatnonzero(known.any(axis=0))
    if not len(columns):
        return GridPart(cell=space.settings.cell, corner=(0, 0), rows=())
    part = space.belief[columns[0] : columns[-1] + 1, lines[0] : lines[-1] + 1]
    drawn = np.where(part > 0, FREE, np.where(part < 0, WALL, UNKNOWN))
    rows = tuple("".join(row) for row in drawn.T[::-1].tolist())
    corner = space.corner[0] + int(columns[0]), space.corner[1] + int(lines[0])
    return GridPart(cell=space.settings.cell, corner=corner, rows=rows)


def _space(part: GridPart, settings: FreeSpaceSettings) -> FreeSpace:
    """The grid of a file; its cells are as wide as the file says."""
    own = settings.model_copy(update={"cell": part.cell})
    if not part.rows:
        return FreeSpace(own)
    drawn = np.array([list(row) for row in part.rows]).reshape(len(part.rows), -1)[::-1].T
    belief = np.where(drawn == FREE, settings.most, np.where(drawn == WALL, -settings.most, 0)).astype(np.int8)
    return FreeSpace(own, part.corner, np.ascontiguousarray(belief), 1)
