"""A base shown as a bare ROS 2 robot: topics and a door, without leases; it obeys every sender."""

from __future__ import annotations

import logging
import math
import struct
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress

from transport.bus import Bus, Mailbox, Message, Publisher, Request
from transport.clock import Clock, MonotonicClock
from transport.codec import (
    CodecError,
    decode_twist,
    decode_twist_stamped,
    encode_clock,
    encode_door_reply,
    encode_odometry,
    encode_scan,
)
from transport.gate import GatedBase
from transport.keys import RobotKeys
from transport.messages import STOP, Observation, Twist
from transport.ros_graph import RosGraph, RosPublisher, rmw_attachment
from transport.session import Open

_LOG = logging.getLogger(__name__)
_REQUEST = struct.Struct("<qqB")
_NODE = "simulator"


class RosRobot:
    """Publishes a base's sensor data, and drives it by any command.

    Like a hardware driver it stops the base if no command has arrived for ``link.dead_man``. An episode begins with
    the first command to move, and again with the first one after the referee has ended it.

    Attributes:
        dropped: how many messages were dropped, by reason.
    """

    def __init__(self, bus: Bus, base: GatedBase, keys: RobotKeys, clock: Clock | None = None) -> None:
        self.dropped: Counter[str] = Counter()
        self._base, self._settings, self._time = base, keys.settings, clock or MonotonicClock()
        self._inbox: Mailbox[Message | Request] = Mailbox()
        self._rung: list[Request] = []
        self._last: Observation | None = None
        self._twist, self._heard, self._driven = STOP, -math.inf, False
        graph = RosGraph(bus, keys, _NODE) if keys.settings.keys == "rmw_zenoh" else None
        self._scan, self._odometry, self._clock = (
            _publisher(bus, key, graph) for key in (keys.scan, keys.odometry, keys.clock)
        )
        if graph is not None:
            graph.subscriber(keys.command)
        bus.subscribe(keys.command, self._inbox.put)
        if self._settings.door_call == "service":
            bus.serve(keys.door, self._inbox.put)
            if graph is not None:
                graph.server(keys.door)
        else:
            bus.subscribe(keys.door, lambda message: self._inbox.put(Request(message.payload, _nobody)))
            if graph is not None:
                graph.subscriber(keys.door)

    def episodes(
        self, stop: Callable[[], bool] = lambda: False, *, heartbeat: float = 0.1, forsaken: float = math.inf
    ) -> Iterator[Mapping[str, object]]:
        """Serve; yields the referee's verdict on each episode in which the base was commanded to move.

        However it ends, the base is left stopped.

        Args:
            stop: returns whether to end; called at least every ``heartbeat`` seconds.
            heartbeat: s.
            forsaken: an episode ends without commands for this long, s.
        """
        self._begin()
        try:
            while not stop():
                report = self.pump(heartbeat, forsaken)
                if report is not None:
                    yield report
        finally:
            self._base.move(STOP)

    def pump(self, wait: float = 0.0, forsaken: float = math.inf) -> Mapping[str, object] | None:
        """Do all that is due, waiting at most this long (s) for it; the verdict of an episode that is over, or None."""
        item = self._inbox.take(min(max(self._base.due(), 0.0), wait))
        while item is not None:
            self._take(item)
            item = self._inbox.take()
        silent = self._time.now() - self._heard
        if silent > self._settings.dead_man and self._twist != STOP:
            self._twist = STOP
            self._base.move(STOP)
        if (observation := self._base.sense()) is not None:
            self._show(observation)
        if not self._base.finished and not (self._driven and silent > forsaken):
            return None
        report = self._base.report() if self._driven else None
        self._base.end()
        self._begin()
        return report

    def _begin(self) -> None:
        self._twist, self._driven = STOP, False
        self._base.begin(Open(request="", controller=""))

    def _take(self, item: Message | Request) -> None:
        if isinstance(item, Request):
            self._rung.append(item)
            self._base.ring()
            return
        decode = decode_twist_stamped if self._settings.command_type == "TwistStamped" else decode_twist
        try:
            twist = decode(item.payload)
        except CodecError as error:
            if not self.dropped["malformed"]:
                _LOG.warning("a command that cannot be read was dropped: %s", error)
            self.dropped["malformed"] += 1
            return
        if not all(map(math.isfinite, (twist.forward, twist.left, twist.turn))):
            self.dropped["not finite"] += 1
            return
        self._obey(twist)

    def _obey(self, twist: Twist) -> None:
        self._heard = self._time.now()
        self._driven = self._driven or twist != STOP
        self._twist = twist
        self._base.move(twist)

    def _show(self, observation: Observation) -> None:
        last, self._last = self._last, observation
        # A reading that has been published is not published again: it would look like a new one.
        if last is None or last.odometry is not observation.odometry:
            self._odometry.put(encode_odometry(observation.odometry))
        if last is None or last.scan is not observation.scan:
            self._scan.put(encode_scan(observation.scan))
        self._clock.put(encode_clock(observation.stamp))
        if observation.door is not None:
            for request in self._rung:
                request.reply(encode_door_reply(observation.door), _answer_to(request))
            self._rung.clear()


def _publisher(bus: Bus, key: str, graph: RosGraph | None) -> Publisher:
    publisher = bus.publisher(key, urgent=True)
    return publisher if graph is None else RosPublisher(publisher, graph.publisher(key))


def _answer_to(request: Request) -> bytes:
    """The attachment of the answer to a call of rmw_zenoh: the call's number and sender, and the current time."""
    with suppress(struct.error):
        sequence, _, length = _REQUEST.unpack_from(request.attachment)
        return rmw_attachment(sequence, time.time_ns(), request.attachment[_REQUEST.size :][:length])
    return b""


def _nobody(payload: bytes, attachment: bytes = b"") -> None:
    """A ring by message has no answer."""
    del payload, attachment
