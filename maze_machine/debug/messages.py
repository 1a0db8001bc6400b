"""Messages of the Debug Adapter Protocol on two streams: a header with a length, and JSON."""

from __future__ import annotations

import json
from collections.abc import Mapping
from contextlib import suppress
from queue import Empty, Queue
from threading import Thread
from typing import Any, BinaryIO

Message = Mapping[str, Any]
_UNSEEN: Message = {}
"""Means that no request has arrived."""
MOST = 10_000_000
"""The largest message, bytes."""
_LONGEST_HEADER = 1000


class DapProtocolError(Exception):
    """The input is not a message of the protocol; the rest cannot be parsed."""


def read_message(stream: BinaryIO) -> Message | None:
    """The next message; None at the end of the stream.

    Raises:
        ProtocolError: it is invalid.
    """
    length = None
    while True:
        line = stream.readline(_LONGEST_HEADER)
        if not line:
            return None
        name, colon, value = line.partition(b":")
        if not line.strip():
            break
        if not colon or name.strip().lower() not in (b"content-length", b"content-type"):
            raise DapProtocolError(f"`{line[:40]!r}` is not a header of the Debug Adapter Protocol")
        if name.strip().lower() == b"content-length":
            if not value.strip().isdigit() or not 0 < int(value) <= MOST:
                raise DapProtocolError(f"a message cannot have a length of {value.strip()[:40]!r}")
            length = int(value)
    if length is None:
        raise DapProtocolError("a message must begin with its length")
    text = stream.read(length)
    if len(text) < length:
        return None
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        raise DapProtocolError("a message is not JSON") from None
    if not isinstance(found, dict):
        raise DapProtocolError("a message is not a JSON object")
    return found


class Channel:
    """The connection to an editor: requests are queued, so that a run can be stopped.

    Attributes:
        ended: the editor has left.
    """

    def __init__(self, reading: BinaryIO, writing: BinaryIO) -> None:
        self.ended = False
        self._asked: Queue[Message | None] = Queue()
        self._seen: Message | None = _UNSEEN
        self._reading = reading
        self._writing = writing
        self._sent = 0
        self._broken = False
        Thread(target=self._read, name="debug adapter", daemon=True).start()

    def next(self, *, block: bool) -> Message | None:
        """The next request; None if there is none."""
        try:
            found = self._asked.get(block=block) if self._seen is _UNSEEN else self._seen
        except Empty:
            return None
        self._seen = _UNSEEN
        self.ended = found is None
        return found

    def wait(self, most: float) -> None:
        """Wait for a request, at most for this long, s."""
        if self._seen is _UNSEEN:
            with suppress(Empty):
                self._seen = self._asked.get(timeout=most)

    def event(self, name: str, /, **body: object) -> None:
        """Send an event."""
        self._send({"type": "event", "event": name, "body": body})

    def answer(self, request: Message, body: Mapping[str, object] | None = None) -> None:
        """Answer a request; an acknowledgement has no body, since strict clients refuse one."""
        self._respond(request, {"success": True} if body is None else {"success": True, "body": body})

    def refuse(self, request: Message, reason: str) -> None:
        """Answer that a request failed, and why."""
        error = {"id": 1, "format": "{reason}", "variables": {"reason": reason}, "showUser": True}
        self._respond(request, {"success": False, "message": reason, "body": {"error": error}})

    def _respond(self, request: Message, what: Mapping[str, object]) -> None:
        number = request.get("seq")
        about = {"request_seq": number if isinstance(number, int) else 0, "command": str(request.get("command"))}
        self._send({"type": "response", **about, **what})

    def _send(self, message: Mapping[str, object]) -> None:
        self._sent += 1
        text = json.dumps({"seq": self._sent, **message}).encode()
        if self._broken:
            return
        try:
            self._writing.write(b"Content-Length: %d\r\n\r\n%b" % (len(text), text))
            self._writing.flush()
        except (OSError, ValueError):
            self._broken = True  # the editor has gone; the end of the other stream reports it

    def _read(self) -> None:
        try:
            while (message := read_message(self._reading)) is not None:
                self._asked.put(message)
        except (DapProtocolError, OSError, ValueError) as error:
            self.event("output", category="important", output=f"{error}\n")
        self._asked.put(None)
