"""Finds the topics on a network if a robot's own are missing, and the settings that would reach them."""

from __future__ import annotations

from typing import NamedTuple

from transport.bus import Bus
from transport.keys import RobotKeys

LISTENED = 1.0
"""How long to listen, s: a sensor sends several messages in that time."""
SHOWN = 8
"""This many keys are named at most."""


class Topic(NamedTuple):
    """A topic as its key shows it.

    Attributes:
        keys: how the key is laid out, as ``link.keys`` has it.
        domain: the ROS domain; 0 where the key does not say.
        path: the ROS name without its leading slash.
        kind: the type as DDS spells it; empty where the key does not say.
    """

    keys: str
    domain: int
    path: str
    kind: str = ""

    @property
    def shown(self) -> str:
        """For a person."""
        return f"`{self.path}`" + (f" ({self.kind})" if self.kind else "")


def topic_of(key: str) -> Topic | None:
    """The topic of a key or of a liveliness token of a publisher; None for what is neither."""
    parts = key.split("/")
    if parts[0] == "@ros2_lv":
        if len(parts) < 12 or parts[5] != "MP" or not parts[1].isdecimal():
            return None
        return Topic("rmw_zenoh", int(parts[1]), parts[9].strip("%").replace("%", "/"), parts[10])
    if len(parts) > 3 and parts[-1].startswith("RIHS01_") and parts[0].isdecimal():
        return Topic("rmw_zenoh", int(parts[0]), "/".join(parts[1:-2]), parts[-2])
    return None if key.startswith("@") else Topic("bridge", 0, key)


def heard_instead(bus: Bus, keys: RobotKeys) -> str:
    """One sentence: the keys where a robot's scan was expected, the topics that exist instead, and a suggestion.

    Args:
        bus: the network; it is listened to for a second.
        keys: where the robot was expected.
    """
    topics = sorted({topic for key in bus.survey(LISTENED) if (topic := topic_of(key)) is not None})
    listened = f"listened on `{keys.scan}` and `{keys.odometry}`"
    if not topics:
        return f"{listened}; there are no other topics"
    named = ", ".join(topic.shown for topic in topics[:SHOWN])
    more = f" and {len(topics) - SHOWN} more" if len(topics) > SHOWN else ""
    settings = _settings(topics, keys)
    way_out = f"; give {' '.join(f'--set {setting}' for setting in settings)}" if settings else ""
    return f"{listened}; heard {named}{more}{way_out}"


def _settings(topics: list[Topic], keys: RobotKeys) -> list[str]:
    """The settings with which the scan would be found, where one of the topics is called as it is."""
    name = keys.settings.scan.strip("/")
    found = [topic for topic in topics if topic.path == name or topic.path.endswith(f"/{name}")]
    if not found:
        return []
    topic, link = found[0], keys.settings
    namespace = topic.path.removesuffix(name).strip("/")
    wanted = [("link.keys", topic.keys, link.keys), ("robot.namespace", namespace, keys.namespace)]
    if topic.keys == "rmw_zenoh":
        wanted.append(("link.domain", str(topic.domain), str(link.domain)))
    return [f"{setting}={there}" for setting, there, here in wanted if there != here]
