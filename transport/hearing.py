"""Finds the topics on a network if a robot's own are missing, and the settings that would reach them."""

from __future__ import annotations

from itertools import takewhile
from typing import NamedTuple

from transport.bus import SESSION, Bus
from transport.keys import RobotKeys
from transport.ros_tokens import is_domain, topic_token
from transport.wording import printable

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
    token = topic_token(key)
    if token is not None:
        return Topic("rmw_zenoh", token.domain, token.path, token.dds_type) if token.kind == "MP" else None
    parts = key.split("/")
    if len(parts) > 3 and parts[-1].startswith("RIHS01_") and is_domain(parts[0]):
        return Topic("rmw_zenoh", int(parts[0]), "/".join(parts[1:-2]), parts[-2])
    return None if key.startswith("@") or key.endswith(f"/{SESSION}") else Topic("bridge", 0, key)


def heard_instead(bus: Bus, keys: RobotKeys) -> str:
    """One sentence: the keys where a robot was expected, the robots or topics that exist instead, and a suggestion.

    Args:
        bus: the network; it is listened to for a second.
        keys: where the robot was expected.
    """
    heard = bus.survey(LISTENED)
    robots = {key.removesuffix(f"/{SESSION}") for key in heard if key.endswith(f"/{SESSION}")}
    topics = sorted({topic for key in heard if (topic := topic_of(key)) is not None})
    listened = f"listened on `{keys.scan}` and `{keys.odometry}`"
    if keys.settings.gate:
        listened = f"asked for `{keys.session}`"
        if robots:
            return f"{listened}; {_named(sorted(printable(name) for name in robots))}"
    if not topics:
        return f"{listened}; there are no other topics"
    named = ", ".join(topic.shown for topic in topics[:SHOWN])
    more = f" and {len(topics) - SHOWN} more" if len(topics) > SHOWN else ""
    settings = _settings(topics, keys)
    way_out = "" if settings is None else _way_out(settings, keys)
    return f"{listened}; heard {named}{more}{way_out}"


def _named(robots: list[str]) -> str:
    """The robots that answer on the network, and what to give to take one."""
    more = f" and {len(robots) - SHOWN} more" if len(robots) > SHOWN else ""
    shown = ", ".join(f"`{name}`" for name in robots[:SHOWN])
    here = f"the robot here is {shown}" if len(robots) == 1 else f"the robots here are {shown}{more}"
    return f"{here}; give its profile with --robot, or --set robot.name={robots[0] if len(robots) == 1 else 'NAME'}"


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
