"""The wire format: messages as ROS 2 sends them, in CDR (little-endian, header ``00 01 00 00``).

A value that was encoded and decoded again has equal bits: what a ROS 2 message narrows (single precision ranges, the
quaternion of a heading), the values in :mod:`transport.messages` have narrowed already.

Sources: OMG DDSI-RTPS 2.5, section 10 (CDR encapsulation); the message definitions of ROS 2 Humble.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from transport.messages import NANOSECONDS, DoorReply, Odometry, Scan, ScanGeometry, Twist

LASER_SCAN = "sensor_msgs/msg/LaserScan"
ODOMETRY = "nav_msgs/msg/Odometry"
TWIST = "geometry_msgs/msg/Twist"
CLOCK = "rosgraph_msgs/msg/Clock"
EMPTY = "std_msgs/msg/Empty"
STRING = "std_msgs/msg/String"
TRANSFORMS = "tf2_msgs/msg/TFMessage"
TRIGGER_RESPONSE = "std_srvs/msg/Trigger_Response"

MAX_BEAMS = 100_000
"""The longest scan that is decoded; a longer one is malformed."""

LASER_FRAME = "laser"
ODOMETRY_FRAME = "odom"
BASE_FRAME = "base_link"

_MAX_SECONDS = 2**31


class CodecError(ValueError):
    """A payload is not the message that it should be."""


TYPES = get_typestore(Stores.ROS2_HUMBLE)
"""The ROS 2 message types, with the answer of ``std_srvs/Trigger`` added."""
TYPES.register(get_types_from_msg("bool success\nstring message\n", TRIGGER_RESPONSE))
TYPES.max_sequence_length = MAX_BEAMS

# rosbags makes its message classes at run time, so their types are not known to a type checker.
_MESSAGES: Mapping[str, Any] = TYPES.types
_NO_SPREAD = np.zeros(0, dtype=np.float32)
_UNKNOWN_COVARIANCE: NDArray[np.float64] = np.zeros(36, dtype=np.float64)


@dataclass(frozen=True, slots=True)
class Transform:
    """The pose of one frame in another, in the plane.

    Attributes:
        stamp: when it held, ns.
        parent: the frame in which the pose is given.
        child: the frame that is placed.
        x: metres.
        y: metres.
        qz: z component of the unit quaternion of the heading.
        qw: w component.
    """

    stamp: int
    parent: str
    child: str
    x: float
    y: float
    qz: float
    qw: float


def _encode(message: object, name: str) -> bytes:
    return bytes(TYPES.serialize_cdr(message, name))


def _decode(payload: bytes, name: str) -> Any:
    try:
        return TYPES.deserialize_cdr(payload, name)
    except Exception as error:
        # Whatever a hostile payload does inside the decoder, it is one thing to the caller: not this message.
        raise CodecError(f"not a {name}: {error or type(error).__name__}") from error


def _time(stamp: int) -> Any:
    seconds, nanoseconds = divmod(stamp, NANOSECONDS)
    if not 0 <= seconds < _MAX_SECONDS:
        raise CodecError(f"the stamp {stamp} ns does not fit into a ROS 2 time")
    return _MESSAGES["builtin_interfaces/msg/Time"](sec=seconds, nanosec=nanoseconds)


def _stamp(time: Any) -> int:
    return int(time.sec) * NANOSECONDS + int(time.nanosec)


def _header(stamp: int, frame: str) -> Any:
    return _MESSAGES["std_msgs/msg/Header"](stamp=_time(stamp), frame_id=frame)


def _vector(x: float, y: float, z: float) -> Any:
    return _MESSAGES["geometry_msgs/msg/Vector3"](x=x, y=y, z=z)


def _twist(twist: Twist) -> Any:
    return _MESSAGES[TWIST](linear=_vector(twist.forward, twist.left, 0.0), angular=_vector(0.0, 0.0, twist.turn))


def encode_scan(scan: Scan) -> bytes:
    """A scan as ``sensor_msgs/LaserScan`` in the frame ``laser``."""
    geometry = scan.geometry
    message = _MESSAGES[LASER_SCAN](
        header=_header(scan.stamp, LASER_FRAME),
        angle_min=geometry.angle_min,
        angle_max=geometry.angle_max,
        angle_increment=geometry.angle_increment,
        time_increment=0.0,
        scan_time=0.0,
        range_min=geometry.range_min,
        range_max=geometry.range_max,
        ranges=scan.ranges,
        intensities=_NO_SPREAD,
    )
    return _encode(message, LASER_SCAN)


def decode_scan(payload: bytes) -> Scan:
    """The scan in a ``sensor_msgs/LaserScan``; its ranges share the payload's memory and are read-only.

    Raises:
        CodecError: the payload is not such a message.
    """
    message = _decode(payload, LASER_SCAN)
    geometry = ScanGeometry(
        len(message.ranges), message.angle_min, message.angle_increment, message.range_min, message.range_max
    )
    return Scan(_stamp(message.header.stamp), geometry, message.ranges)


def encode_odometry(odometry: Odometry) -> bytes:
    """Odometry as ``nav_msgs/Odometry``: the pose of ``base_link`` in ``odom``, covariances unknown (zero)."""
    point = _MESSAGES["geometry_msgs/msg/Point"](x=odometry.x, y=odometry.y, z=0.0)
    orientation = _MESSAGES["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=odometry.qz, w=odometry.qw)
    pose = _MESSAGES["geometry_msgs/msg/Pose"](position=point, orientation=orientation)
    message = _MESSAGES[ODOMETRY](
        header=_header(odometry.stamp, ODOMETRY_FRAME),
        child_frame_id=BASE_FRAME,
        pose=_MESSAGES["geometry_msgs/msg/PoseWithCovariance"](pose=pose, covariance=_UNKNOWN_COVARIANCE),
        twist=_MESSAGES["geometry_msgs/msg/TwistWithCovariance"](
            twist=_twist(odometry.twist), covariance=_UNKNOWN_COVARIANCE
        ),
    )
    return _encode(message, ODOMETRY)


def decode_odometry(payload: bytes) -> Odometry:
    """The planar part of a ``nav_msgs/Odometry``.

    Raises:
        CodecError: the payload is not such a message.
    """
    message = _decode(payload, ODOMETRY)
    position, orientation = message.pose.pose.position, message.pose.pose.orientation
    return Odometry(
        _stamp(message.header.stamp),
        float(position.x),
        float(position.y),
        float(orientation.z),
        float(orientation.w),
        _read_twist(message.twist.twist),
    )


def encode_twist(twist: Twist) -> bytes:
    """A velocity as ``geometry_msgs/Twist``."""
    return _encode(_twist(twist), TWIST)


def decode_twist(payload: bytes) -> Twist:
    """The planar part of a ``geometry_msgs/Twist``.

    Raises:
        CodecError: the payload is not such a message.
    """
    return _read_twist(_decode(payload, TWIST))


def _read_twist(message: Any) -> Twist:
    return Twist(float(message.linear.x), float(message.linear.y), float(message.angular.z))


def encode_clock(stamp: int) -> bytes:
    """A time in ns as ``rosgraph_msgs/Clock``."""
    return _encode(_MESSAGES[CLOCK](clock=_time(stamp)), CLOCK)


def decode_clock(payload: bytes) -> int:
    """The time in a ``rosgraph_msgs/Clock``, ns.

    Raises:
        CodecError: the payload is not such a message.
    """
    return _stamp(_decode(payload, CLOCK).clock)


def encode_door_reply(reply: DoorReply) -> bytes:
    """The answer to a ring as the response of ``std_srvs/Trigger``."""
    return _encode(_MESSAGES[TRIGGER_RESPONSE](success=reply.accepted, message=reply.reason), TRIGGER_RESPONSE)


def decode_door_reply(payload: bytes) -> DoorReply:
    """The answer to a ring in a response of ``std_srvs/Trigger``.

    Raises:
        CodecError: the payload is not such a message.
    """
    message = _decode(payload, TRIGGER_RESPONSE)
    return DoorReply(bool(message.success), str(message.message))


def encode_text(text: str) -> bytes:
    """A text as ``std_msgs/String``."""
    return _encode(_MESSAGES[STRING](data=text), STRING)


def decode_text(payload: bytes) -> str:
    """The text in a ``std_msgs/String``.

    Raises:
        CodecError: the payload is not such a message.
    """
    return str(_decode(payload, STRING).data)


def encode_empty() -> bytes:
    """A ``std_msgs/Empty``, which is also the request of ``std_srvs/Trigger``."""
    return _encode(_MESSAGES[EMPTY](), EMPTY)


def encode_transforms(*transforms: Transform) -> bytes:
    """Poses of frames as ``tf2_msgs/TFMessage``."""
    stamped = [
        _MESSAGES["geometry_msgs/msg/TransformStamped"](
            header=_header(transform.stamp, transform.parent),
            child_frame_id=transform.child,
            transform=_MESSAGES["geometry_msgs/msg/Transform"](
                translation=_vector(transform.x, transform.y, 0.0),
                rotation=_MESSAGES["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=transform.qz, w=transform.qw),
            ),
        )
        for transform in transforms
    ]
    return _encode(_MESSAGES[TRANSFORMS](transforms=stamped), TRANSFORMS)


def type_hash(name: str) -> str:
    """The REP 2011 hash of a message type, as ``RIHS01_...``."""
    return str(TYPES.hash_rihs01(name))
