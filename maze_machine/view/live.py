"""The server of the page: shows a run while it runs, and receives the operator's requests.

It answers on the loopback unless another address is asked for, and only to clients that have the token in its address;
requests that a browser sends for another page (by their ``Host`` or ``Origin``) are refused. The loop that publishes
frames never waits for a browser: frames are kept, and each browser is sent them at its own pace.
"""

from __future__ import annotations

import asyncio
import json
import secrets
import socket
import time
from collections import deque
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import asynccontextmanager, suppress
from threading import Event, Thread
from types import TracebackType
from typing import Any, NamedTuple
from urllib.parse import urlsplit

import uvicorn
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import FileResponse, HTMLResponse, PlainTextResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.types import ASGIApp, Receive, Scope, Send
from starlette.websockets import WebSocket, WebSocketDisconnect

from maze_machine.view.drawings import is_graph
from maze_machine.view.page import KEYFRAME, VIZ, Frame, FrameEncoder, live_page

LOOPBACK = "127.0.0.1"
KEPT = 18_000
"""How many of the newest frames are kept for late browsers: half an hour at 10 Hz."""
BATCH = 500
"""The largest number of frames per message to a browser."""
BEAT = 0.03
"""The interval of checks for new frames, s."""
LARGEST = 4096
"""The largest message from a browser, bytes."""
POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' 'self' 'wasm-unsafe-eval'; style-src 'unsafe-inline'; "
    "img-src data:; connect-src 'self' ws:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)

Operate = Callable[[bytes], bytes]
"""Executes an operator's question, and returns the answer; both are JSON."""


class SimulatedTime(NamedTuple):
    """What a page knows of a run whose time may wait.

    Attributes:
        pausable: whether it may be paused.
        paused: why it is paused; empty while it runs.
    """

    pausable: bool = False
    paused: str = ""


NO_SIMULATION = SimulatedTime()
"""A robot's own time does not wait."""

Made = Callable[[], Frame]
"""Makes a frame on demand, in another thread than the loop's."""


class Feed:
    """Frames in the order in which they came, for any number of readers."""

    def __init__(self) -> None:
        self._waiting: deque[Made] = deque()
        self._frames: list[bytes] = []
        self._dropped = 0
        self._encoder = FrameEncoder()

    def publish(self, frame: Made) -> None:
        """Add a frame, without processing it in this thread."""
        self._waiting.append(frame)

    def encode(self) -> None:
        """Make and encode the new frames; call it from a single thread."""
        for _ in range(min(len(self._waiting), BATCH)):
            self._frames.append(self._encoder(self._waiting.popleft()()))
        spare = (len(self._frames) - KEPT) // KEYFRAME * KEYFRAME  # the first that is kept is complete
        if spare > KEPT // 8:
            del self._frames[:spare]
            self._dropped += spare

    @property
    def complete(self) -> bool:
        """Whether all frames are encoded."""
        return not self._waiting

    def after(self, index: int) -> tuple[list[bytes], int]:
        """Some of the frames from an index on, and the index after the last of them."""
        first = max(index, self._dropped)
        found = self._frames[first - self._dropped : first - self._dropped + BATCH]
        return found, first + len(found)


class LivePage:
    """A server for one run; use it as a context manager.

    Attributes:
        address: what to open in a browser.
        watched: set while a browser shows the page.

    Raises (when it is made):
        OSError: the port is taken, or the host is not an address of this computer.
    """

    def __init__(
        self,
        head: Frame,
        port: int = 0,
        *,
        host: str = LOOPBACK,
        operate: Operate | None = None,
        drawn: Callable[[str], str] | None = None,
        simulation: Callable[[], SimulatedTime] = lambda: NO_SIMULATION,
        feed: Feed | None = None,
    ) -> None:
        """Begin to listen.

        Args:
            head: what does not change.
            port: 0 for any that is free.
            host: an address of this computer.
            operate: executes an operator's request; None for a read-only page.
            drawn: returns the picture of the machine around a compound state.
            simulation: whether the run may be paused, and whether it is; both may change.
            feed: frames that have come before; None where none have.
        """
        self.watched, self.seen = Event(), Event()
        self._feed, self._operate, self._drawn, self._simulation = feed or Feed(), operate, drawn, simulation
        self._ending: Mapping[str, Any] | None = None
        self._browsers = 0
        self._token = secrets.token_urlsafe(16)
        self._socket = socket.create_server((host, port), family=socket.AF_INET6 if ":" in host else socket.AF_INET)
        shown = f"[{host}]" if ":" in host else host
        bound = self._socket.getsockname()[1]
        self.address = f"http://{shown}:{bound}/?token={self._token}"
        names = {shown, "localhost"} if host == LOOPBACK else {shown}
        self._hosts = frozenset(f"{name}:{bound}" for name in names)
        self._page = live_page({**head, "operable": operate is not None}, self._token)
        app = Starlette(
            routes=[
                Route("/", self._answer_page),
                Route("/drawing", self._answer_drawing),
                Route("/viz.js", self._answer_viz),
                WebSocketRoute("/frames", self._stream),
            ],
            lifespan=self._encoding,
        )
        config = uvicorn.Config(
            self._guarded(app), log_level="critical", lifespan="on", ws="websockets-sansio", ws_max_size=LARGEST
        )
        self._server = uvicorn.Server(config)
        self._thread = Thread(target=self._server.run, args=([self._socket],), name="page", daemon=True)

    def publish(self, frame: Made) -> None:
        """Show a frame; never waits."""
        self._feed.publish(frame)

    def end(self, verdict: Frame) -> None:
        """Show how the run has ended: ``line``, ``lines``, ``reason``, ``solved``; ``at_rest`` where the base is."""
        self._ending = {"end": verdict}

    def wait_until_closed(self, grace: float) -> None:
        """Wait until no browser has shown the page for a while, s."""
        while self.watched.is_set() or self.watched.wait(grace):
            time.sleep(BEAT)

    def __enter__(self) -> LivePage:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._server.should_exit = True
        self._thread.join()
        self._socket.close()

    @asynccontextmanager
    async def _encoding(self, _app: Starlette) -> AsyncIterator[None]:
        """While the server runs, frames are encoded as they come."""

        async def encode() -> None:
            while True:
                self._feed.encode()
                await asyncio.sleep(BEAT)

        work = asyncio.create_task(encode())
        yield
        work.cancel()

    def _guarded(self, app: ASGIApp) -> ASGIApp:
        """Refuses requests for another host or from another page, and without the token."""

        async def guarded(scope: Scope, receive: Receive, send: Send) -> None:
            if scope["type"] in ("http", "websocket"):
                reason = self._refused(scope)
                if reason and scope["type"] == "http":
                    await PlainTextResponse(reason, 403)(scope, receive, send)
                    return
                if reason:
                    await send({"type": "websocket.close", "code": 1008, "reason": reason})
                    return
            await app(scope, receive, send)

        return guarded

    def _refused(self, scope: Scope) -> str:
        headers = {name.decode("latin-1"): value.decode("latin-1") for name, value in scope["headers"]}
        if headers.get("host") not in self._hosts:
            return "the host of the request is not this server"
        origin = headers.get("origin")
        if origin is not None and (urlsplit(origin).netloc not in self._hosts or not origin.startswith("http://")):
            return "requests from another page are refused"
        query = dict(part.partition("=")[::2] for part in scope["query_string"].decode("latin-1").split("&"))
        if not secrets.compare_digest(query.get("token", "").encode(), self._token.encode()):
            return "open the address that was printed, with its token"
        return ""

    async def _answer_page(self, _request: Request) -> Response:
        headers = {"Cache-Control": "no-store", "Content-Security-Policy": POLICY, "Referrer-Policy": "no-referrer"}
        return HTMLResponse(self._page, headers=headers)

    async def _answer_drawing(self, request: Request) -> Response:
        name = request.query_params.get("state", "")
        try:
            if self._drawn is None:
                raise LookupError(name)
            drawing = await asyncio.to_thread(self._drawn, name[:1000])
        except Exception as error:  # a state that cannot be drawn has no picture
            return PlainTextResponse(f"{error}", 404)
        media = "text/vnd.graphviz" if is_graph(drawing) else "image/svg+xml"
        return Response(drawing, media_type=media, headers={"Cache-Control": "no-store"})

    async def _answer_viz(self, _request: Request) -> Response:
        return FileResponse(VIZ, media_type="text/javascript")

    async def _stream(self, browser: WebSocket) -> None:
        await browser.accept()
        self._browsers += 1
        self.watched.set()
        self.seen.set()
        listening = asyncio.create_task(self._listen(browser))
        try:
            with suppress(WebSocketDisconnect, RuntimeError):  # the browser has gone
                await self._feed_browser(browser, listening)
        finally:
            listening.cancel()
            self._browsers -= 1
            if not self._browsers:
                self.watched.clear()

    async def _feed_browser(self, browser: WebSocket, listening: asyncio.Task[None]) -> None:
        index, ended, told = 0, False, NO_SIMULATION
        while not listening.done() and not self._server.should_exit:
            ending = self._ending
            if (simulation := self._simulation()) != told:
                told = simulation
                await browser.send_text(json.dumps({"simulation": told._asdict()}))
            frames, index = self._feed.after(index)
            if frames:
                await browser.send_text('{"frames":[' + ",".join(one.decode() for one in frames) + "]}")
            elif ending is not None and not ended and self._feed.complete:
                ended = True
                await browser.send_text(json.dumps(ending, default=str))
            else:
                await asyncio.sleep(BEAT)

    async def _listen(self, browser: WebSocket) -> None:
        """Answer a browser's questions until it disconnects."""
        with suppress(WebSocketDisconnect):
            while True:
                asked = await browser.receive_text()
                if self._operate is None:
                    answer = b'{"done":false,"reason":"this page is read-only"}'
                else:
                    answer = await asyncio.to_thread(self._operate, asked.encode())
                await browser.send_text('{"answer":' + answer.decode() + "}")
