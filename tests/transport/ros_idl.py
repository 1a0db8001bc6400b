"""The ROS 2 messages once more, declared for another codec (which reads annotations at run time)."""

from dataclasses import dataclass, field

from pycdr2 import IdlStruct
from pycdr2.types import array, float32, float64, int32, sequence, uint32


@dataclass
class Time(IdlStruct):
    sec: int32
    nanosec: uint32


@dataclass
class Clock(IdlStruct):
    clock: Time


@dataclass
class Header(IdlStruct):
    stamp: Time
    frame_id: str


@dataclass
class LaserScan(IdlStruct):
    header: Header
    angle_min: float32
    angle_max: float32
    angle_increment: float32
    time_increment: float32
    scan_time: float32
    range_min: float32
    range_max: float32
    ranges: sequence[float32]
    intensities: sequence[float32]


@dataclass
class Vector3(IdlStruct):
    x: float64
    y: float64
    z: float64


@dataclass
class Quaternion(IdlStruct):
    x: float64
    y: float64
    z: float64
    w: float64


@dataclass
class RosTwist(IdlStruct):
    linear: Vector3
    angular: Vector3


@dataclass
class RosPose(IdlStruct):
    position: Vector3
    orientation: Quaternion


@dataclass
class PoseWithCovariance(IdlStruct):
    pose: RosPose
    covariance: array[float64, 36] = field(default_factory=lambda: [0.0] * 36)


@dataclass
class RosTwistStamped(IdlStruct):
    header: Header
    twist: RosTwist


@dataclass
class TwistWithCovariance(IdlStruct):
    twist: RosTwist
    covariance: array[float64, 36] = field(default_factory=lambda: [0.0] * 36)


@dataclass
class RosOdometry(IdlStruct):
    header: Header
    child_frame_id: str
    pose: PoseWithCovariance
    twist: TwistWithCovariance


@dataclass
class TriggerResponse(IdlStruct):
    success: bool
    message: str


@dataclass
class RosTransform(IdlStruct):
    translation: Vector3
    rotation: Quaternion


@dataclass
class TransformStamped(IdlStruct):
    header: Header
    child_frame_id: str
    transform: RosTransform


@dataclass
class TFMessage(IdlStruct):
    transforms: sequence[TransformStamped]
