"""One tick's observation with everything that perception can say of it, worked out when asked for and only once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from perception.settings import PerceptionSettings
from transport.description import RobotDescription
from transport.messages import Observation


@dataclass(frozen=True)
class Facts:
    """All that skills and a machine's signals see of a tick.

    Attributes:
        observation: the tick's scan, odometry and door answer.
        robot: shape, limits and laser of the robot.
        settings: perception's thresholds.
    """

    observation: Observation
    robot: RobotDescription
    settings: PerceptionSettings

    @cached_property
    def time(self) -> float:
        """The tick's time in seconds."""
        return self.observation.time
