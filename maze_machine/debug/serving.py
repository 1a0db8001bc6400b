"""Serves the debug adapter on the standard streams, or on a port of this computer."""

from __future__ import annotations

import os
import socket
import sys
from collections.abc import Callable
from contextlib import redirect_stdout, suppress

from maze_machine.debug.adapter import Adapter
from maze_machine.debug.messages import Channel
from maze_machine.errors import UsageError


def serve_streams(library: str | None) -> None:
    """Serve one editor on standard input and output; whatever else is printed goes to standard error."""
    # Separate streams: a reading thread must not delay the interpreter's exit, and a library that prints must not write
    # to the editor.
    with os.fdopen(os.dup(sys.stdout.fileno()), "wb") as writing, redirect_stdout(sys.stderr):
        reading = os.fdopen(os.dup(sys.stdin.fileno()), "rb")
        Adapter(Channel(reading, writing), library).serve()


def serve_port(host: str, port: int, library: str | None, tell: Callable[[str], object]) -> None:
    """Serve editors on a port of this computer, one at a time, until the process is ended.

    Args:
        host: an address of this machine's own loopback.
        port: the port; 0 for any that is free.
        library: the library of machines whose launch names none.
        tell: receives the address.

    Raises:
        UsageError: the port is not available.
    """
    try:
        listening = socket.create_server((host, port))
    except OSError as error:
        raise UsageError(f"cannot listen at {host}:{port}: {error.strerror}", "name another port") from None
    with listening:
        address = listening.getsockname()
        tell(f"the debug adapter listens at {address[0]}:{address[1]}")
        while True:
            connection, _ = listening.accept()
            with connection, connection.makefile("rb") as reading, connection.makefile("wb") as writing:
                Adapter(Channel(reading, writing), library).serve()
                with suppress(OSError):  # ends the thread that still reads, unless the editor has left before
                    connection.shutdown(socket.SHUT_RDWR)
