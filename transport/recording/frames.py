"""Where the laser sits on the robot, by the static transforms of a recording."""

from __future__ import annotations

from collections.abc import Sequence

from transport import codec
from transport.arithmetic import atan2, cos_sin
from transport.messages import Pose, wrap_angle
from transport.recording.messages import RecordedMessage

MOST_FRAMES = 1_000
"""More transforms than this are not looked at."""


def mount_in(messages: Sequence[RecordedMessage], scan: str, odometry: str) -> Pose | None:
    """The pose of the scan's frame in the odometry's child frame, or None where no transforms lead there.

    Args:
        messages: of the recording.
        scan: the scans' topic.
        odometry: the odometry's topic.
    """
    try:
        laser = next(codec.frame_of(one.data, codec.LASER_SCAN) for one in messages if one.topic == scan)
        base = next(codec.child_frame_of(one.data) for one in messages if one.topic == odometry)
        static = [one.data for one in messages if one.kind == codec.TRANSFORMS][:MOST_FRAMES]
        transforms = [transform for data in static for transform in codec.decode_transforms(data)]
    except (codec.CodecError, StopIteration):
        return None
    return pose_of(laser, base, transforms[:MOST_FRAMES])


def pose_of(frame: str, reference: str, transforms: Sequence[codec.Transform]) -> Pose | None:
    """The pose of a frame in another one, through whatever transforms join them; None where none do.

    Args:
        frame: the frame that is sought.
        reference: the frame in which its pose is wanted.
        transforms: each the pose of a child in its parent.
    """
    poses = {_plain(reference): Pose()}
    while True:
        before = len(poses)
        for one in transforms:
            parent, child = _plain(one.parent), _plain(one.child)
            pose = Pose(one.x, one.y, 2 * atan2(one.qz, one.qw))
            if parent in poses and child not in poses:
                poses[child] = placed(pose, poses[parent])
            elif child in poses and parent not in poses:
                poses[parent] = placed(inverse(pose), poses[child])
        if _plain(frame) in poses or len(poses) == before:
            return poses.get(_plain(frame))


def placed(pose: Pose, frame: Pose) -> Pose:
    """A pose that is given in a frame, where that frame's own pose is given."""
    cos, sin = cos_sin(frame.heading)
    x, y = frame.x + cos * pose.x - sin * pose.y, frame.y + sin * pose.x + cos * pose.y
    return Pose(x, y, wrap_angle(frame.heading + pose.heading))


def inverse(pose: Pose) -> Pose:
    """The pose of the frame in what is placed in it."""
    cos, sin = cos_sin(pose.heading)
    return Pose(-cos * pose.x - sin * pose.y, sin * pose.x - cos * pose.y, -pose.heading)


def _plain(frame: str) -> str:
    """A frame's name without the slash that older tools put before it."""
    return frame.lstrip("/")
