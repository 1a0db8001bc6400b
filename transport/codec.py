"""The wire format: messages as ROS 2 sends them, in CDR (little-endian, header ``00 01 00 00``).

A value that was encoded and decoded again has equal bits: what a ROS 2 message narrows (single precision ranges, the
quaternion of a heading), the values in :mod:`transport.messages` have narrowed already.

rosbags knows every message. The four that make up a tick have a layout of their own here, with the frame names that
this project sends, because through rosbags they take half as long again as the network does. With other frame names
they are read by rosbags. The tests hold these layouts against rosbags and against a third codec.

Sources: OMG DDSI-RTPS 2.5, section 10 (CDR encapsulation); the message definitions of ROS 2 Humble.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.interfaces.typing import Typesdict
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from transport.messages import NANOSECONDS, DoorReply, Odometry, Scan, ScanGeometry, Twist

LASER_SCAN = "sensor_msgs/msg/LaserScan"
ODOMETRY = "nav_msgs/msg/Odometry"
TWIST = "geometry_msgs/msg/Twist"
TWIST_STAMPED = "geometry_msgs/msg/TwistStamped"
CLOCK = "rosgraph_msgs/msg/Clock"
EMPTY = "std_msgs/msg/Empty"
STRING = "std_msgs/msg/String"
TRANSFORMS = "tf2_msgs/msg/TFMessage"
TRIGGER = "std_srvs/srv/Trigger"
TRIGGER_RESPONSE = "std_srvs/srv/Trigger_Response"

MAX_BEAMS = 100_000
"""The longest scan that is decoded; a longer one is malformed."""

LASER_FRAME = "laser"
ODOMETRY_FRAME = "odom"
BASE_FRAME = "base_link"

_MAX_SECONDS = 2**31
_UPRIGHT = 0.05
"""A rotation whose quaternion has larger x or y components is not about the vertical."""


class CodecError(ValueError):
    """A payload that is not the expected message."""


TYPES = get_typestore(Stores.ROS2_HUMBLE)
"""The ROS 2 message types, with the service ``std_srvs/Trigger`` added, which is hashed as a type of three parts."""


def _trigger() -> Typesdict:
    info, request, event = "service_msgs/msg/ServiceEventInfo", f"{TRIGGER}_Request", f"{TRIGGER}_Event"
    about = "uint8 event_type\nbuiltin_interfaces/Time stamp\nuint8[16] client_gid\nint64 sequence_number\n"

    def part(name: str) -> Any:
        return Nodetype.NAME, name

    def at_most_one(name: str) -> Any:
        return Nodetype.SEQUENCE, (part(name), 1)

    def basic(name: str) -> Any:
        return Nodetype.BASE, (name, 0)

    fields: dict[str, list[tuple[str, Any]]] = {
        request: [],
        TRIGGER_RESPONSE: [("success", basic("bool")), ("message", basic("string"))],
        event: [("info", part(info)), ("request", at_most_one(request)), ("response", at_most_one(TRIGGER_RESPONSE))],
        TRIGGER: [
            ("request_message", part(request)),
            ("response_message", part(TRIGGER_RESPONSE)),
            ("event_message", part(event)),
        ],
    }
    return get_types_from_msg(about, info) | {name: ([], listed) for name, listed in fields.items()}


TYPES.register(_trigger())
TYPES.max_sequence_length = MAX_BEAMS

# rosbags makes its message classes at run time, so their types are not known to a type checker.
MESSAGES: Mapping[str, Any] = TYPES.types


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


def encode_message(message: object, name: str) -> bytes:
    """A message of a type in CDR."""
    return bytes(TYPES.serialize_cdr(message, name))


def decode_message(payload: bytes, name: str) -> Any:
    """A message of a type from CDR.

    Raises:
        CodecError: the payload is not such a message.
    """
    try:
        return TYPES.deserialize_cdr(payload, name)
    except Exception as error:
        # Any error of the decoder means to the caller: not this message.
        raise CodecError(f"not a {name}: {error or type(error).__name__}") from error


def _split(stamp: int) -> tuple[int, int]:
    seconds, nanoseconds = divmod(stamp, NANOSECONDS)
    if not 0 <= seconds < _MAX_SECONDS:
        raise CodecError(f"the stamp {stamp} ns does not fit into a ROS 2 time")
    return seconds, nanoseconds


def time_of(stamp: int) -> Any:
    """A stamp in ns as ``builtin_interfaces/Time``.

    Raises:
        CodecError: it does not fit.
    """
    seconds, nanoseconds = _split(stamp)
    return MESSAGES["builtin_interfaces/msg/Time"](sec=seconds, nanosec=nanoseconds)


def _stamp(time: Any) -> int:
    return int(time.sec) * NANOSECONDS + int(time.nanosec)


def header(stamp: int, frame: str) -> Any:
    """A ``std_msgs/Header``.

    Raises:
        CodecError: the stamp does not fit.
    """
    return MESSAGES["std_msgs/msg/Header"](stamp=time_of(stamp), frame_id=frame)


def _vector(x: float, y: float, z: float) -> Any:
    return MESSAGES["geometry_msgs/msg/Vector3"](x=x, y=y, z=z)


_LITTLE_ENDIAN = b"\x00\x01\x00\x00"
# header (stamp, frame), seven single precision fields, the number of ranges; then the ranges and no intensities
_SCAN = struct.Struct("<4siII6s2x7fI")
_SHAPE = struct.Struct("<7fI")
_STAMP = struct.Struct("<4siI")
_SCAN_FRAME = struct.pack("<I6s2x", 6, b"laser")
_NO_INTENSITIES = bytes(4)
# header (stamp, frame), child frame, position, orientation, covariance, linear, angular, covariance
_ODOMETRY = struct.Struct("<4siII5s3xI10s6x7d288x6d288x")
_ODOMETRY_FRAMES = struct.pack("<I5s3xI10s6x", 5, b"odom", 10, b"base_link")
_TWIST = struct.Struct("<4s6d")


@lru_cache(maxsize=16)
def _geometry(shape: bytes) -> ScanGeometry:
    """The beams that a scan says that it has; a laser does not change from scan to scan."""
    first, _, increment, _, _, shortest, longest, beams = _SHAPE.unpack(shape)
    return ScanGeometry(beams, first, increment, shortest, longest)


def encode_scan(scan: Scan) -> bytes:
    """A scan as ``sensor_msgs/LaserScan`` in the frame ``laser``."""
    shape = scan.geometry
    angles = shape.angle_min, shape.angle_max, shape.angle_increment
    head = _SCAN.pack(
        _LITTLE_ENDIAN,
        *_split(scan.stamp),
        6,
        b"laser",
        *angles,
        0.0,
        0.0,
        shape.range_min,
        shape.range_max,
        shape.beams,
    )
    return head + scan.ranges.astype("<f4", copy=False).tobytes() + _NO_INTENSITIES


def decode_scan(payload: bytes) -> Scan:
    """The scan in a ``sensor_msgs/LaserScan``; its ranges share the payload's memory and are read-only.

    Raises:
        CodecError: the payload is not such a message.
    """
    if payload[:4] == _LITTLE_ENDIAN and payload[12:24] == _SCAN_FRAME and len(payload) >= _SCAN.size:
        geometry = _geometry(payload[_SCAN.size - _SHAPE.size : _SCAN.size])
        whole = len(payload) == _SCAN.size + 4 * geometry.beams + 4 and payload[-4:] == _NO_INTENSITIES
        if whole and geometry.beams <= MAX_BEAMS:
            ranges = np.frombuffer(payload, dtype=np.float32, count=geometry.beams, offset=_SCAN.size)
            _, seconds, rest = _STAMP.unpack_from(payload)
            return Scan(seconds * NANOSECONDS + rest, geometry, ranges)
    message = decode_message(payload, LASER_SCAN)
    geometry = ScanGeometry(
        len(message.ranges), message.angle_min, message.angle_increment, message.range_min, message.range_max
    )
    return Scan(_stamp(message.header.stamp), geometry, message.ranges)


def encode_odometry(odometry: Odometry) -> bytes:
    """Odometry as ``nav_msgs/Odometry``: the pose of ``base_link`` in ``odom``, covariances unknown (zero)."""
    twist = odometry.twist
    pose = odometry.x, odometry.y, 0.0, 0.0, 0.0, odometry.qz, odometry.qw
    frames = 5, b"odom", 10, b"base_link"
    velocity = twist.forward, twist.left, 0.0, 0.0, 0.0, twist.turn
    return _ODOMETRY.pack(_LITTLE_ENDIAN, *_split(odometry.stamp), *frames, *pose, *velocity)


def decode_odometry(payload: bytes) -> Odometry:
    """The planar part of a ``nav_msgs/Odometry``.

    Raises:
        CodecError: the payload is not such a message.
    """
    if payload[:4] == _LITTLE_ENDIAN and payload[12:44] == _ODOMETRY_FRAMES and len(payload) == _ODOMETRY.size:
        _, seconds, rest, _, _, _, _, x, y, _, _, _, qz, qw, *twist = _ODOMETRY.unpack(payload)
        forward, left, _, _, _, turn = twist
        return Odometry(seconds * NANOSECONDS + rest, x, y, qz, qw, Twist(forward, left, turn))
    message = decode_message(payload, ODOMETRY)
    position, orientation = message.pose.pose.position, message.pose.pose.orientation
    linear, angular = message.twist.twist.linear, message.twist.twist.angular
    return Odometry(
        _stamp(message.header.stamp),
        float(position.x),
        float(position.y),
        float(orientation.z),
        float(orientation.w),
        Twist(float(linear.x), float(linear.y), float(angular.z)),
    )


def encode_twist(twist: Twist) -> bytes:
    """A velocity as ``geometry_msgs/Twist``."""
    return _TWIST.pack(_LITTLE_ENDIAN, twist.forward, twist.left, 0.0, 0.0, 0.0, twist.turn)


def decode_twist(payload: bytes) -> Twist:
    """The planar part of a ``geometry_msgs/Twist``.

    Raises:
        CodecError: the payload is not such a message.
    """
    if payload[:4] == _LITTLE_ENDIAN and len(payload) == _TWIST.size:
        _, forward, left, _, _, _, turn = _TWIST.unpack(payload)
        return Twist(forward, left, turn)
    message = decode_message(payload, TWIST)
    return Twist(float(message.linear.x), float(message.linear.y), float(message.angular.z))


def encode_twist_stamped(twist: Twist, stamp: int) -> bytes:
    """A velocity as ``geometry_msgs/TwistStamped`` in the frame ``base_link``; a stamp that ROS cannot say is 0."""
    said = stamp if 0 <= stamp < _MAX_SECONDS * NANOSECONDS else 0
    velocity = MESSAGES[TWIST](_vector(twist.forward, twist.left, 0.0), _vector(0.0, 0.0, twist.turn))
    return encode_message(MESSAGES[TWIST_STAMPED](header(said, BASE_FRAME), velocity), TWIST_STAMPED)


def decode_twist_stamped(payload: bytes) -> Twist:
    """The planar part of a ``geometry_msgs/TwistStamped``.

    Raises:
        CodecError: the payload is not such a message.
    """
    twist = decode_message(payload, TWIST_STAMPED).twist
    return Twist(float(twist.linear.x), float(twist.linear.y), float(twist.angular.z))


def encode_clock(stamp: int) -> bytes:
    """A time in ns as ``rosgraph_msgs/Clock``."""
    return _STAMP.pack(_LITTLE_ENDIAN, *_split(stamp))


def decode_clock(payload: bytes) -> int:
    """The time in a ``rosgraph_msgs/Clock``, ns.

    Raises:
        CodecError: the payload is not such a message.
    """
    return _stamp(decode_message(payload, CLOCK).clock)


def encode_door_reply(reply: DoorReply) -> bytes:
    """The answer to a ring as the response of ``std_srvs/Trigger``."""
    return encode_message(MESSAGES[TRIGGER_RESPONSE](success=reply.accepted, message=reply.reason), TRIGGER_RESPONSE)


def decode_door_reply(payload: bytes) -> DoorReply:
    """The answer to a ring in a response of ``std_srvs/Trigger``.

    Raises:
        CodecError: the payload is not such a message.
    """
    message = decode_message(payload, TRIGGER_RESPONSE)
    return DoorReply(bool(message.success), str(message.message))


def encode_text(text: str) -> bytes:
    """A text as ``std_msgs/String``."""
    return encode_message(MESSAGES[STRING](data=text), STRING)


def decode_text(payload: bytes) -> str:
    """The text in a ``std_msgs/String``.

    Raises:
        CodecError: the payload is not such a message.
    """
    return str(decode_message(payload, STRING).data)


def encode_empty() -> bytes:
    """A ``std_msgs/Empty``, which is also the request of ``std_srvs/Trigger``."""
    return encode_message(MESSAGES[EMPTY](), EMPTY)


def encode_transforms(*transforms: Transform) -> bytes:
    """Poses of frames as ``tf2_msgs/TFMessage``."""
    stamped = [
        MESSAGES["geometry_msgs/msg/TransformStamped"](
            header=header(transform.stamp, transform.parent),
            child_frame_id=transform.child,
            transform=MESSAGES["geometry_msgs/msg/Transform"](
                translation=_vector(transform.x, transform.y, 0.0),
                rotation=MESSAGES["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=transform.qz, w=transform.qw),
            ),
        )
        for transform in transforms
    ]
    return encode_message(MESSAGES[TRANSFORMS](transforms=stamped), TRANSFORMS)


def decode_transforms(payload: bytes) -> tuple[Transform, ...]:
    """The poses of frames in a ``tf2_msgs/TFMessage``, as far as they are turned about the vertical only.

    Raises:
        CodecError: the payload is not such a message.
    """
    found = []
    for one in decode_message(payload, TRANSFORMS).transforms:
        place, turn = one.transform.translation, one.transform.rotation
        if max(abs(turn.x), abs(turn.y)) < _UPRIGHT:
            names = str(one.header.frame_id), str(one.child_frame_id)
            found.append(Transform(_stamp(one.header.stamp), *names, place.x, place.y, turn.z, turn.w))
    return tuple(found)


def frame_of(payload: bytes, name: str) -> str:
    """The frame in the header of a message of any type that has one.

    Raises:
        CodecError: the payload is not such a message.
    """
    return str(decode_message(payload, name).header.frame_id)


def child_frame_of(payload: bytes) -> str:
    """The frame whose pose a ``nav_msgs/Odometry`` gives.

    Raises:
        CodecError: the payload is not such a message.
    """
    return str(decode_message(payload, ODOMETRY).child_frame_id)


def type_hash(name: str) -> str:
    """The REP 2011 hash of a message's or a service's type, as ``RIHS01_...``."""
    return str(TYPES.hash_rihs01(name))
