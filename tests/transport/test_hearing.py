"""What is said of a network on which a robot's topics are missed."""

from __future__ import annotations

import pytest

from transport.connect import open_robot
from transport.description import RobotDescription
from transport.hearing import Topic, heard_instead, topic_of
from transport.keys import RobotKeys
from transport.memory_bus import MemoryNetwork
from transport.robot import LinkError
from transport.settings import LinkSettings
from transport.side import RobotEndpoint

TOKEN = "@ros2_lv/3/abc/0/1/{}/%/%bot/driver/%bot%scan/sensor_msgs::msg::dds_::LaserScan_/RIHS01_00/::,1:,:,:,,"
SCAN, ODOMETRY = "sensor_msgs::msg::dds_::LaserScan_", "nav_msgs::msg::dds_::Odometry_"


@pytest.mark.parametrize(
    ("key", "topic"),
    [
        ("bot/scan", Topic("bridge", 0, "bot/scan")),
        ("scan", Topic("bridge", 0, "scan")),
        (f"3/bot/front/scan/{SCAN}/RIHS01_00", Topic("rmw_zenoh", 3, "bot/front/scan", SCAN)),
        (TOKEN.format("MP"), Topic("rmw_zenoh", 3, "bot/scan", SCAN)),
        (TOKEN.format("MS"), None),
        ("@ros2_lv/3/abc/0/0/NN/%/%bot/driver", None),
        ("@/abc/router", None),
        ("@ros2_lv/x/abc/0/1/MP/%/%/a/%scan/b/c/d", None),
    ],
)
def test_topics_are_read_from_keys_and_from_tokens_of_publishers(key: str, topic: Topic | None) -> None:
    assert topic_of(key) == topic


def said_of(there: list[str], keys: RobotKeys) -> str:
    """What is said of a network with these keys on it."""
    network = MemoryNetwork()
    talker = network.bus()

    class Talking:
        """While one listens, the others talk."""

        def wait(self, seconds: float) -> None:
            assert seconds == 1.0
            for key in there:
                talker.publisher(key).put(b"")

    network.clock = Talking()
    return heard_instead(network.bus(), keys)


@pytest.mark.parametrize(
    ("there", "told"),
    [
        ([], "there are no other topics"),
        (["bot/scan", "bot/odom"], "heard `bot/odom`, `bot/scan`; give --set robot.namespace=bot"),
        (["scan"], "heard `scan`; give --set robot.namespace="),
        (["camera/image"], "heard `camera/image`"),
        (["toy/front/scan", "toy/odom"], "; give --set link.scan=front/scan"),
        (
            ["bot/base/odom", "bot/front/scan"],
            "; give --set robot.namespace=bot --set link.scan=front/scan --set link.odometry=base/odom",
        ),
        (
            ["lidar/laser", "wheels/odometry"],
            "; give --set robot.namespace= --set link.scan=lidar/laser --set link.odometry=wheels/odometry",
        ),
        (["a/scan", "b/odom", "b/scan"], "; give --set robot.namespace=b"),
        (["b/laser"], "heard `b/laser`; give --set robot.namespace=b --set link.scan=laser"),
        (["toy/odom", "toy/scan"], "heard `toy/odom`, `toy/scan`"),
        ([f"3/toy/scan/{SCAN}/RIHS01_00"], f"`toy/scan` ({SCAN}); give --set link.keys=rmw_zenoh --set link.domain=3"),
        (
            [f"3/toy/front/{SCAN}/RIHS01_00", f"3/toy/wheels/{ODOMETRY}/RIHS01_00"],
            "; give --set link.keys=rmw_zenoh --set link.domain=3 --set link.scan=front --set link.odometry=wheels",
        ),
        ([f"t/{k:02}" for k in range(10)], "`t/07` and 2 more"),
    ],
)
def test_the_sentence_ends_with_the_settings_that_reach_the_scan(there: list[str], told: str) -> None:
    sentence = said_of(there, RobotKeys("toy", LinkSettings(gate=False)))
    assert sentence.startswith("listened on `toy/scan` and `toy/odom`; ")
    assert sentence.endswith(told)


@pytest.mark.parametrize(
    ("there", "told"),
    [
        ([], "there are no other topics"),
        (["toy/odom", "toy/scan"], "heard `toy/odom`, `toy/scan`; give --set link.gate=false"),
        (
            ["bot/odom", "bot/scan"],
            "; give --set robot.name=bot, or for a bare ROS 2 robot --set link.gate=false --set robot.namespace=bot",
        ),
        (["odom", "scan"], "; give --set link.gate=false --set robot.namespace="),
        (["bot/session"], "; the robot here is `bot`; give its profile with --robot, or --set robot.name=bot"),
        (
            ["bot/session", "bot/odom", "bot/scan"],
            "; the robot here is `bot`; give its profile with --robot, or --set robot.name=bot",
        ),
        (
            ["b/session", "a/session", "b/scan"],
            "; the robots here are `a`, `b`; give its profile with --robot, or --set robot.name=NAME",
        ),
        (["toy/odom", "toy/front"], "heard `toy/front`, `toy/odom`"),
        ([f"0/toy/scan/{SCAN}/RIHS01_00"], "; give --set link.keys=rmw_zenoh"),
    ],
)
def test_where_no_gate_answers_a_bare_robot_is_looked_for(there: list[str], told: str) -> None:
    sentence = said_of(there, RobotKeys("toy", LinkSettings()))
    assert sentence.startswith("asked for `toy/session`; ")
    assert sentence.endswith(told)


def test_a_robot_of_another_name_is_named() -> None:
    network = MemoryNetwork()
    endpoint = RobotEndpoint(network.bus(), RobotKeys("bot"), desk=None)  # type: ignore[arg-type]
    settings = LinkSettings(connect=0.05)
    with pytest.raises(LinkError, match=r"no robot named 'toy' answered .*; the robot here is `bot`; give its profile"):
        open_robot(network.bus(), RobotDescription(name="toy"), settings)
    assert not endpoint.dropped
