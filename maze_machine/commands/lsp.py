"""``maze-machine lsp``: what editors talk to while a machine is written."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from maze_machine.arguments.options import LibraryOption
from maze_machine.errors import CommandError, UsageError

if TYPE_CHECKING:
    from hsm.model.registry import Library


def lsp(library: LibraryOption = None) -> None:
    """Serve an editor over standard input and output, by the Language Server Protocol.

    Diagnostics while one types, completion, documentation under the pointer, definitions and references, renaming,
    quick fixes, outline, colours, formatting. Each file is checked against the library of its project; the code of a
    project that is not trusted never runs, and its machines are checked against the shipped library until it is. Needs
    the extra `lsp`: `pip install "maze-machine[lsp]"`.

    Example: `maze-machine lsp`
    """
    from importlib.metadata import version

    try:
        from lsprotocol.types import MessageType, ShowMessageParams

        from hsm.dsl.lsp.server import make_server
    except ImportError as error:
        missing = f"the language server needs the package {error.name}"
        raise UsageError(missing, 'install it with: pip install "maze-machine[lsp]"') from None

    def warn(message: str) -> None:
        server.window_show_message(ShowMessageParams(MessageType.Warning, message))

    libraries = EditorLibraries(library, warn)
    server = make_server(libraries, version("maze-machine"))
    server.start_io()


@dataclass(slots=True)
class EditorLibraries:
    """The library of each file that an editor has open; what a file's project lacks is said once.

    Attributes:
        named: the library of all files, as ``MODULE:NAME``; None for that of each file's project.
        warn: shows a message in the editor.
    """

    named: str | None
    warn: Callable[[str], object]
    _found: dict[tuple[Path | None, int], Library] = field(default_factory=dict)
    _told: set[str] = field(default_factory=set)

    def __call__(self, file: str) -> Library:
        """The library that a file's machine is written against."""
        from maze_machine.catalogue.library import chosen_library, robot_names
        from maze_machine.catalogue.project import find_project

        try:
            project = find_project(Path(file).parent)
            key = (None, 0) if project is None else (project.file, project.file.stat().st_mtime_ns)
            if key not in self._found:
                self._found[key] = chosen_library(self.named, Path(file), ask=lambda _question: False)
            return self._found[key]
        except CommandError as error:
            message = f"{error}; {error.way_out}" if error.way_out else str(error)
            if message not in self._told:
                self._told.add(message)
                self.warn(f"{message}. Until then machines are checked against the shipped library.")
        shipped = (None, -1)
        if shipped not in self._found:
            self._found[shipped] = robot_names()
        return self._found[shipped]
