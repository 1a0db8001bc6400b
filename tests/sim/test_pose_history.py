"""The poses of a run, kept in little room."""

import pytest

from sim.pose_history import PoseHistory
from transport.messages import Pose

POSES = [Pose(0.1 * k, -0.2 * k, 0.3 * k) for k in range(5)]


def test_a_track_is_a_sequence_of_its_poses():
    track = PoseHistory()
    for pose in POSES:
        track.append(pose)
    assert list(track) == POSES
    assert track[-1] == POSES[-1]
    assert track[1:4:2] == POSES[1:4:2]
    assert len(track) == 5
    with pytest.raises(IndexError):
        track[5]


def test_an_empty_track_has_no_pose():
    with pytest.raises(IndexError):
        PoseHistory()[0]
