"""Messages on keys: the interface of a network, which an in-memory network can implement too."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import Generic, NamedTuple, Protocol, TypeVar

from transport.clock import Clock

T = TypeVar("T")

MAX_PAYLOAD = 1_000_000
"""Larger messages are dropped unread, bytes."""


class Message(NamedTuple):
    """One message from the network, not validated yet."""

    payload: bytes
    attachment: bytes = b""


class Reply(Protocol):
    """Sends the answer to a question."""

    def __call__(self, payload: bytes, attachment: bytes = b"") -> None:
        """Send it, with an attachment."""
        ...


@dataclass(frozen=True, slots=True)
class Request:
    """One question that waits for an answer.

    Attributes:
        payload: the question.
        reply: sends the answer; must be called at most once.
        attachment: the attachment of the question.
    """

    payload: bytes
    reply: Reply
    attachment: bytes = b""


class Mailbox(Generic[T]):
    """A bounded queue between a network's thread and the one thread that reads it.

    When it is full the oldest item is dropped, because in a control loop the newest counts.

    Attributes:
        dropped: how many items went unread.
    """

    def __init__(self, capacity: int = 64) -> None:
        self.dropped = 0
        self._capacity = capacity
        # Written in C: a wait costs a third of what one on a condition variable does.
        self._items: SimpleQueue[T] = SimpleQueue()

    def put(self, item: T) -> None:
        """Add an item; never waits."""
        if self._items.qsize() >= self._capacity and self.take() is not None:
            self.dropped += 1
        self._items.put(item)

    def take(self, timeout: float = 0.0) -> T | None:
        """The oldest item, or None if none came within ``timeout`` seconds."""
        try:
            return self._items.get(timeout > 0, timeout if timeout > 0 else None)
        except Empty:
            return None


SESSION = "session"
"""Last part of the key of a robot's session, which its side announces."""


class Publisher(Protocol):
    """Sends messages on one key."""

    def put(self, payload: bytes, attachment: bytes = b"") -> None:
        """Send a message; never waits for a reader, so a slow one misses messages."""
        ...


class Newest(Protocol):
    """The newest message on a key."""

    def take(self) -> Message | None:
        """The newest message since the last call, or None."""
        ...


class Bus(Protocol):
    """One participant's access to a network."""

    @property
    def identity(self) -> str:
        """A name that no other participant has."""
        ...

    def announce(self, token: str) -> None:
        """Declare a liveliness token while this participant exists."""
        ...

    def publisher(self, key: str, *, urgent: bool = False) -> Publisher:
        """A sender on ``key``; an urgent one's messages are not batched with others."""
        ...

    def subscribe(self, key: str, deliver: Callable[[Message], None]) -> None:
        """Call ``deliver`` with every message on ``key``, in the network's thread; often a mailbox's ``put``."""
        ...

    def newest(self, key: str) -> Newest:
        """Keep only the newest message on ``key``, however long the reader sleeps."""
        ...

    def serve(self, key: str, deliver: Callable[[Request], None]) -> None:
        """Call ``deliver`` with every question on ``key``, in the network's thread; often a mailbox's ``put``."""
        ...

    def ask(self, key: str, payload: bytes, timeout: float, attachment: bytes = b"") -> bytes | None:
        """Ask a question; return its answer, or None without one within ``timeout`` seconds."""
        ...

    def survey(self, seconds: float) -> set[str]:
        """The keys with messages within a time, and the liveliness tokens of ROS 2 and of robots' sides."""
        ...

    def close(self) -> None:
        """Release the network; a second call does nothing."""
        ...


def ask_until(
    bus: Bus, key: str, payload: bytes, timeout: float, clock: Clock, *, attempt: float = 0.5
) -> bytes | None:
    """Ask until there is an answer: a question that is sent before the other side is discovered is lost silently.

    Args:
        bus: the network.
        key: whom to ask.
        payload: the question, which must tolerate being asked twice.
        timeout: in total, s.
        clock: what time is measured on.
        attempt: how long to wait for one answer, s.
    """
    deadline = clock.now() + timeout
    while (left := deadline - clock.now()) > 0:
        began = clock.now()
        if (answer := bus.ask(key, payload, min(attempt, left))) is not None:
            return answer
        # Before discovery the answer "nobody" comes immediately.
        clock.wait(max(0.0, min(0.02 - (clock.now() - began), left)))
    return None
