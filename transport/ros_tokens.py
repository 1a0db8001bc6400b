"""The liveliness tokens by which rmw_zenoh shows the publishers, subscribers, clients and servers of a ROS graph."""

from __future__ import annotations

from typing import NamedTuple

SPACE = "@ros2_lv"
"""What the key of a token begins with."""


class TopicToken(NamedTuple):
    """What the token of a publisher, a subscriber, a client or a server says.

    Attributes:
        domain: the ROS domain.
        kind: ``MP`` of a publisher, ``MS`` of a subscriber, ``SC`` of a client, ``SS`` of a server.
        path: the topic's or the service's ROS name without its leading slash.
        dds_type: its type as DDS spells it.
        type_hash: the hash of its type.
    """

    domain: int
    kind: str
    path: str
    dds_type: str
    type_hash: str


def is_domain(text: str) -> bool:
    """Whether a part of a key is the number of a ROS domain."""
    return text.isdecimal() and len(text) <= 9


def topic_token(key: str) -> TopicToken | None:
    """The token that a key is; None for the token of a node and for any other key."""
    space, *parts = key.split("/")
    if space != SPACE or len(parts) < 11 or not is_domain(parts[0]):
        return None
    domain, _session, _node, _entity, kind, _enclave, _namespace, _name, topic, dds_type, type_hash, *_ = parts
    return TopicToken(int(domain), kind, topic.strip("%").replace("%", "/"), dds_type, type_hash)
