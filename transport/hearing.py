"""Finds the topics on a network if a robot's own are missing, and the settings that would reach them."""

from __future__ import annotations

from itertools import takewhile
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


def _is_domain(text: str) -> bool:
    """Whether a part of a key is the number of a ROS domain."""
    return text.isdecimal() and len(text) <= 9


def topic_of(key: str) -> Topic | None:
    """The topic of a key or of a liveliness token of a publisher; None for what is neither."""
    parts = key.split("/")
    if parts[0] == "@ros2_lv":
        if len(parts) < 12 or parts[5] != "MP" or not _is_domain(parts[1]):
            return None
        return Topic("rmw_zenoh", int(parts[1]), parts[9].strip("%").replace("%", "/"), parts[10])
    if len(parts) > 3 and parts[-1].startswith("RIHS01_") and _is_domain(parts[0]):
        return Topic("rmw_zenoh", int(parts[0]), "/".join(parts[1:-2]), parts[-2])
    return None if key.startswith("@") else Topic("bridge", 0, key)


def heard_instead(bus: Bus, keys: RobotKeys) -> str:
    """One sentence: the keys where a robot was expected, the topics that exist instead, and a suggestion.

    Args:
        bus: the network; it is listened to for a second.
        keys: where the robot was expected.
    """
    topics = sorted({topic for key in bus.survey(LISTENED) if (topic := topic_of(key)) is not None})
    listened = f"listened on `{keys.scan}` and `{keys.odometry}`"
    if keys.settings.gate:
        listened = f"asked for `{keys.session}`"
    if not topics:
        return f"{listened}; there are no other topics"
    named = ", ".join(topic.shown for topic in topics[:SHOWN])
    more = f" and {len(topics) - SHOWN} more" if len(topics) > SHOWN else ""
    settings = _settings(topics, keys)
    way_out = "" if settings is None else _way_out(settings, keys)
    return f"{listened}; heard {named}{more}{way_out}"


def _way_out(settings: list[str], keys: RobotKeys) -> str:
    """What to give. Behind a missing gate may be a bare robot, or another robot's gate, whose topics look alike."""
    if keys.settings.gate and not any(setting.startswith("link.keys=") for setting in settings):
        bare = " ".join(f"--set {setting}" for setting in ("link.gate=false", *settings))
        name = settings[0].removeprefix("robot.namespace=") if len(settings) == 1 else ""
        return f"; give --set robot.name={name}, or for a bare ROS 2 robot {bare}" if name else f"; give {bare}"
    return f"; give {' '.join(f'--set {setting}' for setting in settings)}" if settings else ""


def _settings(topics: list[Topic], keys: RobotKeys) -> list[str] | None:
    """The settings with which scan and odometry would be found, where topics are called or typed as theirs are."""
    own = keys.settings.scan.strip("/"), keys.settings.odometry.strip("/")
    scans = _like(topics, own[0], "LaserScan_", ("scan", "laser"))
    odometries = _like(topics, own[1], "Odometry_", ("odom",))
    found = [
        (scan, _names(scan.path, odometry.path, own))
        for scan in scans
        for odometry in odometries or [scan._replace(path=f"{_above(scan.path, own[0])}/{own[1]}".strip("/"))]
        if scan[:2] == odometry[:2]
    ]
    if not found:
        return None
    scan, (namespace, *names) = min(found, key=lambda one: one[1][1:] != own)
    wanted = [("link.keys", scan.keys, keys.settings.keys), ("robot.namespace", namespace, keys.namespace)]
    if scan.keys == "rmw_zenoh":
        wanted.append(("link.domain", str(scan.domain), str(keys.settings.domain)))
    wanted += zip(("link.scan", "link.odometry"), names, own, strict=True)
    return [f"{setting}={there}" for setting, there, here in wanted if there != here]


def _like(topics: list[Topic], name: str, kind: str, words: tuple[str, ...]) -> list[Topic]:
    """The topics with a name, below any namespace; if none, those of its type, or with a word in their last part."""
    named = [topic for topic in topics if f"/{topic.path}".endswith(f"/{name}")]
    return named or [
        topic
        for topic in topics
        if (topic.kind.endswith(kind) if topic.kind else any(word in topic.path.split("/")[-1] for word in words))
    ]


def _above(path: str, name: str) -> str:
    """What is above a name in a path; above its last part where it ends with another name."""
    return path.removesuffix(name).strip("/") if f"/{path}".endswith(f"/{name}") else path.rpartition("/")[0]


def _names(scan: str, odometry: str, own: tuple[str, str]) -> tuple[str, str, str]:
    """The namespace of a scan and an odometry, and their names below it: their own names where they fit."""
    namespace = _above(scan, own[0])
    if tuple(f"{namespace}/{name}".strip("/") for name in own) == (scan, odometry):
        return namespace, *own
    above = scan.split("/")[:-1], odometry.split("/")[:-1]
    shared = [part for part, _ in takewhile(lambda both: both[0] == both[1], zip(*above, strict=False))]
    start = len("/".join([*shared, ""]))
    return "/".join(shared), scan[start:], odometry[start:]
