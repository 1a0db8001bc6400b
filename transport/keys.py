"""On which keys a robot speaks, as zenoh-bridge-ros2dds lays ROS names out: the name, without its leading slash."""

from __future__ import annotations

import re
from dataclasses import dataclass

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]*(/[A-Za-z][A-Za-z0-9_-]*)*")


@dataclass(frozen=True, slots=True)
class RobotKeys:
    """The keys of one robot.

    Attributes:
        namespace: the robot's name.
    """

    namespace: str

    def __post_init__(self) -> None:
        if not _NAME.fullmatch(self.namespace):
            raise ValueError(
                f"{self.namespace!r} cannot be a robot's name on a network: letters, digits, - and _, a letter first"
            )

    @property
    def scan(self) -> str:
        """``sensor_msgs/LaserScan``, from the robot."""
        return f"{self.namespace}/scan"

    @property
    def odometry(self) -> str:
        """``nav_msgs/Odometry``, from the robot."""
        return f"{self.namespace}/odom"

    @property
    def clock(self) -> str:
        """``rosgraph_msgs/Clock``, from the robot."""
        return f"{self.namespace}/clock"

    @property
    def command(self) -> str:
        """``geometry_msgs/Twist``, to the robot."""
        return f"{self.namespace}/cmd_vel"

    @property
    def session(self) -> str:
        """Questions of a controller and their answers, in JSON."""
        return f"{self.namespace}/session"
