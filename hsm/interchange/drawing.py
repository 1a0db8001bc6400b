"""Graphviz in a process of its own: on some graphs it ends the process that it runs in, and it keeps others waiting.

The process is started for the first picture and serves all that follow; it ends with the program. A request is a line
of JSON with ``form``, ``graph`` (attributes that the graph gets besides) and ``length``, followed by the text in DOT.
The answer is a line with ``done`` and ``length``, followed by the picture, or by the reason why there is none.
"""

from __future__ import annotations

import atexit
import json
import os
import subprocess
import sys
from collections.abc import Mapping
from contextlib import suppress
from importlib.util import find_spec
from threading import Lock, Timer
from typing import IO, Any

LONGEST = 120.0
"""The longest time for a picture, s."""
ATTEMPTS: tuple[Mapping[str, str], ...] = ({}, {"newrank": "true"}, {"newrank": "true", "mclimit": "0.1"})
"""Attributes with which a graph is tried in turn, where Graphviz ends without a picture."""


class DrawingError(Exception):
    """Graphviz does not draw a graph; the message says why."""


class _Drawer:
    """The process, as the program sees it."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._owner = 0
        self._turn = Lock()

    def draw(self, text: str, form: str, more: Mapping[str, str]) -> bytes | None:
        """A picture; None where the process has ended over it.

        Raises:
            DrawingError: Graphviz refuses the graph.
        """
        body = text.encode()
        with self._turn:
            process = self._started()
            assert process.stdin is not None
            assert process.stdout is not None
            limit = Timer(LONGEST, process.kill)
            limit.start()
            try:
                head = {"form": form, "graph": dict(more), "length": len(body)}
                process.stdin.write(json.dumps(head).encode() + b"\n" + body)
                process.stdin.flush()
                answer = _read(process.stdout)
            except BrokenPipeError:
                answer = None
            finally:
                limit.cancel()
            if answer is None:
                self.release()
                return None
        head, found = answer
        if not head["done"]:
            raise DrawingError(found.decode(errors="replace"))
        return found

    def _started(self) -> subprocess.Popen[bytes]:
        if self._owner != os.getpid():  # after a fork the process is still that of the other program
            self._process, self._owner = None, os.getpid()
            atexit.register(self.release)
        if self._process is not None and self._process.poll() is None:
            return self._process
        self.release()
        self._process = subprocess.Popen(
            [sys.executable, "-c", "from hsm.interchange.drawing import serve; serve()"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,  # its libraries warn of each word in a newer system's settings
            env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
            start_new_session=True,  # Ctrl-C is the program's
        )
        return self._process

    def release(self) -> None:
        """End the process, if there is one."""
        process, self._process = self._process, None
        if process is None or self._owner != os.getpid():
            return
        process.kill()
        process.wait()
        for pipe in (process.stdin, process.stdout):
            with suppress(BrokenPipeError):  # what it did not read
                if pipe is not None:
                    pipe.close()


_DRAWER = _Drawer()


def installed() -> bool:
    """Whether Graphviz is here, with its interface for Python."""
    return find_spec("pygraphviz") is not None


def drawn(text: str, form: str) -> bytes:
    """A graph as a picture.

    Args:
        text: the graph in DOT.
        form: ``svg`` or ``png``.

    Raises:
        DrawingError: Graphviz does not draw it.
    """
    for more in ATTEMPTS:
        found = _DRAWER.draw(text, form, more)
        if found is not None:
            return found
    raise DrawingError(f"Graphviz ends without a picture, or takes longer than {LONGEST:.0f} s")


def _read(stream: IO[bytes]) -> tuple[dict[str, Any], bytes] | None:
    """A line of JSON and the bytes after it; None at the end of a stream."""
    line = stream.readline()
    if not line.endswith(b"\n"):
        return None
    head: dict[str, Any] = json.loads(line)
    body = stream.read(head["length"])
    return (head, body) if len(body) == head["length"] else None


def serve() -> None:
    """Draw what comes over the standard input, until that ends."""
    requests, answers = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a library prints does not reach the answers
    while (request := _read(requests)) is not None:
        head, body = request
        try:
            found, done = _picture(body.decode(), head["form"], head["graph"]), True
        except Exception as error:
            found, done = str(error).encode(), False
        answers.write(json.dumps({"done": done, "length": len(found)}).encode() + b"\n" + found)
        answers.flush()


def _picture(text: str, form: str, more: Mapping[str, str]) -> bytes:
    import pygraphviz  # noqa: PLC0415 - an extra

    from hsm.interchange.labels import settle  # noqa: PLC0415 - used in this process alone

    graph = pygraphviz.AGraph(text)
    graph.graph_attr.update(**more)
    graph.layout(prog="dot")
    settle(graph)
    picture: bytes = graph.draw(format=form, prog="nop2")
    return picture
