"""The robot's side of the network: receives a controller's messages, and sends observations."""

from __future__ import annotations

from collections import Counter

from transport.bus import MAX_PAYLOAD, Bus, Mailbox, Message, Publisher, Request
from transport.codec import CodecError, decode_twist, encode_clock, encode_odometry, encode_scan
from transport.envelope import CommandTag, ObservationTag, is_signed, sealed
from transport.keys import RobotKeys
from transport.messages import Observation, Twist
from transport.session import SessionHandler, check_name, respond

TaggedCommand = tuple[CommandTag, Twist]
"""A command from the network; its receiver decides whether it is accepted."""


class RobotEndpoint:
    """Reads commands, answers questions, and publishes the robot's sensor data.

    Attributes:
        dropped: how many messages were dropped unread, by reason.
    """

    def __init__(self, bus: Bus, keys: RobotKeys, desk: SessionHandler) -> None:
        """Take part in a network.

        Args:
            bus: the network.
            keys: the robot's.
            desk: answers questions, within :meth:`take`.

        Raises:
            LinkError: there is a robot of this name already.
        """
        check_name(bus, keys.namespace)
        self.dropped: Counter[str] = Counter()
        self._desk = desk
        self._inbox: Mailbox[Message | Request] = Mailbox()
        self._odometry, self._scan = bus.publisher(keys.odometry, urgent=True), bus.publisher(keys.scan, urgent=True)
        self._clock = bus.publisher(keys.clock)
        self._shown: list[tuple[Publisher, bytes, bytes]] = []
        bus.subscribe(keys.command, self._inbox.put)
        bus.serve(keys.session, self._inbox.put)
        bus.announce(keys.session)

    def take(self, timeout: float = 0.0) -> TaggedCommand | None:
        """The next command that can be read, after all questions before it have been answered.

        Args:
            timeout: how long to wait for anything to come, s.
        """
        item = self._inbox.take(timeout)
        while item is not None:
            if isinstance(item, Message):
                if (order := self._read(item)) is not None:
                    return order
            else:
                answer, fault = respond(self._desk, item.payload)
                self.dropped.update([fault] if fault else [])
                item.reply(answer)
            item = self._inbox.take()
        return None

    def show(self, observation: Observation, tag: ObservationTag, since: Observation | None = None) -> None:
        """Send an observation, each part as soon as it is encoded: the network works meanwhile.

        Args:
            observation: what is sensed.
            tag: the attachment of each part.
            since: the last one shown; a reading that it holds already is not sent again, lest it looks like a new one.
        """
        self._shown.clear()
        attachment = tag.open()
        if since is None or since.odometry is not observation.odometry:
            self._send(self._odometry, encode_odometry(observation.odometry), attachment)
        if since is None or since.scan is not observation.scan:
            self._send(self._scan, encode_scan(observation.scan), attachment)
        self._send(self._clock, encode_clock(observation.stamp), attachment)

    def repeat(self) -> None:
        """Send the last observation again, unchanged."""
        for publisher, payload, attachment in self._shown:
            publisher.put(payload, attachment)

    def forget(self) -> None:
        """Forget the last observation."""
        self._shown.clear()

    def _send(self, publisher: Publisher, payload: bytes, attachment: bytes) -> None:
        attachment = sealed(attachment, payload)
        publisher.put(payload, attachment)
        self._shown.append((publisher, payload, attachment))

    def _read(self, message: Message) -> TaggedCommand | None:
        if len(message.payload) > MAX_PAYLOAD:
            self.dropped["oversized"] += 1
            return None
        try:
            tag, twist = CommandTag.decode(message.attachment, message.payload), decode_twist(message.payload)
        except CodecError:
            self.dropped["malformed"] += 1
            return None
        lease = self._desk.lease
        if tag.epoch == lease.epoch and not is_signed(message.attachment, message.payload, lease.secret):
            self.dropped["forged"] += 1
            return None
        return tag, twist
