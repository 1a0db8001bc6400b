"""A robot behind a gate or a real-time simulator: commands have a lease and a time-out."""

from __future__ import annotations

import secrets
from collections import Counter
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import TypeVar

from transport.bus import Bus, Newest
from transport.clock import Clock, MonotonicClock
from transport.codec import CodecError, decode_odometry, decode_scan, encode_twist
from transport.driver import Sensed
from transport.envelope import CommandTag, ObservationTag
from transport.keys import RobotKeys
from transport.messages import STOP, Command, DoorReply
from transport.robot import LinkError
from transport.session import Granted, Open, Refused, ask_state, close_session, read_answer, written

T = TypeVar("T")


class LeasedDriver:
    """The controller's end of a lease in real time.

    A robot that the command time-out has stopped stays stopped until its controller sends a command to stand
    still, which takes the lease again.

    Attributes:
        dropped: how many messages were dropped, by reason.
        rejected: how many commands the robot's side says it has rejected.
        stopped: the robot does not obey: its command time-out has stopped it, or this controller has lost the lease.
        refusal: why the lease could not be taken again, or nothing.
        finished: the referee has ended the episode.
    """

    def __init__(self, bus: Bus, keys: RobotKeys, question: Open, granted: Granted, clock: Clock | None = None) -> None:
        self.dropped: Counter[str] = Counter()
        self.rejected = 0
        self.stopped = False
        self.refusal = ""
        self.finished = False
        self._bus, self._keys, self._question = bus, keys, question
        self._epoch, self._secret = granted.epoch, granted.secret
        self._clock = clock or MonotonicClock()
        self._sequence = 0
        self._closed = False
        self._seen: dict[str, tuple[int, int]] = {}
        self._gone: set[int] = set()
        self._rings: int | None = None
        self._door: DoorReply | None = None
        self._scan, self._odometry = bus.newest(keys.scan), bus.newest(keys.odometry)
        self._publisher = bus.publisher(keys.command, urgent=True)

    def sense(self) -> Sensed:
        """The newest scan and odometry since the last call."""
        odometry = self._take("odometry", self._odometry, decode_odometry)
        scan = self._take("scan", self._scan, decode_scan)
        door, self._door = self._door, None
        return Sensed(scan, odometry, door)

    def drive(self, command: Command) -> None:
        """Send a command under the lease; after a command time-out, one to stand still takes the lease again."""
        if self.stopped and command.twist == STOP:
            self._retake()
        payload = encode_twist(command.twist)
        self._sequence += 1
        tag = CommandTag(self._epoch, self._sequence, command.answers, command.ring)
        self._publisher.put(payload, tag.encode(payload, self._secret))

    def heard(self) -> str:
        """Nothing: the robot's side has answered but has no data."""
        return ""

    def report(self) -> Mapping[str, object]:
        """The referee's verdict so far; empty on hardware.

        Raises:
            LinkError: the robot's side no longer answers, or has given the lease up.
        """
        state = ask_state(self._bus, self._keys.namespace, self._secret, 2.0, self._clock)
        if not state.held:
            raise LinkError(f"{self._keys.namespace!r} ended the episode: {state.reason}")
        return state.report or {}

    def close(self) -> None:
        """Stop the robot and give it back."""
        if self._closed:
            return
        self._closed = True
        try:
            # Giving the lease back stops the base; should that not arrive, the command time-out does.
            with suppress(LinkError):
                close_session(self._bus, self._keys.namespace, self._secret, 1.0, self._clock)
        finally:
            self._bus.close()

    def _retake(self) -> None:
        # If only the answer was lost, the same question gets the same answer.
        if self._question.previous != self._secret:
            self._question = self._question.model_copy(
                update={"request": secrets.token_hex(8), "previous": self._secret}
            )
        # One short try a tick: a loop that waits for a lease does not watch its sensors.
        payload = self._bus.ask(self._keys.session, written(self._question), 0.05)
        if payload is None:
            return
        with suppress(CodecError):
            answer = read_answer(payload)
            if isinstance(answer, Granted):
                self._epoch, self._secret = answer.epoch, answer.secret
                self._sequence, self.stopped, self.refusal = 0, False, ""
            elif isinstance(answer, Refused):
                self.refusal = answer.reason

    def _take(self, name: str, newest: Newest, decode: Callable[[bytes], T]) -> T | None:
        message = newest.take()
        if message is None:
            return None
        try:
            tag = ObservationTag.decode(message.attachment, message.payload)
            value = decode(message.payload)
        except CodecError:
            self.dropped["malformed"] += 1
            return None
        if not self._in_order(name, tag):
            self.dropped["repeated"] += 1
            return None
        self._read(tag)
        return value

    def _in_order(self, name: str, tag: ObservationTag) -> bool:
        """Whether a message is newer than the last; a robot's side that was restarted counts from the beginning."""
        instance, sequence = self._seen.get(name, (tag.instance, -1))
        if tag.instance in self._gone or (tag.instance == instance and tag.sequence <= sequence):
            return False
        if tag.instance != instance:
            self._gone.add(instance)
        self._seen[name] = tag.instance, tag.sequence
        return True

    def _read(self, tag: ObservationTag) -> None:
        self.stopped = tag.stopped or tag.epoch != self._epoch
        self.rejected, self.finished = tag.rejected, tag.finished
        # An observation may be missed, so the answer rides with all that follow; its number shows a new one.
        if tag.door is not None and self._rings is not None and tag.rings != self._rings:
            self._door = tag.door
        self._rings = tag.rings
