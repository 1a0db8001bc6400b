"""``maze-machine dap``: the debugger of machines, for editors."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from maze_machine.arguments.options import LibraryOption
from maze_machine.errors import UsageError

_LOOPBACK = ("127.0.0.1", "localhost")


def dap(
    listen: Annotated[
        str | None,
        typer.Option(
            metavar="[HOST:]PORT",
            help="Listen on a port of this computer, for one editor at a time; 0 takes any free port. "
            "Default: standard input and output.",
        ),
    ] = None,
    library: LibraryOption = None,
) -> None:
    """Let an editor debug a machine, by the Debug Adapter Protocol.

    It stops at states, transitions and conditions, and steps forward or back by a microstep or a tick. You can try a
    machine without a robot, as in `simulate`, and set signals and variables; drive it in a maze; feed it a recording;
    or watch it in another process. The arguments of `launch` and `attach` are in docs/how-to/debugging.md.

    Example: `maze-machine dap`

    Example: `maze-machine dap --listen 4711`
    """
    from maze_machine.debug.serving import serve_port, serve_streams

    if listen is None:
        serve_streams(library)
        return
    host, _, port = listen.rpartition(":")
    if (host or _LOOPBACK[0]) not in _LOOPBACK:
        raise UsageError(f"the debugger listens on this machine only, not at {host}", f"one of {', '.join(_LOOPBACK)}")
    if not port.isdecimal() or len(port) > 5 or int(port) > 65535:
        raise UsageError(f"`{port[:40]}` is not a port", "a number up to 65535; 0 takes any")

    def tell(text: str) -> None:
        print(text, file=sys.stderr, flush=True)

    serve_port(host or _LOOPBACK[0], int(port), library, tell)
