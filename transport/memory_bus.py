"""A network within one process: the same bus without sockets, for tests and for reproducible faults."""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Callable, Iterable

from transport.bus import Message, Request
from transport.clock import Clock, MonotonicClock
from transport.robot import LinkError

_LOOK = 0.001
"""Between two looks for an answer, s."""

DeliveryFault = Callable[[str, Message], Iterable[Message]]
"""The result of sending one message on a key: nothing, the same, another, or several messages."""


def faultless(_key: str, message: Message) -> Iterable[Message]:
    """Every message arrives once, as it was."""
    return (message,)


class MemoryNetwork:
    """Connects the buses of one process.

    Attributes:
        fault: what happens to a message on its way; may be exchanged at any time.
        tokens: what those who are there have announced.
        said: the keys on which anything was said.
    """

    def __init__(self, fault: DeliveryFault = faultless, clock: Clock | None = None) -> None:
        self.fault = fault
        self.clock = clock or MonotonicClock()
        self.tokens: set[str] = set()
        self.said: set[str] = set()
        self._subscribers: dict[str, list[Callable[[Message], None]]] = defaultdict(list)
        self._servers: dict[str, list[Callable[[Request], None]]] = defaultdict(list)

    def bus(self) -> MemoryBus:
        """One more participant."""
        return MemoryBus(self)

    def put(self, key: str, message: Message) -> None:
        """Deliver a message to all subscribers."""
        self.said.add(key)
        for arriving in self.fault(key, message):
            for deliver in tuple(self._subscribers[key]):
                deliver(arriving)

    def subscribe(self, key: str, deliver: Callable[[Message], None]) -> Callable[[], None]:
        """Add a subscriber; returns a function that removes it."""
        self._subscribers[key].append(deliver)
        return lambda: self._subscribers[key].remove(deliver)

    def serve(self, key: str, deliver: Callable[[Request], None]) -> Callable[[], None]:
        """Add a server of questions; returns a function that removes it."""
        self._servers[key].append(deliver)
        return lambda: self._servers[key].remove(deliver)

    def servers(self, key: str) -> tuple[Callable[[Request], None], ...]:
        """Who answers on a key."""
        return tuple(self._servers[key])


class MemoryBus:
    """One participant."""

    def __init__(self, network: MemoryNetwork) -> None:
        self._network = network
        self.identity = f"{id(self):x}"
        self._leave: list[Callable[[], None]] = []
        self._closed = False

    def announce(self, token: str) -> None:
        """Add a token to the network's until this bus is closed."""
        self._network.tokens.add(token)
        self._leave.append(lambda: self._network.tokens.discard(token))

    def publisher(self, key: str, *, urgent: bool = False) -> MemoryPublisher:
        """A sender on ``key``; in memory every message is urgent."""
        del urgent
        return MemoryPublisher(lambda message: self._put(key, message))

    def subscribe(self, key: str, deliver: Callable[[Message], None]) -> None:
        """Subscribe to ``key``; messages are delivered in the sender's thread."""
        self._leave.append(self._network.subscribe(key, deliver))

    def newest(self, key: str) -> MemoryNewest:
        """Keep only the newest message on ``key``."""
        slot: deque[Message] = deque(maxlen=1)
        self.subscribe(key, slot.append)
        return MemoryNewest(slot)

    def serve(self, key: str, deliver: Callable[[Request], None]) -> None:
        """Serve ``key``; questions are delivered in the asker's thread."""
        self._leave.append(self._network.serve(key, deliver))

    def ask(self, key: str, payload: bytes, timeout: float, attachment: bytes = b"") -> bytes | None:
        """One question and its first answer."""
        clock, answers = self._network.clock, deque[bytes]()
        for deliver in self._network.servers(key):
            deliver(Request(payload, lambda answer, attachment=b"": answers.append(answer), attachment))
        deadline = clock.now() + timeout
        while not answers and self._network.servers(key) and clock.now() < deadline:
            clock.wait(_LOOK)
        return answers[0] if answers else None

    def survey(self, seconds: float) -> set[str]:
        """The keys on which anything is said within a time, and the tokens that are there."""
        self._network.said.clear()
        self._network.clock.wait(seconds)
        return self._network.said | self._network.tokens

    def close(self) -> None:
        """Leave the network."""
        self._closed = True
        while self._leave:
            self._leave.pop()()

    def _put(self, key: str, message: Message) -> None:
        if self._closed:
            raise LinkError("cannot send: the bus is closed")
        self._network.put(key, message)


class MemoryPublisher:
    """A sender on one key."""

    def __init__(self, send: Callable[[Message], None]) -> None:
        self._send = send

    def put(self, payload: bytes, attachment: bytes = b"") -> None:
        """Send a message."""
        self._send(Message(payload, attachment))


class MemoryNewest:
    """The newest message on one key."""

    def __init__(self, slot: deque[Message]) -> None:
        self._slot = slot

    def take(self) -> Message | None:
        """The newest message since the last call, or None."""
        try:
            return self._slot.popleft()
        except IndexError:
            return None
