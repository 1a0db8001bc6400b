"""A language server with the files of its editor, and when it looks at them again.

Diagnostics are computed when a document is opened, and when typing pauses for a moment; an editor that requests them
itself (pull) gets them only on request.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future
from contextlib import asynccontextmanager
from itertools import islice
from pathlib import Path
from time import monotonic
from typing import Any
from uuid import uuid4

from lsprotocol import types
from pygls.lsp.server import LanguageServer
from pygls.protocol import LanguageServerProtocol

from hsm.dsl.lsp import protocol
from hsm.dsl.lsp.document import Document
from hsm.dsl.lsp.edited import EditedFile, MachineFile
from hsm.dsl.lsp.references import NamingFile
from hsm.dsl.lsp.workspace import MOST_FILES, MOST_FOLDERS, Documents, LibraryOf, OtherFile, OtherLanguage
from hsm.dsl.syntax.sources import files_in, read_text
from hsm.model.diagnostics import MachineError, Severity

PAUSE = 0.02
"""How long typing has to pause before a document is checked, s."""
LONG = 1.0
"""A check that is expected to take longer than this is shown as work in progress, s."""
PACE = 4e-4
"""How long the first check of a file takes for each of its lines, about, s; later ones take as long as the last."""


class _Protocol(LanguageServerProtocol):
    """The protocol, without a leak of pygls 2.1, which keeps the result of every notification for ever."""

    def _execute_handler(
        self,
        msg_id: str | int,
        handler: Callable[..., Any],
        callback: Callable[[Future[Any]], Any],
        args: tuple[Any, ...] | None = None,
        kwargs: dict[str, Any] | None = None,
    ) -> None:
        def done(future: Future[Any]) -> None:
            # Replaced, not modified: pygls iterates over it at shutdown.
            self._request_futures = {one: kept for one, kept in self._request_futures.items() if one != msg_id}
            try:
                callback(future)
            except asyncio.CancelledError:  # a part of a notification that the server's end interrupted
                return

        super()._execute_handler(msg_id, handler, done, args, kwargs)


class MachineServer(LanguageServer):
    """A language server with the documents of its editor.

    Attributes:
        documents: what is open.
        pulls: the editor asks for diagnostics itself.
        snippets: whether the editor supports snippets.
        forget_libraries: called with the files that have changed, as far as they are known; they may be libraries.
        other_language: that of files that are not machines.
        ignored: gives the beginnings of codes of warnings and notes that are not shown of a file.
        tested: returns the annotations of the states of a file's machine, by line, from 0.
        run_tests: called with a file that was opened or saved.
        started: called when the editor is ready, and when its settings have changed.
        hints: whether defaults of arguments are shown beside calls.
        pages: where each code of a diagnostic is explained.
    """

    def __init__(self, library_of: LibraryOf, version: str) -> None:
        super().__init__(
            "maze-machine",
            version,
            text_document_sync_kind=types.TextDocumentSyncKind.Incremental,
            protocol_cls=_Protocol,
        )
        self.documents = Documents(library_of)
        self.forget_libraries: Callable[[Sequence[str]], object] = lambda _changed: None
        self.ignored: Callable[[str], tuple[str, ...]] = lambda _file: ()
        self.tested: Callable[[str], Mapping[int, str]] = lambda _file: {}
        self.run_tests: Callable[[str], object] = lambda _file: None
        self.started: Callable[[], Awaitable[None]] | None = None
        self.hints = True
        self.pages: Mapping[str, str] = {}
        self.other_language: OtherLanguage | None = None
        self._others: dict[str, tuple[object, OtherFile]] = {}
        self.pulls = False
        self.snippets = False
        self._taken: dict[str, float] = {}
        self._waiting: dict[str, asyncio.TimerHandle] = {}

    @property
    def creates_files(self) -> bool:
        """Whether the editor makes files where a change asks for it."""
        capable = self.client_capabilities.workspace
        able = capable.workspace_edit if capable is not None else None
        created = types.ResourceOperationKind.Create
        return able is not None and bool(able.document_changes) and created in (able.resource_operations or ())

    def document(self, uri: str) -> Document:
        """The machine as it is in the editor; an empty document for a file of another language."""
        file = protocol.path_of(uri)
        self.documents.update(file, "" if self.other(uri) else self.workspace.get_text_document(uri).source)
        return self.documents[file]

    def file(self, uri: str) -> EditedFile:
        """The file as it is in the editor, of whichever language."""
        return self.other(uri) or MachineFile(self.document(uri))

    def other(self, uri: str) -> OtherFile | None:
        """The file as the editor has it, if it is of another language; made again when any file changes."""
        language = self.other_language
        if language is None or not uri.endswith(language.suffix):
            return None
        opened = {protocol.path_of(one): document for one, document in self.workspace.text_documents.items()}
        stamp = [(file, document.version) for file, document in opened.items()]
        known = self._others.get(uri)
        if known is None or known[0] != stamp:
            text = self.workspace.get_text_document(uri).source
            made = language.file(protocol.path_of(uri), text, {file: one.source for file, one in opened.items()})
            known = self._others[uri] = (stamp, made)
        return known[1]

    def around(self, file: EditedFile) -> Iterator[NamingFile]:
        """The machines around a file, and the files of the other language, as they are in the editor or on the disk."""
        folder = self.folder(file.file)
        yield from self.documents.around(folder)
        if self.other_language is None:
            return
        opened = {protocol.path_of(one): document.source for one, document in self.workspace.text_documents.items()}
        for path in islice(files_in(folder, self.other_language.suffix, MOST_FOLDERS), MOST_FILES):
            try:
                text = opened.get(str(path)) or read_text(path)
            except MachineError:
                continue
            yield self.other_language.file(str(path), text, opened)

    def found(self, uri: str) -> list[types.Diagnostic]:
        """The diagnostics of a document."""
        other = self.other(uri)
        if other is not None:
            return [protocol.diagnostic(one, other.file, other.lines, self.pages) for one in other.diagnostics()]
        document = self.document(uri)
        unwanted = self.ignored(document.file)
        return [
            protocol.diagnostic(one, document.file, document.tree.lines, self.pages)
            for one in self.documents.diagnostics(document.file)
            if one.severity is Severity.ERROR or not one.code.startswith(unwanted)
        ]

    @asynccontextmanager
    async def checking(self, uri: str) -> AsyncIterator[None]:
        """Let the editor show that a document is checked, if that is expected to take long."""
        window = self.client_capabilities.window
        lines = len(self.workspace.get_text_document(uri).lines) if uri not in self._taken else 0
        long = self._taken.get(uri, PACE * lines) > LONG
        shown = long and window is not None and bool(window.work_done_progress)
        token = str(uuid4())
        if shown:
            await self.work_done_progress.create_async(token)
            self.work_done_progress.begin(token, types.WorkDoneProgressBegin(f"checking {Path(uri).name}"))
            await asyncio.sleep(0)
        began = monotonic()
        try:
            yield
        finally:
            self._taken[uri] = monotonic() - began
            if shown:
                self.work_done_progress.end(token, types.WorkDoneProgressEnd())
                del self.work_done_progress.tokens[token]

    def refresh(self, changed: Sequence[str] = ()) -> None:
        """Files have changed on the disk: look at everything again.

        Args:
            changed: the files, as far as they are known.
        """
        self.forget_libraries(changed)
        self.documents.refresh()
        self._others.clear()
        for uri in list(self.workspace.text_documents):
            self.publish_soon(uri)
        self._have_asked_again()

    def _have_asked_again(self) -> None:
        """Have an editor that asks for diagnostics, hints and colours ask again."""
        able = self.client_capabilities.workspace
        if able is None:
            return
        if able.diagnostics is not None and able.diagnostics.refresh_support:
            self.workspace_diagnostic_refresh(None)
        if able.inlay_hint is not None and able.inlay_hint.refresh_support:
            self.workspace_inlay_hint_refresh(None)
        if able.semantic_tokens is not None and able.semantic_tokens.refresh_support:
            self.workspace_semantic_tokens_refresh(None)

    def publish(self, uri: str) -> None:
        """Send the editor the diagnostics of a document, unless it asks for them."""
        self._waiting.pop(uri, None)
        if self.pulls or uri not in self.workspace.text_documents:
            return
        version = self.workspace.get_text_document(uri).version
        self.text_document_publish_diagnostics(types.PublishDiagnosticsParams(uri, self.found(uri), version))

    def publish_soon(self, uri: str) -> None:
        """The same, when typing has paused."""
        if (waiting := self._waiting.pop(uri, None)) is not None:
            waiting.cancel()
        self._waiting[uri] = asyncio.get_running_loop().call_later(PAUSE, self.publish, uri)

    def forget(self, uri: str) -> None:
        """A document was closed: withdraw its diagnostics."""
        if (waiting := self._waiting.pop(uri, None)) is not None:
            waiting.cancel()
        self.documents.close(protocol.path_of(uri))
        self._taken.pop(uri, None)
        self._others.pop(uri, None)
        self.text_document_publish_diagnostics(types.PublishDiagnosticsParams(uri, []))

    def folder(self, file: str) -> Path:
        """The innermost folder of the editor's workspace around a file."""
        folders = [Path(protocol.path_of(uri)) for uri in self.workspace.folders]
        around = [one for one in folders if Path(file).is_relative_to(one)]
        return max(around, key=lambda one: len(one.parts), default=Path(file).parent)
