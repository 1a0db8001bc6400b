"""Zenoh as the bus; the one module that imports it.

The robot's side or a router listens and the controller connects. There is no scouting: only the endpoints define the
connections.
"""

from __future__ import annotations

import contextlib
import json
import time
from collections import Counter
from collections.abc import Callable, Mapping
from typing import Literal

import zenoh

from transport.bus import MAX_PAYLOAD, SESSION, Message, Request
from transport.endpoints import check_endpoint
from transport.robot import LinkError

Role = Literal["peer", "client", "router"]

_HANDSHAKE = 1.0
"""How long one attempt to connect may take, s. Closing a session waits for it if the other side is frozen."""
_RETRY = {"period_init_ms": 50, "period_max_ms": 200, "period_increase_factor": 2}


def session_settings(
    role: Role,
    *,
    listen: str | None = None,
    connect: str | None = None,
    security: Mapping[str, object] | None = None,
    wait: float = 5.0,
    lease: float = 0.5,
) -> dict[str, object]:
    """The session's configuration, by the paths of Zenoh's own configuration file.

    Args:
        role: how the session takes part; a connecting one is a client, and finds listening peers as well as routers.
        listen: the endpoint to be reached at, such as ``tcp/127.0.0.1:7447``.
        connect: the endpoint to connect to.
        security: further settings for TLS and access control.
        wait: timeout for connecting, s; a lost connection is retried for ever.
        lease: after how long without any sign a connection counts as lost, s.

    Raises:
        EndpointError: an endpoint is not written as one.
    """
    return {
        "mode": role,
        "listen/endpoints": [check_endpoint(listen)] if listen is not None else [],
        "connect/endpoints": [check_endpoint(connect)] if connect is not None else [],
        "listen/exit_on_failure": True,
        "connect/exit_on_failure": True,
        "connect/timeout_ms": round(1000 * wait),
        "connect/retry": _RETRY,
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "scouting/delay": 0,
        # No gain at these sizes, and a killed process leaves its files behind.
        "transport/shared_memory/enabled": False,
        "transport/unicast/open_timeout": round(1000 * min(wait, _HANDSHAKE)),
        "transport/link/tx/lease": round(1000 * lease),
        **(security or {}),
    }


class ZenohBus:
    """One Zenoh session.

    Attributes:
        dropped: how many messages were dropped before anybody read them, by reason.
    """

    def __init__(self, configuration: Mapping[str, object]) -> None:
        """Open the session.

        Raises:
            LinkError: the endpoint to listen at is taken, or there is no answer at the one to connect to.
        """
        self.dropped: Counter[str] = Counter()
        config = zenoh.Config()
        try:
            for path, value in configuration.items():
                config.insert_json5(path, json.dumps(value))
            self._session = zenoh.open(config)
        except zenoh.ZError as error:
            raise LinkError(_explain(error, configuration)) from None
        # Keep references, since Zenoh undeclares unreferenced objects.
        self._declared: list[object] = []

    @property
    def identity(self) -> str:
        """The session's identifier."""
        return str(self._session.zid())

    def announce(self, token: str) -> None:
        """Declare a liveliness token; it goes with the session, and comes again with a connection that was lost."""
        self._declared.append(self._session.liveliness().declare_token(token))

    def publisher(self, key: str, *, urgent: bool = False) -> ZenohPublisher:
        """A sender on ``key``; it drops messages instead of waiting for a stopped reader."""
        return ZenohPublisher(
            self._session.declare_publisher(
                key,
                congestion_control=zenoh.CongestionControl.DROP,
                express=urgent,
            )
        )

    def subscribe(self, key: str, deliver: Callable[[Message], None]) -> None:
        """Subscribe to ``key``; messages are delivered in Zenoh's thread."""

        def receive(sample: zenoh.Sample) -> None:
            if (message := self._read(sample)) is not None:
                deliver(message)

        self._declared.append(self._session.declare_subscriber(key, receive))

    def newest(self, key: str) -> ZenohNewest:
        """Keep only the newest message on ``key``; the ring is Zenoh's own, so it holds also while Python hangs."""
        ring: zenoh.handlers.RingChannel[zenoh.Sample] = zenoh.handlers.RingChannel(1)
        subscriber = self._session.declare_subscriber(key, ring)
        self._declared.append(subscriber)
        return ZenohNewest(subscriber.try_recv, self._read)

    def serve(self, key: str, deliver: Callable[[Request], None]) -> None:
        """Serve ``key``; questions are delivered in Zenoh's thread."""

        def receive(query: zenoh.Query) -> None:
            message = self._read(query)
            if message is None:
                return

            def reply(payload: bytes, attachment: bytes = b"") -> None:
                # An asker that has gone needs no answer.
                with contextlib.suppress(zenoh.ZError):
                    query.reply(query.key_expr, payload, attachment=attachment or None)
                query.drop()  # type: ignore[no-untyped-call]

            deliver(Request(message.payload, reply, message.attachment))

        # Clients of rmw_zenoh ask only complete queryables.
        self._declared.append(self._session.declare_queryable(key, receive, complete=True))

    def ask(self, key: str, payload: bytes, timeout: float, attachment: bytes = b"") -> bytes | None:
        """One question and its first answer."""
        try:
            for reply in self._session.get(key, payload=payload, attachment=attachment or None, timeout=timeout):
                if reply.ok is None:
                    continue
                if len(reply.ok.payload) <= MAX_PAYLOAD:
                    return reply.ok.payload.to_bytes()
                self.dropped["oversized"] += 1
        except zenoh.ZError:
            pass
        return None

    def survey(self, seconds: float) -> set[str]:
        """The keys with messages within a time, and the liveliness tokens of ROS 2 and of robots' sides."""
        heard: set[str] = set()
        subscriber = self._session.declare_subscriber("**", lambda sample: heard.add(str(sample.key_expr)))
        try:
            for tokens in ("@ros2_lv/**", f"**/{SESSION}"):
                for reply in self._session.liveliness().get(tokens, timeout=seconds):
                    if reply.ok is not None:
                        heard.add(str(reply.ok.key_expr))
            time.sleep(seconds)
        finally:
            subscriber.undeclare()  # type: ignore[no-untyped-call]
        return heard

    def close(self) -> None:
        """Close the session: without it, a process with a callback never exits."""
        if not self._session.is_closed():
            self._session.close()  # type: ignore[no-untyped-call]
        self._declared.clear()

    def _read(self, sample: zenoh.Sample | zenoh.Query) -> Message | None:
        payload, attachment = sample.payload, sample.attachment
        message = Message(
            b"" if payload is None else payload.to_bytes(), b"" if attachment is None else attachment.to_bytes()
        )
        if len(message.payload) + len(message.attachment) > MAX_PAYLOAD:
            self.dropped["oversized"] += 1
            return None
        return message


class ZenohPublisher:
    """A sender on one key."""

    def __init__(self, publisher: zenoh.Publisher) -> None:
        self._publisher = publisher

    def put(self, payload: bytes, attachment: bytes = b"") -> None:
        """Send a message.

        Raises:
            LinkError: the session was closed.
        """
        try:
            self._publisher.put(payload, attachment=attachment or None)
        except zenoh.ZError as error:
            raise LinkError(f"cannot send: {error}") from None


class ZenohNewest:
    """The newest message on one key."""

    def __init__(
        self, receive: Callable[[], zenoh.Sample | None], read: Callable[[zenoh.Sample], Message | None]
    ) -> None:
        self._receive, self._read = receive, read

    def take(self) -> Message | None:
        """The newest message since the last call, or None."""
        sample = self._receive()
        return None if sample is None else self._read(sample)


def _explain(error: zenoh.ZError, configuration: Mapping[str, object]) -> str:
    listen, connect = configuration.get("listen/endpoints"), configuration.get("connect/endpoints")
    place = ", ".join([*(listen if isinstance(listen, list) else []), *(connect if isinstance(connect, list) else [])])
    text = str(error)
    refusals = {"98": "is taken by another program: stop it, or choose another port"}
    refusals |= {"99": "is not an address of this computer", "13": "needs more rights than this user has"}
    for number, words in refusals.items():
        if f"os error {number})" in text:
            return f"{place} {words}"
    if "Unable to connect" in text or "timed out" in text.lower() or "timeout" in text.lower():
        refused = ", and do both sides have certificates of one authority?" if "tls/" in place else "?"
        return f"nothing answers at {place}: is the simulator, gate or router running there{refused}"
    reason = text.split(" at /", maxsplit=1)[0].splitlines()[0]
    return f"cannot use {place}: {reason}"
