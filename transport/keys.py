"""The keys of a robot.

zenoh-bridge-ros2dds: the key is the ROS name without its leading slash, below a namespace (``pico1/cmd_vel``).
rmw_zenoh: ``DOMAIN/NAME/TYPE/HASH``, with the type as DDS spells it and the hash of REP 2011.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from transport import codec
from transport.bus import SESSION
from transport.section import is_network_name
from transport.settings import LinkSettings


@dataclass(frozen=True, slots=True)
class RobotKeys:
    """The keys of one robot.

    Attributes:
        namespace: the robot's name, or the namespace of a bare ROS 2 robot, which may be empty.
        settings: names of its topics, and how they become keys.
    """

    namespace: str
    settings: LinkSettings = field(default_factory=LinkSettings)

    def __post_init__(self) -> None:
        if self.namespace and not is_network_name(self.namespace):
            raise ValueError(
                f"{self.namespace!r} cannot be a robot's name on a network: letters, digits, - and _, a letter first"
            )

    @property
    def scan(self) -> str:
        """``sensor_msgs/LaserScan``, from the robot."""
        return self._topic(self.settings.scan, codec.LASER_SCAN)

    @property
    def odometry(self) -> str:
        """``nav_msgs/Odometry``, from the robot."""
        return self._topic(self.settings.odometry, codec.ODOMETRY)

    @property
    def clock(self) -> str:
        """``rosgraph_msgs/Clock``, from the robot."""
        return self._topic("clock", codec.CLOCK)

    @property
    def command(self) -> str:
        """``geometry_msgs/Twist`` or ``TwistStamped``, to the robot."""
        return self._topic(self.settings.command, f"geometry_msgs/msg/{self.settings.command_type}")

    @property
    def door(self) -> str:
        """The door bell: the service ``std_srvs/Trigger`` or the message ``std_msgs/Empty``."""
        return self._topic(self.settings.door, codec.TRIGGER if self.settings.door_call == "service" else codec.EMPTY)

    @property
    def navigation(self) -> str:
        """The action ``nav2_msgs/NavigateToPose``: what its services and topics are below, without a domain."""
        return f"{self.namespace}/{self.settings.navigation.strip('/')}".lstrip("/")

    @property
    def session(self) -> str:
        """Questions of a controller and their answers, in JSON."""
        return f"{self.namespace}/{SESSION}"

    def _topic(self, name: str, kind: str) -> str:
        path = f"{self.namespace}/{name.strip('/')}".lstrip("/")
        if self.settings.keys == "bridge":
            return path
        package, group, short = kind.split("/")
        return f"{self.settings.domain}/{path}/{package}::{group}::dds_::{short}_/{codec.type_hash(kind)}"


@dataclass(frozen=True, slots=True)
class MachineKeys:
    """The keys of the machine that drives a robot.

    Attributes:
        robot: the robot's name on the network.
    """

    robot: str

    @property
    def model(self) -> str:
        """A question with any text: answered with the constant part of the run."""
        return f"{self.robot}/machine/model"

    @property
    def step(self) -> str:
        """The newest tick of the machine, best effort."""
        return f"{self.robot}/machine/step"

    @property
    def why(self) -> str:
        """A question with a state's name: the verdicts about its transitions in the newest tick."""
        return f"{self.robot}/machine/why"

    @property
    def sights(self) -> str:
        """A question with any text: what perception found in the newest tick."""
        return f"{self.robot}/machine/sights"

    @property
    def operate(self) -> str:
        """The requests of an operator: an event, a pause, the end."""
        return f"{self.robot}/machine/operate"
