"""The path of a robot and its states, kept for the picture of the run."""

from __future__ import annotations

from dataclasses import dataclass, field

from maze_machine.drive.tick import Tick
from transport.messages import Pose


@dataclass(slots=True)
class PathRecorder:
    """Remembers each tick's time, pose and state; a watcher of ticks.

    Attributes:
        times: s on the robot's clock.
        poses: by odometry, which drifts and whose origin means nothing.
        states: the active state of the machine.
    """

    times: list[float] = field(default_factory=list)
    poses: list[Pose] = field(default_factory=list)
    states: list[str] = field(default_factory=list)

    def __call__(self, tick: Tick) -> None:
        """Take in a tick."""
        self.times.append(tick.time)
        self.poses.append(tick.pose)
        self.states.append(tick.doing)
