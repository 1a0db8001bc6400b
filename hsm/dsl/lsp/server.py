"""The language server: all that an editor asks, by the Language Server Protocol. It needs the extra ``lsp``."""

from __future__ import annotations

from hsm.dsl.lsp.handlers import changing, formatting, navigation, showing, synchronisation, writing
from hsm.dsl.lsp.machine_server import MachineServer
from hsm.dsl.lsp.workspace import LibraryOf


def make_server(library_of: LibraryOf, version: str) -> MachineServer:
    """A server.

    Args:
        library_of: gives the library that a file's machine is written against.
        version: of this program.
    """
    server = MachineServer(library_of, version)
    for part in (synchronisation, writing, navigation, changing, showing, formatting):
        part.add(server)
    return server
