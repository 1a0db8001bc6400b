"""Keys and attachments as other programs lay them out."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from pydantic import ValidationError
from zenoh.ext import Int64, z_deserialize, z_serialize

from transport.envelope import rmw_attachment
from transport.keys import RobotKeys
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


@pytest.mark.parametrize("name", ["", "/pico", "pico/", "a//b", "1pico", "pico*", "pi co", "@x", "pico$1"])
def test_a_name_that_is_no_key_is_refused(name: str) -> None:
    with pytest.raises(ValueError, match="cannot be a robot's name"):
        RobotKeys(name)


def test_rmw_zenoh_goes_with_bare_drivers_only() -> None:
    with pytest.raises(ValidationError, match="bare drivers"):
        LinkSettings(keys="rmw_zenoh")


def test_rmw_zenohs_attachment_is_what_zenoh_itself_serialises() -> None:
    gid = bytes(range(16))
    parts = ("sequence_number", Int64(7), "source_timestamp", Int64(123_456_789_012), "source_gid", gid)
    attachment = rmw_attachment(7, 123_456_789_012, gid)
    assert attachment == b"".join(z_serialize(part).to_bytes() for part in parts)
    assert z_deserialize(tuple[str, Int64, str, Int64, str, bytes], z_serialize(parts)) == parts


def test_one_module_only_imports_zenoh() -> None:
    root = Path(__file__).parents[2]
    rooms = ("hsm", "perception", "skills", "machines", "transport", "sim", "controller", "view")
    sources = [path for room in rooms for path in (root / room).rglob("*.py")]
    importing = [
        path.name for path in sources if re.search(r"^\s*(import|from) zenoh\b", path.read_text(), re.MULTILINE)
    ]
    assert importing == ["zenoh_bus.py"]
