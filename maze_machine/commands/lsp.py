"""``maze-machine lsp``: what editors talk to while a machine is written."""

from __future__ import annotations

from maze_machine.arguments.options import LibraryOption
from maze_machine.errors import UsageError


def lsp(library: LibraryOption = None) -> None:
    """Serve an editor over standard input and output, by the Language Server Protocol.

    Findings while one types, completion from the registry, documentation under the pointer, go to definition, outline,
    formatting. Needs the extra `lsp`: `pip install "maze-machine[lsp]"`.

    Example: `maze-machine lsp`
    """
    from importlib.metadata import version

    from maze_machine.catalogue.library import chosen_library

    try:
        from hsm.dsl.lsp.server import make_server
    except ImportError as error:
        missing = f"the language server needs the package {error.name}"
        raise UsageError(missing, 'install it with: pip install "maze-machine[lsp]"') from None
    make_server(chosen_library(library), version("maze-machine")).start_io()
