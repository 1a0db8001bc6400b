"""``maze-machine lsp``: what editors talk to while a machine is written."""

from __future__ import annotations

from traceback import walk_tb
from typing import TYPE_CHECKING

from maze_machine.arguments.options import LibraryOption
from maze_machine.errors import missing_package

if TYPE_CHECKING:
    import logging


def lsp(library: LibraryOption = None) -> None:
    """Serve an editor over standard input and output, by the Language Server Protocol.

    Diagnostics while you type, completion, hover documentation, definitions and references, renaming, quick fixes,
    outline, highlighting, formatting. Each file is checked against the library of its project. The code of an untrusted
    project never runs; its machines are checked against the shipped library instead. Needs the extra `lsp`: `pip
    install "maze-machine[lsp]"`.

    Example: `maze-machine lsp`
    """
    import gc
    import logging
    import os
    import sys
    from contextlib import redirect_stdout
    from importlib.metadata import version

    gc.disable()  # the protocol's types are many objects that never go: nothing is to be looked through while they come
    try:
        from lsprotocol.types import MessageType, ShowMessageParams
        from pygls.exceptions import JsonRpcInvalidParams

        from hsm.dsl.lsp.server import make_server
        from maze_machine.editor.libraries import EditorLibraries
        from maze_machine.editor.requests import add_requests
    except ImportError as error:
        raise missing_package("the language server", str(error.name), "lsp") from None

    def warn(message: str) -> None:
        server.window_show_message(ShowMessageParams(MessageType.Warning, message))

    libraries = EditorLibraries(library, warn)
    server = make_server(libraries, version("maze-machine"))
    add_requests(server, libraries, version("maze-machine"))
    # What an editor shows of the server's own words is to be errors: a request that is refused is answered, no more.
    protocol = logging.getLogger("pygls.protocol.json_rpc")
    protocol.setLevel(logging.ERROR)
    protocol.addFilter(lambda said: not (said.exc_info and isinstance(said.exc_info[1], JsonRpcInvalidParams)))
    logging.getLogger("pygls.server").addFilter(_in_one_line)
    gc.freeze()
    gc.enable()
    # A stream of its own: a library that prints must not speak to the editor.
    with os.fdopen(os.dup(sys.stdout.fileno()), "wb") as writing, redirect_stdout(sys.stderr):
        server.start_io(None, writing)


def _in_one_line(said: logging.LogRecord) -> bool:
    """Say what the protocol could not read in one line; a fault in this program keeps its traceback."""
    error = said.exc_info[1] if said.exc_info else None
    if error is not None:
        *_, (frame, _) = walk_tb(error.__traceback__)
        if frame.f_globals.get("__name__", "").partition(".")[0] in ("pygls", "json", "lsprotocol", "cattrs"):
            said.msg, said.args, said.exc_info = f"{said.msg}: {type(error).__name__}: {error}"[:500], (), None
    return True
