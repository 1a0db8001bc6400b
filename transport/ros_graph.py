"""Announces a program in the ROS graph of rmw_zenoh: liveliness tokens under ``@ros2_lv/``.

A token is a key that is there for as long as the session that declared it. It reads
``@ros2_lv/DOMAIN/SESSION/NODE/ENTITY/KIND/ENCLAVE/NAMESPACE/NAME``, and for a publisher, subscriber or client further
``/TOPIC/TYPE/HASH/QUALITY``; ROS names have ``%`` for ``/`` in it. ``docs/reference/link.md`` says more.
"""

from __future__ import annotations

import struct
import time

import xxhash

from transport.bus import Bus, Publisher
from transport.keys import RobotKeys
from transport.ros_tokens import SPACE

NODE = "maze_machine"
"""The name of a controller's node, in the robot's namespace."""

# Only what differs from the default (reliable, volatile, keep the last 42) is named: the newest one only; best effort;
# ten, as ROS has it for services.
_COMMANDS, _SENSORS, _SERVICES = "::,1:,:,:,,", "2::,1:,:,:,,", "::,10:,:,:,,"


class RosGraph:
    """A node as the programs of rmw_zenoh know it.

    Args:
        bus: the network.
        keys: the robot's, whose namespace is the node's too.
        name: the node's name.
    """

    def __init__(self, bus: Bus, keys: RobotKeys, name: str = NODE) -> None:
        self._bus, self._entities, self._name = bus, 0, name
        self._domain, self._namespace = keys.settings.domain, f"/{keys.namespace}"
        self._announce("NN")

    def subscriber(self, key: str) -> None:
        """The node listens on a key."""
        self._announce("MS", key, _SENSORS)

    def publisher(self, key: str) -> bytes:
        """The node speaks on a key; the answer are the 16 bytes that name the publisher in its messages."""
        return sender_id(self._announce("MP", key, _COMMANDS))

    def client(self, key: str) -> bytes:
        """The node calls the service on a key; the answer are the 16 bytes that name it in its calls."""
        return sender_id(self._announce("SC", key, _SERVICES))

    def server(self, key: str) -> None:
        """The node answers calls of the service on a key."""
        self._announce("SS", key, _SERVICES)

    def _announce(self, kind: str, key: str = "", quality: str = "") -> str:
        node = (
            self._bus.identity,
            "0",
            str(self._entities),
            kind,
            _mangled("/"),
            _mangled(self._namespace),
            self._name,
        )
        self._entities += 1
        parts = [SPACE, str(self._domain), *node]
        if key:
            _domain, *topic, dds_type, type_hash = key.split("/")
            parts += [_mangled("/" + "/".join(topic)), dds_type, type_hash, quality]
        token = "/".join(parts)
        self._bus.announce(token)
        return token


class RosSender:
    """Counts the messages of one publisher or client, and makes their attachments.

    Args:
        gid: 16 bytes that name the sender.
    """

    def __init__(self, gid: bytes) -> None:
        self._gid, self._sent = gid, 0

    def attachment(self) -> bytes:
        """The attachment of the next message."""
        self._sent += 1
        return rmw_attachment(self._sent, time.time_ns(), self._gid)


class RosPublisher:
    """A publisher of messages with the attachment of rmw_zenoh.

    Args:
        publisher: sends on the topic's key.
        gid: 16 bytes that name the sender.
    """

    def __init__(self, publisher: Publisher, gid: bytes) -> None:
        self._publisher, self._sender = publisher, RosSender(gid)

    def put(self, payload: bytes, attachment: bytes = b"") -> None:
        """Send a message; its attachment is made here."""
        del attachment
        self._publisher.put(payload, self._sender.attachment())


def rmw_attachment(sequence: int, sent: int, gid: bytes) -> bytes:
    """The attachment of a message of rmw_zenoh 0.6 or later (Jazzy, Kilted, Rolling), in zenoh's own serialisation.

    Args:
        sequence: number of the message, from 1.
        sent: when it was sent, ns.
        gid: 16 bytes that name the sender.
    """
    return struct.pack("<qqB", sequence, sent, len(gid)) + gid


def sender_id(token: str) -> bytes:
    """The 16 bytes that name a publisher: XXH3-128 of its token, the low half first."""
    return xxhash.xxh3_128(token.encode()).intdigest().to_bytes(16, "little")


def _mangled(name: str) -> str:
    return name.replace("/", "%")
