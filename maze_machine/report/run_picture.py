"""From a run to its picture."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from maze_machine.drive.path_recorder import PathRecorder
from maze_machine.simulated.world import SimulatedWorld
from maze_machine.view.run_figure import Scene, Trail, save_picture
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


def save_run(file: Path, world: SimulatedWorld | None, kept: PathRecorder, title: str) -> None:
    """Save the picture of a run: in the maze if it was simulated here, otherwise by odometry alone.

    Raises:
        OSError: the file cannot be written.
    """
    file.parent.mkdir(parents=True, exist_ok=True)
    if world is None:
        save_picture(file, NOWHERE, trail_of(kept, kept.poses), f"{title} (by odometry)")
    else:
        save_picture(file, scene_of(world.maze), trail_of(kept, world.path), title)


def _pairs(segments: NDArray[np.float64]) -> NDArray[np.float64]:
    return segments.reshape(-1, 2, 2)
