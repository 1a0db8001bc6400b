"""From a run to its picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from controller.errors import UsageError
from controller.loop import Tick
from controller.simulation import SimulatedWorld
from sim.maze import Maze
from transport.messages import Pose
from view.picture import FORMATS, Scene, Trail, save_picture


@dataclass(slots=True)
class TrailKeeper:
    """Remembers where the robot was and what it did; a watcher of ticks."""

    times: list[float] = field(default_factory=list)
    poses: list[Pose] = field(default_factory=list)
    states: list[str] = field(default_factory=list)

    def __call__(self, tick: Tick) -> None:
        """Take in a tick."""
        self.times.append(tick.time)
        self.poses.append(tick.pose)
        self.states.append(tick.doing)

    def by_odometry(self) -> Trail:
        """The trail in the odometry frame: it drifts and its origin means nothing."""
        return self._trail(self.poses)

    def by_truth(self, world: SimulatedWorld) -> Trail:
        """The trail in the maze's frame."""
        return self._trail(world.path[: len(self.times)])

    def _trail(self, poses: Sequence[Pose]) -> Trail:
        positions = np.array([(pose.x, pose.y) for pose in poses], dtype=np.float64).reshape(-1, 2)
        return Trail(np.array(self.times), positions, self.states)


NOWHERE = Scene(*(np.empty((0, 2, 2)) for _ in range(3)))
"""For a robot whose surroundings are not known."""


def scene_of(maze: Maze) -> Scene:
    """What a picture shows of a maze."""
    doors = np.array([door.leaf for door in maze.doors], dtype=np.float64)
    return Scene(_pairs(maze.walls), _pairs(doors), _pairs(maze.exits))


def _pairs(segments: NDArray[np.float64]) -> NDArray[np.float64]:
    return segments.reshape(-1, 2, 2)


def checked_picture(file: Path) -> Path:
    """The file, if a picture can have such a name: to be found out before a robot drives.

    Raises:
        UsageError: its suffix is not that of an image format.
    """
    if file.suffix not in FORMATS:
        raise UsageError(f"--picture {file}: no image format `{file.suffix}`", f"one of {', '.join(FORMATS)}")
    return file


def save_run(file: Path, world: SimulatedWorld | None, kept: TrailKeeper, title: str) -> None:
    """Save the picture of a run: in the maze where it was simulated here, by odometry alone where it was not.

    Raises:
        OSError: the file cannot be written.
    """
    file.parent.mkdir(parents=True, exist_ok=True)
    if world is None:
        save_picture(file, NOWHERE, kept.by_odometry(), f"{title} (by odometry)")
    else:
        save_picture(file, scene_of(world.maze), kept.by_truth(world), title)
