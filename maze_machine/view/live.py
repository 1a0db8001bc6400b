"""The live page: a small web server on the loopback that shows a run while it goes on.

The loop that publishes frames never waits for a browser: frames are kept, and each browser reads them at its own pace.
"""

from __future__ import annotations

import json
from contextlib import suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Condition, Thread
from types import TracebackType

from maze_machine.view.page import PageFrame, live_page

HOST = "127.0.0.1"
KEPT = 36_000
"""This many of the newest frames are kept for browsers that come late: an hour at 10 Hz."""
HEARTBEAT = 1.0
"""After this long without a frame a browser is sent a comment, which shows whether it is still there, s."""


class Feed:
    """Frames in the order in which they came, for any number of readers."""

    def __init__(self) -> None:
        self._frames: list[bytes] = []
        self._dropped = 0
        self._closed = False
        self._change = Condition()

    def publish(self, frame: PageFrame) -> None:
        """Add a frame; never waits."""
        encoded = json.dumps(frame, separators=(",", ":")).encode()
        with self._change:
            self._frames.append(encoded)
            if len(self._frames) > 2 * KEPT:
                del self._frames[:KEPT]
                self._dropped += KEPT
            self._change.notify_all()

    def close(self) -> None:
        """There will be no more frames."""
        with self._change:
            self._closed = True
            self._change.notify_all()

    def after(self, index: int, timeout: float) -> tuple[list[bytes], int, bool]:
        """Wait for frames from an index on.

        Args:
            index: of the first frame that is wanted.
            timeout: how long to wait for it, s.

        Returns:
            The frames, the index after the last of them, and whether more may come.
        """
        with self._change:
            self._change.wait_for(lambda: self._closed or self._dropped + len(self._frames) > index, timeout)
            frames = self._frames[max(0, index - self._dropped) :]
            return frames, self._dropped + len(self._frames), not self._closed


class LivePage:
    """A server for one run; use it as a context manager.

    Attributes:
        address: what to open in a browser.

    Raises (when it is made):
        OSError: the port is taken.
    """

    def __init__(self, head: PageFrame, port: int = 0) -> None:
        self._feed = Feed()
        page = live_page(head).encode()
        feed = self._feed

        class Handler(_Handler):
            content = page
            source = feed

        self._server = ThreadingHTTPServer((HOST, port), Handler)
        self._server.daemon_threads = True
        self.address = f"http://{HOST}:{self._server.server_port}/"
        self._thread = Thread(
            target=self._server.serve_forever, kwargs={"poll_interval": 0.05}, name="live page", daemon=True
        )

    def publish(self, frame: PageFrame) -> None:
        """Show a frame; never waits."""
        self._feed.publish(frame)

    def __enter__(self) -> LivePage:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._feed.close()
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()


class _Handler(BaseHTTPRequestHandler):
    """Answers ``/`` with the page and ``/frames`` with a stream of frames (server-sent events)."""

    content: bytes
    source: Feed

    def do_GET(self) -> None:
        """Answer a request."""
        if self.path == "/":
            self._begin("text/html; charset=utf-8", length=len(self.content))
            self.wfile.write(self.content)
        elif self.path == "/frames":
            self._begin("text/event-stream")
            with suppress(ConnectionError):  # the browser has gone
                self._stream()
        else:
            self.send_error(404)

    def _begin(self, kind: str, length: int | None = None) -> None:
        self.send_response(200)
        self.send_header("Content-Type", kind)
        self.send_header("Cache-Control", "no-store")
        if length is not None:
            self.send_header("Content-Length", str(length))
        self.end_headers()

    def _stream(self) -> None:
        index, more = 0, True
        while more:
            frames, index, more = self.source.after(index, HEARTBEAT)
            self.wfile.write(b"".join(b"data: " + one + b"\n\n" for one in frames) or b": still here\n\n")
            self.wfile.flush()
        self.wfile.write(b"event: end\ndata: {}\n\n")

    def log_message(self, format: str, *arguments: object) -> None:  # noqa: A002 - the base class's name
        """Say nothing: the terminal belongs to the run."""
