"""What the editor says of its files and its settings, and what it asks of their faults."""

from __future__ import annotations

import asyncio

from lsprotocol import types

from hsm.dsl.lsp import protocol
from hsm.dsl.lsp.machine_server import MachineServer

_BREATH = 0.002
"""How long a request for diagnostics yields to other requests, s."""
_PULL = types.DiagnosticOptions(inter_file_dependencies=True, workspace_diagnostics=False, identifier="maze-machine")


def add(server: MachineServer) -> None:
    """Have a server answer them."""

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
