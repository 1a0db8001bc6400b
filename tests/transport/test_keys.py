"""Keys and attachments as other programs lay them out."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import zenoh
from pydantic import ValidationError
from zenoh.ext import Int64, z_deserialize, z_serialize

from transport.bus import Mailbox, Message, Request
from transport.codec import encode_door_reply
from transport.connect import dialling, listening
from transport.driver import RosDriver
from transport.keys import RobotKeys
from transport.messages import STOP, DoorReply
from transport.ros_graph import rmw_attachment, sender_id
from transport.settings import LinkSettings

RMW = LinkSettings(gate=False, keys="rmw_zenoh", door_call="message", domain=3)


def test_a_bridge_drops_the_leading_slash() -> None:
    keys = RobotKeys("pico1", LinkSettings(scan="/laser/front"))
    assert keys.scan == "pico1/laser/front"
    assert (keys.odometry, keys.command, keys.clock) == ("pico1/odom", "pico1/cmd_vel", "pico1/clock")


def test_rmw_zenoh_adds_domain_type_and_hash() -> None:
    assert RobotKeys("pico1", RMW).command == (
        "3/pico1/cmd_vel/geometry_msgs::msg::dds_::Twist_/"
        "RIHS01_9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a"
    )


@pytest.mark.parametrize("name", ["/pico", "pico/", "a//b", "1pico", "pico*", "pi co", "@x", "pico$1"])
def test_a_name_that_is_no_key_is_refused(name: str) -> None:
    with pytest.raises(ValueError, match="cannot be a robot's name"):
        RobotKeys(name)


def test_rmw_zenoh_goes_with_bare_drivers_only() -> None:
    assert not LinkSettings(keys="rmw_zenoh").gate
    with pytest.raises(ValidationError, match="`gate = false`"):
        LinkSettings(keys="rmw_zenoh", gate=True)


def test_the_door_is_a_service_under_the_hash_that_ros_computes_for_it() -> None:
    # From the ROS 2 Jazzy installation of std_srvs (Trigger.json).
    settings = RMW.model_copy(update={"door_call": "service"})
    assert RobotKeys("pico1", settings).door == (
        "3/pico1/open_door/std_srvs::srv::dds_::Trigger_/"
        "RIHS01_eeff2cd6fa5ad9d27cdf4dec64818317839b62f212a91e6b5304b634b2062c5f"
    )


def test_a_service_of_rmw_zenoh_is_called_as_its_own_clients_do(endpoint: str) -> None:
    keys = RobotKeys("pico1", RMW.model_copy(update={"door_call": "service"}))
    asked: Mailbox[Request] = Mailbox()
    with listening(endpoint) as robot, dialling(endpoint) as bus:
        robot.serve(keys.door, asked.put)
        driver = RosDriver(bus, keys)
        token = f"@ros2_lv/3/{bus.identity}/0/4/SC/%/%pico1/maze_machine/%pico1%open_door"
        token += f"/std_srvs::srv::dds_::Trigger_/{keys.door.rpartition('/')[2]}/::,10:,:,:,,"
        for number in (1, 2):
            driver.ring()
            while (request := asked.take(0.02)) is None:  # until the two have discovered each other
                driver.ring()
            # A request without fields still bears one byte in ROS 2.
            assert request.payload == bytes([0, 1, 0, 0, 0])
            sequence, sent, gid = z_deserialize(tuple[Int64, Int64, bytes], zenoh.ZBytes(request.attachment))
            assert sequence >= number
            assert sent > 0
            assert gid == sender_id(token)
            request.reply(encode_door_reply(DoorReply(number == 1, f"answer {number}")))
            while (answer := driver.sense().door) is None or answer.reason == "no answer":
                pass
            assert answer == DoorReply(number == 1, f"answer {number}")


def test_rmw_zenohs_attachment_is_what_zenoh_itself_serialises() -> None:
    gid = bytes(range(16))
    parts = (Int64(7), Int64(123_456_789_012), gid)
    attachment = rmw_attachment(7, 123_456_789_012, gid)
    assert len(attachment) == 33
    assert attachment == z_serialize(parts).to_bytes()
    assert z_deserialize(tuple[Int64, Int64, bytes], z_serialize(parts)) == parts


def test_rmw_zenohs_programs_see_a_node_its_topics_and_who_sends(endpoint: str) -> None:
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", f'["{endpoint}"]')
    with listening(endpoint) as robot, zenoh.open(config) as graph:
        told: Mailbox[Message] = Mailbox()
        keys = RobotKeys("pico1", RMW)
        robot.subscribe(keys.command, told.put)
        with dialling(endpoint) as bus:
            node = f"@ros2_lv/3/{bus.identity}/0/{{}}/%/%pico1/maze_machine"
            twist = "geometry_msgs::msg::dds_::Twist_/" + keys.command.rpartition("/")[2]
            command = node.format("3/MP") + f"/%pico1%cmd_vel/{twist}/::,1:,:,:,,"
            driver = RosDriver(bus, keys)
            while not (message := told.take(0.02)):  # until the two have discovered each other
                driver.move(STOP)
            assert message.attachment[-16:] == sender_id(command)
            tokens = {str(reply.ok.key_expr) for reply in graph.liveliness().get("@ros2_lv/3/**")}
            assert {node.format("0/NN"), command} < tokens
            subscribers = {token.split("/")[9] for token in tokens if "/MS/" in token}
            assert subscribers == {"%pico1%scan", "%pico1%odom"}
            assert len(tokens) == 5
        while list(graph.liveliness().get("@ros2_lv/3/**")):
            pass


def test_a_sender_is_named_by_the_hash_of_its_token() -> None:
    # The two halves of XXH3-128 of nothing, by its specification: 99aa06d3014798d8 and 6001c324468d497f.
    assert sender_id("") == bytes.fromhex("99aa06d3014798d86001c324468d497f")[::-1]


def test_one_module_only_imports_zenoh() -> None:
    root = Path(__file__).parents[2]
    rooms = ("hsm", "perception", "skills", "machines", "transport", "sim", "maze_machine")
    sources = [path for room in rooms for path in (root / room).rglob("*.py")]
    importing = [
        path.name for path in sources if re.search(r"^\s*(import|from) zenoh\b", path.read_text(), re.MULTILINE)
    ]
    assert importing == ["zenoh_bus.py"]
