"""Where names are declared and used, what a file declares, how it is coloured."""

from __future__ import annotations

from pathlib import Path

from lsprotocol import types

from hsm.dsl.lsp import navigation, protocol
from hsm.dsl.lsp.document import Document
from hsm.dsl.lsp.machine_server import MachineServer
from hsm.dsl.lsp.references import references_everywhere


def add(server: MachineServer) -> None:
    """Have a server answer them."""

    @server.feature(types.TEXT_DOCUMENT_DEFINITION)
    def define(params: types.DefinitionParams) -> types.Location | None:
        file = server.file(params.text_document.uri)
        found = file.definition(*protocol.characters(params.position, file.lines))
        if found is None:
            return None
        lines = file.lines if found.file == file.file else ()
        return types.Location(protocol.uri_of(found.file), protocol.range_of(found, lines))

    @server.feature(types.TEXT_DOCUMENT_REFERENCES)
    def refer(params: types.ReferenceParams) -> list[types.Location]:
        file = server.file(params.text_document.uri)
        line, column = protocol.characters(params.position, file.lines)
        found = references_everywhere(file, line, column, server.around(file))
        return [
            types.Location(protocol.uri_of(of.file), protocol.range_of_name(one, of.lines))
            for of, one in found
            if params.context.include_declaration or not one.declares
        ]

    @server.feature(types.TEXT_DOCUMENT_DOCUMENT_HIGHLIGHT)
    def highlight(params: types.DocumentHighlightParams) -> list[types.DocumentHighlight]:
        file = server.file(params.text_document.uri)
        found = references_everywhere(file, *protocol.characters(params.position, file.lines), ())
        kinds = {True: types.DocumentHighlightKind.Write, False: types.DocumentHighlightKind.Read}
        return [
            types.DocumentHighlight(protocol.range_of_name(one, file.lines), kinds[one.declares])
            for of, one in found
            if of.file == file.file
        ]

    @server.feature(types.TEXT_DOCUMENT_DOCUMENT_SYMBOL)
    def symbols(params: types.DocumentSymbolParams) -> list[types.DocumentSymbol]:
        file = server.file(params.text_document.uri)
        return [protocol.symbol(one, file.lines) for one in file.outline()]

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
        return [
            types.FoldingRange(first, last, kind=types.FoldingRangeKind.Comment if comment else None)
            for first, last, comment in server.file(params.text_document.uri).folds()
        ]

    @server.feature(types.TEXT_DOCUMENT_SEMANTIC_TOKENS_FULL, protocol.LEGEND)
    def colours(params: types.SemanticTokensParams) -> types.SemanticTokens:
        file = server.file(params.text_document.uri)
        return protocol.semantic_tokens(file.colours(), file.lines)


def _symbols_of(document: Document, query: str) -> list[types.SymbolInformation]:
    """The declarations of a file whose names contain what is searched for."""
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
