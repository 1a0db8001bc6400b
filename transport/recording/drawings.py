"""The wire format of messages for viewers: maps, paths, outlines and points, in CDR as in ROS 2.

Sources: the message definitions of ROS 2 Humble.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from transport import codec
from transport.arithmetic import cos, sin
from transport.messages import Pose

GRID = "nav_msgs/msg/OccupancyGrid"
PATH = "nav_msgs/msg/Path"
OUTLINE = "geometry_msgs/msg/PolygonStamped"
POINTS = "sensor_msgs/msg/PointCloud2"

MAP_FRAME = "map"


@dataclass(frozen=True, slots=True, eq=False)
class Grid:
    """A map of cells.

    Attributes:
        cells: 0 free, 100 occupied, -1 unknown; shape (rows, columns), the first row at the lower edge.
        resolution: edge of a cell, m.
        x: of the lower left corner, m.
        y: of the lower left corner, m.
    """

    cells: NDArray[np.int8]
    resolution: float
    x: float
    y: float


def encode_grid(grid: Grid, stamp: int) -> bytes:
    """A map as ``nav_msgs/OccupancyGrid`` in the frame ``map``."""
    rows, columns = grid.cells.shape
    pose = _pose(Pose(grid.x, grid.y, 0.0))
    info = codec.MESSAGES["nav_msgs/msg/MapMetaData"](codec.time_of(stamp), grid.resolution, columns, rows, pose)
    return codec.encode_message(codec.MESSAGES[GRID](codec.header(stamp, MAP_FRAME), info, grid.cells.ravel()), GRID)


def encode_path(poses: Sequence[Pose], frame: str, stamp: int) -> bytes:
    """Where something has been as ``nav_msgs/Path``."""
    header = codec.header(stamp, frame)
    stamped = [codec.MESSAGES["geometry_msgs/msg/PoseStamped"](header, _pose(pose)) for pose in poses]
    return codec.encode_message(codec.MESSAGES[PATH](header, stamped), PATH)


def encode_outline(corners: Sequence[tuple[float, float]], stamp: int) -> bytes:
    """A robot's outline as ``geometry_msgs/PolygonStamped`` in the frame ``base_link``."""
    points = [codec.MESSAGES["geometry_msgs/msg/Point32"](x, y, 0.0) for x, y in corners]
    outline = codec.MESSAGES["geometry_msgs/msg/Polygon"](points)
    return codec.encode_message(codec.MESSAGES[OUTLINE](codec.header(stamp, codec.BASE_FRAME), outline), OUTLINE)


def encode_points(points: NDArray[np.float32], stamp: int) -> bytes:
    """Points as ``sensor_msgs/PointCloud2`` in the frame ``laser``.

    Args:
        points: x, y and z in metres, shape (n, 3).
        stamp: when they were seen, ns.
    """
    fields = [codec.MESSAGES["sensor_msgs/msg/PointField"](name, 4 * at, 7, 1) for at, name in enumerate("xyz")]
    data, count = np.frombuffer(points.astype("<f4", copy=False).tobytes(), dtype=np.uint8), len(points)
    cloud = codec.MESSAGES[POINTS](
        header=codec.header(stamp, codec.LASER_FRAME),
        height=1,
        width=count,
        fields=fields,
        is_bigendian=False,
        point_step=12,
        row_step=12 * count,
        data=data,
        is_dense=True,
    )
    return codec.encode_message(cloud, POINTS)


def _pose(pose: Pose) -> Any:
    half = pose.heading / 2
    place = codec.MESSAGES["geometry_msgs/msg/Point"](pose.x, pose.y, 0.0)
    turn = codec.MESSAGES["geometry_msgs/msg/Quaternion"](0.0, 0.0, sin(half), cos(half))
    return codec.MESSAGES["geometry_msgs/msg/Pose"](place, turn)
