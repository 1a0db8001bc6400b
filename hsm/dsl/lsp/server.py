"""The language server: it answers each request of the protocol with the functions of ``hsm.dsl.lsp``.

It needs the extra ``lsp``. Diagnostics are computed when a document is opened, and when typing pauses for a moment;
an editor that requests them itself (pull) gets them only on request.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping, Sequence
from concurrent.futures import Future
from contextlib import asynccontextmanager
from pathlib import Path
from time import monotonic
from typing import Any

from lsprotocol import types
from pygls.exceptions import JsonRpcInvalidParams
from pygls.lsp.server import LanguageServer
from pygls.protocol import LanguageServerProtocol

from hsm.dsl.format.formatter import format_text
from hsm.dsl.loading import SUFFIX
from hsm.dsl.lsp import actions, navigation, protocol, refactoring
from hsm.dsl.lsp.editing import Document
from hsm.dsl.lsp.workspace import Documents, LibraryOf, OtherDocument, OtherLanguage
from hsm.model.diagnostics import MachineError, Severity

PAUSE = 0.02
"""How long typing has to pause before a document is checked, s."""
LONG = 1.0
"""A check that takes longer than this is shown as work in progress the next time, s."""
_BREATH = 0.002
"""How long a request for diagnostics yields to other requests, s."""
_PULL = types.DiagnosticOptions(inter_file_dependencies=True, workspace_diagnostics=False, identifier="maze-machine")
FIX_ALL = "source.fixAll.maze-machine"
CODE_ACTIONS = (
    types.CodeActionKind.QuickFix,
    FIX_ALL,
    refactoring.ADD_STATE,
    refactoring.EXTRACT,
    refactoring.RETARGET,
)
"""The kinds of code actions."""


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
            callback(future)

        super()._execute_handler(msg_id, handler, done, args, kwargs)


class MachineServer(LanguageServer):
    """A language server with the documents of its editor.

    Attributes:
        documents: what is open.
        pulls: the editor asks for diagnostics itself.
        snippets: whether the editor supports snippets.
        forget_libraries: called with the files that have changed, as far as they are known; they may be libraries.
        other_language: makes the documents of files that are not machines.
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
        self.other_language: OtherLanguage = lambda _file, _text, _opened: None
        self._others: dict[str, tuple[object, OtherDocument | None]] = {}
        self.pulls = False
        self.snippets = False
        self._slow: set[str] = set()
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

    def other(self, uri: str) -> OtherDocument | None:
        """The document as it is in the editor, if it is of another language; rebuilt when any file changes."""
        if uri.endswith(SUFFIX):
            return None
        opened = {protocol.path_of(one): document for one, document in self.workspace.text_documents.items()}
        stamp = [(file, document.version) for file, document in opened.items()]
        known = self._others.get(uri)
        if known is None or known[0] != stamp:
            text = self.workspace.get_text_document(uri).source
            made = self.other_language(protocol.path_of(uri), text, {file: one.source for file, one in opened.items()})
            known = self._others[uri] = (stamp, made)
        return known[1]

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
        """Let the editor show that a document is checked, if that took long the last time."""
        window = self.client_capabilities.window
        shown = uri in self._slow and window is not None and bool(window.work_done_progress)
        token = f"check {uri}"
        if shown:
            await self.work_done_progress.create_async(token)
            self.work_done_progress.begin(token, types.WorkDoneProgressBegin(f"checking {Path(uri).name}"))
            await asyncio.sleep(0)
        began = monotonic()
        try:
            yield
        finally:
            if monotonic() - began > LONG:
                self._slow.add(uri)
            else:
                self._slow.discard(uri)
            if shown:
                self.work_done_progress.end(token, types.WorkDoneProgressEnd())

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
        self._others.pop(uri, None)
        self.text_document_publish_diagnostics(types.PublishDiagnosticsParams(uri, []))

    def folder(self, file: str) -> Path:
        """The innermost folder of the editor's workspace around a file."""
        folders = [Path(protocol.path_of(uri)) for uri in self.workspace.folders]
        around = [one for one in folders if Path(file).is_relative_to(one)]
        return max(around, key=lambda one: len(one.parts), default=Path(file).parent)


def make_server(library_of: LibraryOf, version: str) -> MachineServer:
    """A server.

    Args:
        library_of: gives the library that a file's machine is written against.
        version: of this program.
    """
    server = MachineServer(library_of, version)
    _synchronisation(server)
    _completion(server)
    _navigation(server)
    _editing(server)
    _showing(server)
    _formatting(server)
    return server


def _synchronisation(server: MachineServer) -> None:
    @server.feature(types.INITIALIZED)
    async def initialized(_params: types.InitializedParams) -> None:
        text = server.client_capabilities.text_document
        server.pulls = text is not None and text.diagnostic is not None
        item = text.completion.completion_item if text is not None and text.completion is not None else None
        server.snippets = item is not None and bool(item.snippet_support)
        if server.started is not None:
            await server.started()

    @server.feature(types.WORKSPACE_DID_CHANGE_CONFIGURATION)
    async def configured(_params: types.DidChangeConfigurationParams) -> None:
        if server.started is not None:
            await server.started()
        server.refresh()

    @server.feature(types.TEXT_DOCUMENT_DID_OPEN)
    async def opened(params: types.DidOpenTextDocumentParams) -> None:
        server.publish(params.text_document.uri)
        await asyncio.sleep(_BREATH)
        server.run_tests(protocol.path_of(params.text_document.uri))

    @server.feature(types.TEXT_DOCUMENT_DID_CHANGE)
    async def changed(params: types.DidChangeTextDocumentParams) -> None:
        server.publish_soon(params.text_document.uri)

    @server.feature(types.TEXT_DOCUMENT_DID_SAVE)
    async def saved(params: types.DidSaveTextDocumentParams) -> None:
        server.refresh()  # what imports the file depends on it
        await asyncio.sleep(_BREATH)
        server.run_tests(protocol.path_of(params.text_document.uri))

    @server.feature(types.TEXT_DOCUMENT_DID_CLOSE)
    async def closed(params: types.DidCloseTextDocumentParams) -> None:
        server.forget(params.text_document.uri)

    @server.feature(types.WORKSPACE_DID_CHANGE_WATCHED_FILES)
    async def watched(params: types.DidChangeWatchedFilesParams) -> None:
        server.refresh([protocol.path_of(one.uri) for one in params.changes])

    @server.feature(types.TEXT_DOCUMENT_DIAGNOSTIC, _PULL)
    async def pulled(params: types.DocumentDiagnosticParams) -> types.RelatedFullDocumentDiagnosticReport:
        # Edits and cancellations that have arrived meanwhile are processed first: after a sequence of keystrokes only
        # the last text is checked, and every request gets its diagnostics.
        await asyncio.sleep(_BREATH)
        uri = params.text_document.uri
        async with server.checking(uri):
            return types.RelatedFullDocumentDiagnosticReport(server.found(uri))


def _completion(server: MachineServer) -> None:
    @server.feature(types.TEXT_DOCUMENT_COMPLETION, types.CompletionOptions(trigger_characters=[".", " ", "("]))
    def complete(params: types.CompletionParams) -> list[types.CompletionItem]:
        uri = params.text_document.uri
        document = server.other(uri) or server.document(uri)
        lines = document.lines
        line, column = protocol.characters(params.position, lines)
        begin = column - len(document.typed(line, column))
        replaced = types.Range(protocol.position(line, begin, lines), params.position)
        found = document.completions(line, column)
        return [protocol.completion(one, replaced, snippets=server.snippets) for one in found]

    @server.feature(types.TEXT_DOCUMENT_SIGNATURE_HELP, types.SignatureHelpOptions(["(", ","]))
    def signature(params: types.SignatureHelpParams) -> types.SignatureHelp | None:
        document = server.document(params.text_document.uri)
        call = document.call(*protocol.characters(params.position, document.tree.lines))
        return None if call is None else protocol.signature_help(call)

    @server.feature(types.TEXT_DOCUMENT_HOVER)
    def hover(params: types.HoverParams) -> types.Hover | None:
        document = server.other(params.text_document.uri) or server.document(params.text_document.uri)
        entry = document.hover(*protocol.characters(params.position, document.lines))
        return None if entry is None else types.Hover(protocol.markdown(entry))


def _navigation(server: MachineServer) -> None:
    @server.feature(types.TEXT_DOCUMENT_DEFINITION)
    def define(params: types.DefinitionParams) -> types.Location | None:
        other = server.other(params.text_document.uri)
        document = server.document(params.text_document.uri)
        if other is not None:
            found = other.definition(*protocol.characters(params.position, other.lines))
        else:
            found = navigation.definition(document, *protocol.characters(params.position, document.tree.lines))
        if found is None:
            return None
        lines = document.tree.lines if found.file == document.file else ()
        return types.Location(protocol.uri_of(found.file), protocol.range_of(found, lines))

    @server.feature(types.TEXT_DOCUMENT_REFERENCES)
    def refer(params: types.ReferenceParams) -> list[types.Location]:
        document = server.document(params.text_document.uri)
        line, column = protocol.characters(params.position, document.tree.lines)
        found = [(document, one) for one in navigation.references(document, line, column)]
        here = document.occurrence(line, column)
        for other in server.documents.around(server.folder(document.file)):
            if here is not None and Path(other.file) != Path(document.file):
                found += [(other, one) for one in navigation.references_elsewhere(document, here, other)]
        return [
            types.Location(protocol.uri_of(of.file), protocol.range_of_name(one, of.tree.lines))
            for of, one in found
            if params.context.include_declaration or not one.declares
        ]

    @server.feature(types.TEXT_DOCUMENT_DOCUMENT_HIGHLIGHT)
    def highlight(params: types.DocumentHighlightParams) -> list[types.DocumentHighlight]:
        document = server.document(params.text_document.uri)
        found = navigation.references(document, *protocol.characters(params.position, document.tree.lines))
        kinds = {True: types.DocumentHighlightKind.Write, False: types.DocumentHighlightKind.Read}
        return [
            types.DocumentHighlight(protocol.range_of_name(one, document.tree.lines), kinds[one.declares])
            for one in found
        ]

    @server.feature(types.TEXT_DOCUMENT_DOCUMENT_SYMBOL)
    def symbols(params: types.DocumentSymbolParams) -> list[types.DocumentSymbol]:
        other = server.other(params.text_document.uri)
        if other is not None:
            return [protocol.symbol(one, other.lines) for one in other.outline()]
        document = server.document(params.text_document.uri)
        return [protocol.symbol(one, document.tree.lines) for one in navigation.outline(document)]

    @server.feature(types.WORKSPACE_SYMBOL)
    def workspace_symbols(params: types.WorkspaceSymbolParams) -> list[types.SymbolInformation]:
        found: list[types.SymbolInformation] = []
        seen: set[str] = set()
        for uri in server.workspace.folders:
            for document in server.documents.around(Path(protocol.path_of(uri))):
                if document.file in seen:
                    continue
                seen.add(document.file)
                found += _symbols_of(document, params.query)
        return found

    @server.feature(types.TEXT_DOCUMENT_FOLDING_RANGE)
    def fold(params: types.FoldingRangeParams) -> list[types.FoldingRange]:
        document = server.document(params.text_document.uri)
        return [
            types.FoldingRange(first, last, kind=types.FoldingRangeKind.Comment if comment else None)
            for first, last, comment in navigation.folds(document)
        ]

    @server.feature(types.TEXT_DOCUMENT_SEMANTIC_TOKENS_FULL, protocol.LEGEND)
    def colours(params: types.SemanticTokensParams) -> types.SemanticTokens:
        document = server.document(params.text_document.uri)
        return protocol.semantic_tokens(navigation.colours(document), document.tree.lines)


def _symbols_of(document: Document, query: str) -> list[types.SymbolInformation]:
    """The declarations of a file whose names contain what is looked for."""
    found: list[types.SymbolInformation] = []
    pending = [(one, "") for one in navigation.outline(document)]
    while pending:
        one, container = pending.pop()
        pending += [(child, one.name) for child in one.children]
        if query.lower() in one.name.lower():
            where = types.Location(protocol.uri_of(document.file), protocol.range_of(one.place, document.tree.lines))
            kind = protocol.SYMBOLS[one.role]
            found.append(types.SymbolInformation(where, one.name, kind, container_name=container or None))
    return found


def _editing(server: MachineServer) -> None:
    @server.feature(types.TEXT_DOCUMENT_PREPARE_RENAME)
    def prepare(params: types.PrepareRenameParams) -> types.Range:
        document = server.document(params.text_document.uri)
        try:
            here = navigation.renamable(document, *protocol.characters(params.position, document.tree.lines))
        except navigation.RenameError as error:
            raise JsonRpcInvalidParams(str(error)) from None
        return protocol.range_of_name(here, document.tree.lines)

    @server.feature(types.TEXT_DOCUMENT_RENAME, types.RenameOptions(prepare_provider=True))
    def rename(params: types.RenameParams) -> types.WorkspaceEdit:
        document = server.document(params.text_document.uri)
        line, column = protocol.characters(params.position, document.tree.lines)
        others = {one.file: one for one in server.documents.around(server.folder(document.file))}
        try:
            found = navigation.rename(document, line, column, params.new_name, others.values())
        except navigation.RenameError as error:
            raise JsonRpcInvalidParams(str(error)) from None
        changes: dict[str, list[types.TextEdit]] = {}
        for file, one in found:
            lines = document.tree.lines if file == document.file else others[file].tree.lines
            edit = types.TextEdit(protocol.range_of_name(one, lines), params.new_name)
            changes.setdefault(protocol.uri_of(file), []).append(edit)
        return types.WorkspaceEdit(changes=changes)

    @server.feature(types.TEXT_DOCUMENT_CODE_ACTION, types.CodeActionOptions(CODE_ACTIONS))
    def act(params: types.CodeActionParams) -> list[types.CodeAction]:
        uri = params.text_document.uri
        document = server.document(uri)
        found, lines = server.documents.diagnostics(document.file), document.tree.lines
        asked = params.context.only
        offered: list[types.CodeAction] = []
        if asked is None or any(types.CodeActionKind.QuickFix.value.startswith(str(one)) for one in asked):
            first, last = params.range.start.line, params.range.end.line
            near = [one for one in found if one.place is not None and first <= one.place.line - 1 <= last]
            offered += [protocol.code_action(one, uri, document.file, lines) for one in actions.fixes(document, near)]
        edits = [protocol.text_edit(one, lines) for one in actions.all_fixes(document, found)]
        if edits and (asked is None or any(FIX_ALL.startswith(str(one)) for one in asked)):
            change = types.WorkspaceEdit(changes={uri: edits})
            offered.append(types.CodeAction("Fix all certain problems", FIX_ALL, edit=change))
        for one in refactoring.refactorings(document, params.range.start.line):
            # The targets of a transition are offered only if an editor requests refactorings, since they are many.
            usual = one.kind in (refactoring.ADD_STATE, refactoring.EXTRACT)
            wanted = usual if asked is None else any(one.kind.startswith(str(kind)) for kind in asked)
            if wanted and (not one.created or server.creates_files):
                offered.append(protocol.refactoring_action(one, uri, lines))
        return offered


def _showing(server: MachineServer) -> None:
    @server.feature(types.TEXT_DOCUMENT_INLAY_HINT)
    def hints(params: types.InlayHintParams) -> list[types.InlayHint]:
        document = server.document(params.text_document.uri)
        if not server.hints:
            return []
        found = actions.hints(document, params.range.start.line, params.range.end.line)
        return [
            types.InlayHint(
                protocol.position(one.line, one.column, document.tree.lines),
                one.text,
                types.InlayHintKind.Parameter,
            )
            for one in found
        ]

    @server.feature(types.TEXT_DOCUMENT_CODE_LENS)
    def lenses(params: types.CodeLensParams) -> list[types.CodeLens]:
        document = server.document(params.text_document.uri)
        line = actions.heading_line(document)
        shown = [] if line is None else [(line, title, f"maze-machine.{title.lower()}") for title in ("Run", "Test")]
        shown += [(one, text, "maze-machine.test") for one, text in server.tested(document.file).items()]
        return [
            types.CodeLens(_whole_line(one, document), types.Command(title, command, arguments=[document.file]))
            for one, title, command in shown
        ]


def _formatting(server: MachineServer) -> None:
    @server.feature(types.TEXT_DOCUMENT_FORMATTING)
    def formatting(params: types.DocumentFormattingParams) -> list[types.TextEdit] | None:
        return _formatted(server, params.text_document.uri)

    @server.feature(types.TEXT_DOCUMENT_RANGE_FORMATTING)
    def range_formatting(params: types.DocumentRangeFormattingParams) -> list[types.TextEdit] | None:
        edits = _formatted(server, params.text_document.uri)
        if edits is None:
            return None
        first, last = params.range.start.line, params.range.end.line
        return [one for one in edits if one.range.start.line >= first and one.range.end.line <= last + 1]

    @server.feature(types.TEXT_DOCUMENT_ON_TYPE_FORMATTING, types.DocumentOnTypeFormattingOptions("\n"))
    def formatted_while_typing(params: types.DocumentOnTypeFormattingParams) -> list[types.TextEdit] | None:
        """Lay out the line that was just ended."""
        edits = _formatted(server, params.text_document.uri)
        ended = params.position.line - 1
        return None if edits is None else [one for one in edits if one.range.start.line == one.range.end.line == ended]


def _whole_line(line: int, document: Document) -> types.Range:
    length = len(document.lines[line]) if line < len(document.lines) else 0
    return types.Range(types.Position(line, 0), protocol.position(line, length, document.lines))


def _formatted(server: MachineServer, uri: str) -> list[types.TextEdit] | None:
    """The lines that the formatter changes; None where the text cannot be read."""
    text = server.workspace.get_text_document(uri).source
    other = server.other(uri)
    try:
        formatted = format_text(text) if other is None else other.formatted()
    except MachineError:
        return None
    if formatted is None:
        return None
    before, after = protocol.lines_of(text), protocol.lines_of(formatted)
    if len(before) != len(after):
        whole = types.Range(types.Position(0, 0), types.Position(len(before), 0))
        return [] if formatted == text else [types.TextEdit(whole, formatted)]
    return [
        types.TextEdit(types.Range(types.Position(number, 0), protocol.position(number, len(old), before)), new)
        for number, (old, new) in enumerate(zip(before, after, strict=True))
        if old != new
    ]
