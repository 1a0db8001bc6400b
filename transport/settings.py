"""The settings of the link to a robot: the section ``[link]`` of a robot profile."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from transport.section import Positive, Settings, Topic


class LinkSettings(Settings):
    """How to reach a robot, and the timeouts of the link."""

    gate: bool = True
    """Whether a simulator or `maze-machine gate` answers at the other end, with leases and a command time-out; if not,
    it is a bare ROS 2 driver, whose own command time-out must stop it."""
    keys: Literal["bridge", "rmw_zenoh"] = "bridge"
    """How ROS names become keys: as zenoh-bridge-ros2dds lays them out, or as rmw_zenoh does."""
    domain: Annotated[int, Field(ge=0, le=232)] = 0
    """ROS domain, for rmw_zenoh."""
    scan: Topic = "scan"
    """Name of the laser's topic, below the robot's namespace."""
    odometry: Topic = "odom"
    """Name of the odometry's topic."""
    command: Topic = "cmd_vel"
    """Name of the velocity command's topic."""
    command_type: Literal["Twist", "TwistStamped"] = "Twist"
    """Type of the velocity command of a bare driver, of geometry_msgs: newer ones require TwistStamped. Its stamp
    is that of the observation which the command answers."""
    door: Topic = "open_door"
    """Name of the door bell: a service or a topic."""
    door_call: Literal["service", "message"] = "service"
    """Whether the door bell is a service call (std_srvs/Trigger) with an answer, or a message (std_msgs/Empty)."""
    navigation: Topic = "navigate_to_pose"
    """Name of the action of a bare driver's own navigation (nav2_msgs/NavigateToPose)."""
    navigation_frame: Topic = "map"
    """The frame in which that goal is given."""
    dead_man: Positive = 0.25
    """The robot's side stops the base when it has accepted no command for this long, s; in a profile 2 at most."""
    answer_age: Positive = 0.35
    """The robot's side rejects a command that answers an observation older than this, s; in a profile 2 at
    most."""
    patience: Positive = 1.0
    """The lease of a controller that was silent for this long may go to another, s."""
    stale: Positive = 0.35
    """The base is stopped when scan or odometry is older than this, s: by the controller, and by a gate on its own; in
    a profile 2 s at most."""
    resume: Positive = 0.3
    """It may move again when both have been fresh and credible for this long, s."""
    silence: Positive = 5.0
    """A controller without any message for this long ends the run, s."""
    step: Positive = 10.0
    """How long a simulator in lockstep may be silent during a step, s: the first one may compile code. One that still
    answers questions has six times as long."""
    connect: Positive = 5.0
    """Timeout for connecting to a robot, s."""

    @model_validator(mode="before")
    @classmethod
    def _bare(cls, values: object) -> object:
        """Programs of rmw_zenoh have no gate, so that is the default for them."""
        if isinstance(values, dict) and values.get("keys") == "rmw_zenoh":
            return {"gate": False} | values
        return values

    @model_validator(mode="after")
    def _goes_together(self) -> Self:
        if self.keys == "rmw_zenoh" and self.gate:
            raise ValueError('must have `gate = false` with `keys = "rmw_zenoh"`: its programs have no gate')
        return self
