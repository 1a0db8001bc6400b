"""From the robot's map to its drawing."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from maze_machine.view.run_figure import SeenMap, Spread
from perception.mapping.frames import compose, placed
from perception.mapping.information import Symmetric
from perception.mapping.surveyor import Surveyor
from transport.messages import Pose

SPREADS = 40
"""About this many of the keyframes are drawn with their uncertainty."""


def drawn_map(surveyor: Surveyor, frame: Pose, known: Sequence[Symmetric] | None = None) -> SeenMap | None:
    """A map for a picture; None where nothing has been seen.

    Args:
        surveyor: keeps the map.
        frame: of the world model in the picture.
        known: how well the place of each keyframe is known, where the caller has computed it; else computed here.
    """
    clouds = surveyor.mapper.clouds
    if not clouds:
        return None
    poses = [compose(frame, surveyor.keyframe(number)) for number in range(len(clouds))]
    points = np.concatenate([placed(cloud.points, pose) for cloud, pose in zip(clouds, poses, strict=True)], axis=1)
    if known is None:
        known = surveyor.mapper.certainties()
    turn = frame.heading + surveyor.start.heading
    spreads = [
        Spread(poses[number].x, poses[number].y, *known[number].turned(turn).ellipse)
        for number in range(0, len(poses), max(1, len(poses) // SPREADS))
    ]
    return SeenMap(points.T, np.array([(pose.x, pose.y) for pose in poses]), spreads)
