"""A robot as ROS 2 shows it: topics for scan, odometry and velocity, a door bell; no lease, no command time-out."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from threading import Thread
from typing import Protocol, TypeVar

from transport.bus import Bus, Newest, Publisher
from transport.codec import (
    CodecError,
    decode_door_reply,
    decode_odometry,
    decode_scan,
    encode_empty,
    encode_twist,
    encode_twist_stamped,
)
from transport.hearing import heard_instead
from transport.keys import RobotKeys
from transport.messages import STOP, Command, DoorReply, Navigation, Odometry, Scan, Twist
from transport.navigation import Navigator
from transport.ros_graph import RosGraph, RosPublisher, RosSender

T = TypeVar("T")

DOOR_LIMIT = 2.0
"""Timeout for the door's answer, s."""


@dataclass(frozen=True, slots=True)
class Sensed:
    """The data since the last call; None if there is none."""

    scan: Scan | None = None
    odometry: Odometry | None = None
    door: DoorReply | None = None
    navigation: Navigation | None = None


class RobotDriver(Protocol):
    """The interface of a robot's driver over a network.

    Attributes:
        dropped: how many messages were dropped, by reason.
        stopped: the robot's side has stopped the base by itself.
        finished: a referee has ended the episode.
    """

    dropped: Counter[str]
    stopped: bool
    finished: bool

    def sense(self) -> Sensed:
        """The newest scan and odometry since the last call; never waits."""
        ...

    def drive(self, command: Command) -> None:
        """Send a command; never waits."""
        ...

    def heard(self) -> str:
        """The topics that exist if no data arrived, in words; empty if unknown. Takes a moment."""
        ...

    def report(self) -> Mapping[str, object]:
        """A referee's verdict so far; empty where there is none."""
        ...

    def close(self) -> None:
        """Stop the robot and release it; a second call does nothing."""
        ...


class RosDriver:
    """A bare ROS 2 driver behind a Zenoh bridge or rmw_zenoh.

    Attributes:
        dropped: how many messages were dropped, by reason.
        stopped: always false: a bare driver does not show.
        finished: always false: there is no referee.
    """

    def __init__(self, bus: Bus, keys: RobotKeys) -> None:
        self.dropped: Counter[str] = Counter()
        self.stopped = self.finished = False
        self._bus = bus
        self._scan, self._odometry = bus.newest(keys.scan), bus.newest(keys.odometry)
        self._publisher: Publisher = bus.publisher(keys.command, urgent=True)
        graph = RosGraph(bus, keys) if keys.settings.keys == "rmw_zenoh" else None
        if graph is not None:
            graph.subscriber(keys.scan)
            graph.subscriber(keys.odometry)
            self._publisher = RosPublisher(self._publisher, graph.publisher(keys.command))
        self._bell = _bell(bus, keys, graph)
        self._navigator = Navigator(bus, keys, graph)
        self._keys, self._answered = keys, 0
        self._unread = ""
        self._closed = False

    def sense(self) -> Sensed:
        """The newest scan and odometry since the last call."""
        return Sensed(
            self._take(self._scan, decode_scan),
            self._take(self._odometry, decode_odometry),
            self._bell.answer(),
            self._navigator.news(),
        )

    def drive(self, command: Command) -> None:
        """Send the velocity, or leave it to the robot's navigation, and ring where the command says so."""
        self._answered = command.answers
        self._navigator.pursue(command.goal)
        if command.goal is None:
            self.move(command.twist)
        if command.ring:
            self.ring()

    def move(self, twist: Twist) -> None:
        """Send a velocity."""
        stamped = self._keys.settings.command_type == "TwistStamped"
        self._publisher.put(encode_twist_stamped(twist, self._answered) if stamped else encode_twist(twist))

    def ring(self) -> None:
        """Ring at the door; the answer arrives with a later observation."""
        self._bell.ring()

    @property
    def listens(self) -> str:
        """Where scan and odometry are expected, for a person."""
        return f"listens on `{self._keys.scan}` and `{self._keys.odometry}`"

    def heard(self) -> str:
        """The subscribed keys, unreadable messages, and other topics on the network."""
        return self._unread or heard_instead(self._bus, self._keys)

    def report(self) -> Mapping[str, object]:
        """Empty: there is no referee."""
        return {}

    def close(self) -> None:
        """Send a stop and leave."""
        if not self._closed:
            self._closed = True
            try:
                self._navigator.close()
                self.move(STOP)
            finally:
                self._bus.close()

    def _take(self, newest: Newest, decode: Callable[[bytes], T]) -> T | None:
        message = newest.take()
        if message is None:
            return None
        try:
            return decode(message.payload)
        except CodecError as error:
            self.dropped["malformed"] += 1
            self._unread = f"received a message that cannot be read: {error}"
            return None


class Bell(Protocol):
    """The door bell of a ROS 2 robot."""

    def ring(self) -> None:
        """Ring; never waits."""
        ...

    def answer(self) -> DoorReply | None:
        """The answer, once."""
        ...


def _bell(bus: Bus, keys: RobotKeys, graph: RosGraph | None) -> Bell:
    if keys.settings.door_call == "message":
        publisher = bus.publisher(keys.door)
        return MessageBell(publisher if graph is None else RosPublisher(publisher, graph.publisher(keys.door)))
    if graph is None:
        return ServiceBell(bus, keys.door)
    return ServiceBell(bus, keys.door, RosSender(graph.client(keys.door)).attachment)


class MessageBell:
    """A bell that is rung by a plain message, without an answer."""

    def __init__(self, publisher: Publisher) -> None:
        self._publisher = publisher

    def ring(self) -> None:
        """Send the message."""
        self._publisher.put(encode_empty())

    def answer(self) -> DoorReply | None:
        """Nothing."""
        return None


class ServiceBell:
    """A bell that is rung by a service call, in a separate thread, so that it does not delay the loop.

    Args:
        bus: where the service answers.
        key: the service.
        attachment: makes what rides with a call.
    """

    def __init__(self, bus: Bus, key: str, attachment: Callable[[], bytes] = bytes) -> None:
        self._bus, self._key, self._attachment = bus, key, attachment
        self._answers: deque[DoorReply] = deque(maxlen=1)
        self._call: Thread | None = None

    def ring(self) -> None:
        """Call; while a call is under way, nothing more is done."""
        if self._call is None or not self._call.is_alive():
            self._call = Thread(target=self._ask, name="door bell", daemon=True)
            self._call.start()

    def answer(self) -> DoorReply | None:
        """The answer, once."""
        return self._answers.popleft() if self._answers else None

    def _ask(self) -> None:
        payload = self._bus.ask(self._key, encode_empty(), DOOR_LIMIT, self._attachment())
        try:
            reply = DoorReply(accepted=False, reason="no answer") if payload is None else decode_door_reply(payload)
        except CodecError as error:
            reply = DoorReply(accepted=False, reason=str(error))
        self._answers.append(reply)
