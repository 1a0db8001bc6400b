"""Recordings from messages: our own tick by tick, and others sampled at the robot's period.

In a recording of ours every tick is a message, with what the machine did; its observations come out bit for bit,
whether or not the file still says what run it was. In any other one a tick is the data that a controller would have had
in each period: the newest scan and odometry received by then, with their ages. Its stamps begin at one period.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import Field, TypeAdapter, ValidationError

from transport import codec
from transport.description import Laser
from transport.messages import (
    NANOSECONDS,
    STOP,
    Command,
    DoorReply,
    LinkStatus,
    Navigation,
    Observation,
    Odometry,
    Pose,
    Scan,
    ScanGeometry,
    Twist,
)
from transport.recording.frames import mount_in
from transport.recording.messages import Messages, RecordedMessage, messages_of
from transport.recording.values import RecordedTick, Recording, RecordingError, Topics
from transport.sanity import ScanError, conformed, odometry_fault
from transport.wording import in_words, printable

MOST_BYTES = 1_000_000_000
"""The messages that are wanted are not longer than this together."""
MOST_TICKS = 1_000_000
"""A recording has no more ticks, more than a day at 10 Hz."""
GAP = 10 * NANOSECONDS
"""For this long a controller would have waited for the next message, ns."""
DEEPEST = 8
"""What a recorded step says is not nested deeper."""
PERIOD = 0.1
"""The robot's period if it is not given, s."""

T = TypeVar("T")
Stamp = Annotated[int, Field(ge=0, lt=2**63)]


@dataclass(frozen=True, slots=True)
class _Told:
    """What the text of a tick says."""

    stamp: Stamp
    link: LinkStatus
    ring: bool
    answers: Annotated[int, Field(ge=0, lt=2**63)]
    step: dict[str, Any]
    door: DoorReply | None = None
    goal: Pose | None = None
    navigation: Navigation | None = None


_TOLD = TypeAdapter(_Told)
_WORDS = TypeAdapter(list[str])


def read_recording(path: Path, topics: Topics = Topics(), *, period: float = PERIOD) -> Recording:  # noqa: B008 - frozen
    """Read a recorded run.

    Args:
        path: an MCAP file, a rosbag2 database or a rosbag2 folder.
        topics: which topics to read; what is None there is found.
        period: the period of the ticks of a foreign recording, s.

    Raises:
        RecordingError: the file cannot be read or is not a recording, or scan or odometry are missing in it.
    """
    try:
        source = messages_of(path)
        wanted = _Wanted(source)
        return _own(wanted) if wanted.ticks and topics == Topics() else _foreign(wanted, topics, period)
    except OSError as error:
        raise RecordingError(f"cannot read the recording {path}: {error.strerror or error}") from None
    except RecordingError as error:
        # Topics and types are names from a foreign file.
        raise RecordingError(printable(f"{path} {error}")) from None


class _Wanted:
    """The messages of a file that may be scans, odometry, commands, ticks or static transforms, in their order."""

    def __init__(self, source: Messages) -> None:
        self.messages: list[RecordedMessage] = []
        self.heard: dict[str, str] = {}
        left = MOST_BYTES
        for message in source:
            self.heard.setdefault(message.topic, message.kind)
            if message.kind in _KINDS and (message.kind != codec.TRANSFORMS or message.topic.endswith("tf_static")):
                left -= len(message.data)
                if left < 0:
                    raise RecordingError(f"has more than {MOST_BYTES // 1_000_000} MB of scans and odometry")
                self.messages.append(message)
        self.run, self.ending, self.complete = source.run, source.ending, source.complete
        if not self.heard:
            cut = "" if self.complete else ": it was cut off before the first chunk was written"
            raise RecordingError(f"holds no message{cut}")
        self.ticks = self._ticks()

    def of(self, *kinds: str) -> list[str]:
        """The topics with messages of these kinds."""
        return sorted(topic for topic, kind in self.heard.items() if kind in kinds)

    def _ticks(self) -> str:
        """The topic of our own ticks, or nothing."""
        beside = [topic for topic in self.of(codec.STRING) if topic.rpartition("/")[2] == "tick"]
        return next((topic for topic in beside if f"{topic.removesuffix('tick')}scan" in self.heard), "")


_KINDS = (codec.LASER_SCAN, codec.ODOMETRY, codec.TWIST, codec.TWIST_STAMPED, codec.STRING, codec.TRANSFORMS)


def _own(wanted: _Wanted) -> Recording:
    prefix = wanted.ticks.removesuffix("tick")
    ticks = tuple(_own_ticks(wanted, prefix))
    if not ticks:
        raise RecordingError("holds no tick")
    robot = wanted.run.get("robot") or prefix.strip("/") or "robot"
    topics = Topics(f"{prefix}scan", f"{prefix}odom", f"{prefix}cmd_vel")
    laser = ticks[0].observation.scan.geometry
    return Recording(
        robot,
        wanted.run,
        ticks,
        wanted.complete,
        own=True,
        topics=topics,
        laser=laser,
        heard=wanted.heard,
        ending=wanted.ending,
    )


def _own_ticks(wanted: _Wanted, prefix: str) -> Iterator[RecordedTick]:
    scan: Scan | None = None
    odometry: Odometry | None = None
    twist = STOP
    for message in wanted.messages:
        try:
            match message.topic.removeprefix(prefix):
                case "scan":
                    scan = codec.decode_scan(message.data)
                case "odom":
                    odometry = codec.decode_odometry(message.data)
                case "cmd_vel":
                    twist = codec.decode_twist(message.data)
                case "tick" if scan is not None and odometry is not None:
                    told = _told(codec.decode_text(message.data))
                    # A recording that begins at the time of day has all its stamps later by the same time.
                    later = message.stamp - told.stamp
                    seen = replace(scan, stamp=scan.stamp - later), replace(odometry, stamp=odometry.stamp - later)
                    observation = Observation(told.stamp, *seen, told.door, told.link, told.navigation)
                    yield RecordedTick(observation, Command(twist, told.ring, told.answers, told.goal), told.step)
        except codec.CodecError as error:
            raise RecordingError(f"is corrupt: {error}") from None


def _told(text: str) -> _Told:
    try:
        told = _TOLD.validate_python(json.loads(text))
        for name in ("states", "taken"):
            _WORDS.validate_python(told.step.get(name, []))
    except ValidationError as error:
        raise RecordingError(f"has an invalid tick: {in_words(error.errors()[0])}") from None
    except (ValueError, RecursionError) as error:
        raise RecordingError(f"has a tick that is not JSON: {type(error).__name__}") from None
    if _is_deeper(told.step, DEEPEST):
        raise RecordingError(f"has a tick that is nested deeper than {DEEPEST}")
    return told


def _is_deeper(value: object, levels: int) -> bool:
    if not isinstance(value, dict | list):
        return False
    inner = value.values() if isinstance(value, dict) else value
    return levels == 0 or any(_is_deeper(one, levels - 1) for one in inner)


class _Sensed:
    """The newest of each as the messages go by, as a controller would have taken them in, with when it came, ns.

    Attributes:
        laser: what the first scan says of its laser.
        skipped: how many messages could not be decoded or trusted.
    """

    def __init__(self, topics: Topics) -> None:
        self.laser: Laser | None = None
        self.skipped = 0
        self._topics = topics
        self._scan: tuple[int, Scan] | None = None
        self._odometry: tuple[int, Odometry] | None = None
        self._twist = STOP

    @property
    def lacks(self) -> str:
        """What has not come yet, or nothing."""
        return "scan" if self._scan is None else "odometry" if self._odometry is None else ""

    def take(self, message: RecordedMessage) -> None:
        """Take in a message of one of the topics."""
        try:
            if message.topic == self._topics.scan:
                scan = codec.decode_scan(message.data)
                self.laser = self.laser or _laser(scan.geometry)
                self._scan = message.stamp, conformed(scan, self.laser)
            elif message.topic == self._topics.odometry:
                odometry = codec.decode_odometry(message.data)
                if odometry_fault(odometry):
                    self.skipped += 1
                else:
                    self._odometry = message.stamp, odometry
            else:
                self._twist = _twist(message)
        except (codec.CodecError, ScanError):
            self.skipped += 1

    def tick(self, beat: int, stamp: int) -> RecordedTick:
        """The data of a controller at a time, ns, under another stamp."""
        assert self._scan is not None
        assert self._odometry is not None
        (heard, scan), (felt, odometry) = self._scan, self._odometry
        observation = Observation(
            stamp,
            replace(scan, stamp=max(stamp - (beat - heard), 0)),
            replace(odometry, stamp=max(stamp - (beat - felt), 0)),
            link=LinkStatus((beat - heard) / NANOSECONDS, (beat - felt) / NANOSECONDS),
        )
        return RecordedTick(observation, Command(self._twist))


def _laser(beams: ScanGeometry) -> Laser:
    """The laser of which a scan says this.

    Raises:
        RecordingError: there is no such laser.
    """
    ends = {"angle_min": beams.angle_min, "angle_max": beams.angle_max}
    try:
        return Laser.model_validate(
            {"beams": beams.beams, "range_min": beams.range_min, "range_max": beams.range_max, **ends}
        )
    except ValidationError as error:
        raise RecordingError(f"has scans of an impossible laser: {in_words(error.errors()[0])}") from None


def _twist(message: RecordedMessage) -> Twist:
    stamped = message.kind == codec.TWIST_STAMPED
    return codec.decode_twist_stamped(message.data) if stamped else codec.decode_twist(message.data)


def _foreign(wanted: _Wanted, asked: Topics, period: float) -> Recording:
    topics = Topics(
        _chosen(wanted, "scan", asked.scan, codec.LASER_SCAN),
        _chosen(wanted, "odometry", asked.odometry, codec.ODOMETRY),
        asked.command or next(iter(wanted.of(codec.TWIST, codec.TWIST_STAMPED)), None),
    )
    sensed = _Sensed(topics)
    ticks = list(_beats(wanted, topics, sensed, round(period * NANOSECONDS)))
    if sensed.lacks or not ticks or sensed.laser is None:
        kind = f"{sensed.lacks or 'scan'} that can be decoded and trusted"
        raise RecordingError(f"has no {kind}: {sensed.skipped} messages were skipped")
    robot = wanted.run.get("robot") or str(topics.scan).strip("/").rpartition("/")[0] or "robot"
    mount = mount_in(wanted.messages, str(topics.scan), str(topics.odometry))
    return Recording(
        robot, {}, ticks, wanted.complete, own=False, topics=topics, laser=sensed.laser.geometry(), mount=mount,
        skipped=sensed.skipped, heard=wanted.heard,
    )  # fmt: skip


def _chosen(wanted: _Wanted, what: str, asked: str | None, kind: str) -> str:
    """The topic for something: the one that is asked for, or the only one, or the one with the usual name."""
    found = wanted.of(kind)
    if asked is not None:
        if asked in found:
            return asked
        raise RecordingError(f"has no {kind} on `{asked}`; {_listed(wanted, found)}")
    usual = [topic for topic in found if topic.rpartition("/")[2] in ("scan", "odom")]
    for topics in (found, usual):
        if len(topics) == 1:
            return topics[0]
    if found:
        option = {"scan": "--scan", "odometry": "--odometry"}[what]
        raise RecordingError(f"has several topics for the {what}: name one with {option}; {_listed(wanted, found)}")
    raise RecordingError(f"has no {what} ({kind}); {_listed(wanted, found)}")


def _listed(wanted: _Wanted, found: Sequence[str]) -> str:
    shown = list(found) or sorted(wanted.heard)
    names = ", ".join(f"{topic[:80]} ({wanted.heard[topic][:60]})" for topic in shown[:12])
    return f"it has {names}{' and more' if len(shown) > 12 else ''}"


def _beats(wanted: _Wanted, topics: Topics, sensed: _Sensed, period: int) -> Iterator[RecordedTick]:
    """The tick of each period, from the first with scan and odometry to the last message.

    Where nothing was recorded for longer than `GAP`, the periods after that are left out.
    """
    named = {topics.scan, topics.odometry, topics.command}
    began = beat = last = -1
    count = 0
    for message in sorted(wanted.messages, key=lambda message: message.stamp):
        if message.topic not in named:
            continue
        bridged, last = min(message.stamp, last + GAP), message.stamp
        while 0 <= beat < bridged:
            yield sensed.tick(beat, beat - began + period)
            beat, count = beat + period, count + 1
            if count > MOST_TICKS:
                raise RecordingError(f"is longer than {MOST_TICKS} periods of {period / NANOSECONDS:g} s")
        if 0 <= beat < last:
            beat += -((beat - last) // period) * period
        sensed.take(message)
        if beat < 0 and not sensed.lacks:
            began = beat = last
    if 0 <= beat <= last:
        yield sensed.tick(beat, beat - began + period)
