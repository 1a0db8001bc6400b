"""From a run to its picture."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from maze_machine.drive.map_recorder import MapRecorder
from maze_machine.drive.path_recorder import PathRecorder
from maze_machine.report.drawn_map import drawn_map
from maze_machine.simulated.world import SimulatedWorld
from maze_machine.view.run_figure import Scene, SeenMap, Trail, save_picture
from sim.maze import Maze
from transport.messages import Pose

NOWHERE = Scene(*(np.empty((0, 2, 2)) for _ in range(3)))
"""The scene of a robot without a known maze."""


def scene_of(maze: Maze) -> Scene:
    """The scene of a maze."""
    doors = np.array([door.leaf for door in maze.doors], dtype=np.float64)
    return Scene(_pairs(maze.barriers), _pairs(doors), _pairs(maze.exits))


def trail_of(kept: PathRecorder, poses: Sequence[Pose]) -> Trail:
    """The path of a run for its picture."""
    positions = np.array([(pose.x, pose.y) for pose in poses], dtype=np.float64).reshape(-1, 2)
    return Trail(np.array(kept.times), positions[: len(kept.times)], kept.states)


def save_run(
    file: Path, world: SimulatedWorld | None, kept: PathRecorder, title: str, mapped: MapRecorder | None = None
) -> None:
    """Save the picture of a run: in the maze if it was simulated here, otherwise by odometry alone.

    Args:
        file: the picture.
        world: the simulation, if it was in this process.
        kept: the path.
        title: above the picture.
        mapped: the robot's map, if it may have one; it is drawn over the maze.

    Raises:
        OSError: the file cannot be written.
    """
    file.parent.mkdir(parents=True, exist_ok=True)
    seen = seen_by(mapped) if mapped is not None else None
    if world is None:
        save_picture(file, NOWHERE, trail_of(kept, kept.poses), f"{title} (by odometry)", seen)
    else:
        save_picture(file, scene_of(world.maze), trail_of(kept, world.path), title, seen)


def seen_by(mapped: MapRecorder) -> SeenMap | None:
    """The map of a run for its picture; None where the robot made none, or never knew its place on it."""
    frame = mapped.frame
    if frame is None or mapped.world is None or mapped.world.surveyor is None:
        return None
    return drawn_map(mapped.world.surveyor, frame)


def _pairs(segments: NDArray[np.float64]) -> NDArray[np.float64]:
    return segments.reshape(-1, 2, 2)
