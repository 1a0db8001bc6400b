"""The wire format: equal bits after a round trip, and the bytes of an independent codec."""

from __future__ import annotations

import contextlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from ros_idl import (
    Clock,
    Header,
    LaserScan,
    PoseWithCovariance,
    Quaternion,
    RosOdometry,
    RosPose,
    RosTransform,
    RosTwist,
    RosTwistStamped,
    TFMessage,
    Time,
    TransformStamped,
    TriggerResponse,
    TwistWithCovariance,
    Vector3,
)

from transport import codec
from transport.messages import DoorReply, Odometry, Pose, Scan, ScanGeometry, Twist

numbers = st.floats(allow_nan=False, width=64)
singles = st.floats(width=32)
stamps = st.integers(0, 2**31 * 10**9 - 1)
twists = st.builds(Twist, numbers, numbers, numbers)
odometries = st.builds(Odometry, stamps, numbers, numbers, numbers, numbers, twists)
finite = st.floats(-100, 100, width=32)


@st.composite
def scans(draw: st.DrawFn) -> Scan:
    ranges = np.array(draw(st.lists(singles, min_size=0, max_size=30)), dtype=np.float32)
    geometry = ScanGeometry(len(ranges), draw(finite), draw(finite), draw(finite), draw(finite))
    return Scan(draw(stamps), geometry, ranges)


def _header(stamp: int, frame: str) -> Header:
    return Header(Time(*divmod(stamp, 10**9)), frame)


def _twist(twist: Twist) -> RosTwist:
    return RosTwist(Vector3(twist.forward, twist.left, 0.0), Vector3(0.0, 0.0, twist.turn))


@settings(max_examples=80, deadline=None, derandomize=True)
@given(scans())
def test_a_scan_is_the_same_bits_and_the_same_bytes_elsewhere(scan: Scan) -> None:
    payload = codec.encode_scan(scan)
    back = codec.decode_scan(payload)
    assert (back.stamp, back.geometry) == (scan.stamp, scan.geometry)
    assert back.ranges.dtype == np.float32
    assert back.ranges.tobytes() == scan.ranges.tobytes()
    g = scan.geometry
    angles = (g.angle_min, float(np.float32(g.angle_max)), g.angle_increment)
    limits = (0.0, 0.0, g.range_min, g.range_max)
    other = LaserScan(_header(scan.stamp, "laser"), *angles, *limits, scan.ranges.tolist(), [])
    assert np.isnan(scan.ranges).any() or payload == other.serialize()


@settings(max_examples=80, deadline=None, derandomize=True)
@given(odometries)
def test_odometry_is_the_same_bits_and_the_same_bytes_elsewhere(odometry: Odometry) -> None:
    payload = codec.encode_odometry(odometry)
    assert codec.decode_odometry(payload) == odometry
    pose = RosPose(Vector3(odometry.x, odometry.y, 0.0), Quaternion(0.0, 0.0, odometry.qz, odometry.qw))
    other = RosOdometry(
        _header(odometry.stamp, "odom"),
        "base_link",
        PoseWithCovariance(pose),
        TwistWithCovariance(_twist(odometry.twist)),
    )
    assert payload == other.serialize()


@settings(max_examples=80, deadline=None, derandomize=True)
@given(twists, stamps, st.booleans(), st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=40))
def test_the_small_messages_are_the_same_bytes_elsewhere(twist: Twist, stamp: int, accepted: bool, text: str) -> None:
    assert codec.decode_twist(codec.encode_twist(twist)) == twist
    assert codec.encode_twist(twist) == _twist(twist).serialize()
    assert codec.decode_clock(codec.encode_clock(stamp)) == stamp
    assert codec.encode_clock(stamp) == Clock(Time(*divmod(stamp, 10**9))).serialize()
    reply = DoorReply(accepted, text)
    assert codec.decode_door_reply(codec.encode_door_reply(reply)) == reply
    assert codec.encode_door_reply(reply) == TriggerResponse(accepted, text).serialize()
    assert codec.decode_text(codec.encode_text(text)) == text


def test_a_transform_is_the_same_bytes_elsewhere() -> None:
    transform = codec.Transform(1_500_000_000, "odom", "base_link", 1.0, -2.0, 0.6, 0.8)
    placed = RosTransform(Vector3(1.0, -2.0, 0.0), Quaternion(0.0, 0.0, 0.6, 0.8))
    other = TFMessage([TransformStamped(_header(transform.stamp, "odom"), "base_link", placed)])
    assert codec.encode_transforms(transform) == other.serialize()


def test_signed_zero_and_infinity_survive() -> None:
    odometry = Odometry(0, -0.0, float("inf"), 0.0, 1.0)
    back = codec.decode_odometry(codec.encode_odometry(odometry))
    assert str(back.x) == "-0.0"
    assert back.y == float("inf")


def test_the_header_is_little_endian_cdr() -> None:
    assert codec.encode_twist(Twist())[:4] == b"\x00\x01\x00\x00"


DECODERS = [codec.decode_scan, codec.decode_odometry, codec.decode_twist, codec.decode_clock, codec.decode_door_reply]


@pytest.mark.parametrize("decode", DECODERS)
@settings(max_examples=150, deadline=None, derandomize=True)
@given(payload=st.binary(max_size=120) | st.binary(max_size=120).map(lambda rest: b"\x00\x01\x00\x00" + rest))
def test_rubbish_is_a_codec_error_or_a_value(decode: object, payload: bytes) -> None:
    with contextlib.suppress(codec.CodecError):
        decode(payload)


@pytest.mark.parametrize("cut", [0, 3, 4, 10, 400])
def test_a_cut_message_is_a_codec_error(cut: int) -> None:
    whole = codec.encode_odometry(Odometry.at(1, Pose(1, 2, 0.3)))
    with pytest.raises(codec.CodecError, match="Odometry"):
        codec.decode_odometry(whole[:cut])


def test_a_scan_that_claims_to_be_endless_is_refused() -> None:
    empty = codec.encode_scan(Scan(0, ScanGeometry(0, 0, 0, 0, 0), np.zeros(0, np.float32)))
    claim = empty[:-8] + (2**31).to_bytes(4, "little") + empty[-4:]
    with pytest.raises(codec.CodecError):
        codec.decode_scan(claim)


def test_a_stamp_outside_ros_time_is_refused() -> None:
    with pytest.raises(codec.CodecError, match="stamp"):
        codec.encode_clock(-1)


def test_the_type_hash_is_the_one_that_ros_computes() -> None:
    # From the ROS 2 Iron installation of geometry_msgs (Twist.json).
    assert codec.type_hash(codec.TWIST) == "RIHS01_9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a"


def test_messages_in_other_frames_are_read_as_well() -> None:
    scan = LaserScan(
        _header(7, "base_laser_link"), -1.0, 1.0, 1.0, 0.0, 0.0, 0.5, 4.0, [1.0, 2.0, 3.0], [9.0, 9.0, 9.0]
    )
    back = codec.decode_scan(scan.serialize())
    assert (back.stamp, back.geometry) == (7, ScanGeometry(3, -1.0, 1.0, 0.5, 4.0))
    assert back.ranges.tolist() == [1.0, 2.0, 3.0]
    pose = RosPose(Vector3(1.0, 2.0, 0.0), Quaternion(0.0, 0.0, 0.6, 0.8))
    twist = TwistWithCovariance(_twist(Twist(0.1, 0.2, 0.3)), [1.0] * 36)
    odometry = RosOdometry(_header(7, "world"), "footprint", PoseWithCovariance(pose, [2.0] * 36), twist)
    expected = Odometry(7, 1.0, 2.0, 0.6, 0.8, Twist(0.1, 0.2, 0.3))
    assert codec.decode_odometry(odometry.serialize()) == expected
    # The frames of this project, but covariances: still the same values.
    known = RosOdometry(_header(7, "odom"), "base_link", PoseWithCovariance(pose, [2.0] * 36), twist)
    assert codec.decode_odometry(known.serialize()) == expected
    intense = LaserScan(_header(7, "laser"), -1.0, 1.0, 1.0, 0.0, 0.0, 0.5, 4.0, [1.0, 2.0, 3.0], [9.0, 9.0, 9.0])
    assert codec.decode_scan(intense.serialize()).ranges.tolist() == [1.0, 2.0, 3.0]


@settings(max_examples=40, deadline=None, derandomize=True)
@given(scans(), odometries)
def test_rosbags_reads_what_is_laid_out_here_and_writes_the_same(scan: Scan, odometry: Odometry) -> None:
    for payload, kind in (
        (codec.encode_scan(scan), codec.LASER_SCAN),
        (codec.encode_odometry(odometry), codec.ODOMETRY),
        (codec.encode_twist(odometry.twist), codec.TWIST),
    ):
        message = codec.TYPES.deserialize_cdr(payload, kind)
        assert bytes(codec.TYPES.serialize_cdr(message, kind)) == payload


@settings(max_examples=40, deadline=None, derandomize=True)
@given(twists, stamps)
def test_a_stamped_velocity_is_the_same_bits_and_the_same_bytes_elsewhere(twist: Twist, stamp: int) -> None:
    payload = codec.encode_twist_stamped(twist, stamp)
    assert codec.decode_twist_stamped(payload) == twist
    assert payload == RosTwistStamped(_header(stamp, "base_link"), _twist(twist)).serialize()


@pytest.mark.parametrize("stamp", [-1, 2**31 * 10**9])
def test_a_stamp_that_ros_cannot_say_is_zero(stamp: int) -> None:
    assert codec.encode_twist_stamped(Twist(0.1), stamp) == codec.encode_twist_stamped(Twist(0.1), 0)
