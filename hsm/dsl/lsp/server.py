"""The language server: findings while one types, completion, hovering, definitions, outline and formatting.

It needs the extra ``lsp``. ``hsm.dsl.lsp.editing`` knows the answers; here they are put into the protocol's terms.
"""

from __future__ import annotations

from collections.abc import Sequence

from lsprotocol import types
from pygls import uris
from pygls.lsp.server import LanguageServer

from hsm.dsl.format.formatter import format_text
from hsm.dsl.loading import check_text
from hsm.dsl.lsp.editing import Document, Entry, Symbol, SymbolKind
from hsm.model.chart import StateKind
from hsm.model.diagnostics import Diagnostic, MachineError, Place, Severity
from hsm.model.registry import Library

_SEVERITIES = {
    Severity.ERROR: types.DiagnosticSeverity.Error,
    Severity.WARNING: types.DiagnosticSeverity.Warning,
    Severity.NOTE: types.DiagnosticSeverity.Information,
}
_KINDS = {
    SymbolKind.KEYWORD: types.CompletionItemKind.Keyword,
    SymbolKind.STATE: types.CompletionItemKind.Class,
    SymbolKind.SIGNAL: types.CompletionItemKind.Property,
    SymbolKind.ACTIVITY: types.CompletionItemKind.Method,
    SymbolKind.ACTION: types.CompletionItemKind.Function,
    SymbolKind.EVENT: types.CompletionItemKind.Event,
    SymbolKind.VARIABLE: types.CompletionItemKind.Variable,
    SymbolKind.PARAMETER: types.CompletionItemKind.Constant,
    SymbolKind.ARGUMENT: types.CompletionItemKind.Field,
    SymbolKind.FUNCTION: types.CompletionItemKind.Function,
    SymbolKind.VALUE: types.CompletionItemKind.EnumMember,
    SymbolKind.TYPE: types.CompletionItemKind.TypeParameter,
    SymbolKind.UNIT: types.CompletionItemKind.Unit,
    SymbolKind.MACHINE: types.CompletionItemKind.Module,
}

_DEEPEST = 40


def make_server(library: Library, version: str) -> LanguageServer:
    """A server for machines that are written against a library.

    Args:
        library: the registry.
        version: of this program.
    """
    server = LanguageServer("maze-machine", version, text_document_sync_kind=types.TextDocumentSyncKind.Full)

    def document(uri: str) -> Document:
        return Document(server.workspace.get_text_document(uri).source, _path(uri), library)

    def publish(uri: str) -> None:
        text = server.workspace.get_text_document(uri).source
        path = _path(uri)
        found = [
            one
            for one in check_text(text, library, path).diagnostics
            if one.place is not None and one.place.file == path
        ]
        lines = _lines(text)
        diagnostics = [_diagnostic(one, path, lines) for one in found]
        server.text_document_publish_diagnostics(types.PublishDiagnosticsParams(uri, diagnostics))

    @server.feature(types.TEXT_DOCUMENT_DID_OPEN)
    def opened(params: types.DidOpenTextDocumentParams) -> None:
        publish(params.text_document.uri)

    @server.feature(types.TEXT_DOCUMENT_DID_CHANGE)
    def changed(params: types.DidChangeTextDocumentParams) -> None:
        publish(params.text_document.uri)

    @server.feature(types.TEXT_DOCUMENT_COMPLETION, types.CompletionOptions(trigger_characters=[".", " ", "("]))
    def complete(params: types.CompletionParams) -> list[types.CompletionItem]:
        found = document(params.text_document.uri)
        return [_item(one) for one in found.completions(*_position(params.position, found.tree.lines))]

    @server.feature(types.TEXT_DOCUMENT_HOVER)
    def hover(params: types.HoverParams) -> types.Hover | None:
        found = document(params.text_document.uri)
        entry = found.hover(*_position(params.position, found.tree.lines))
        return None if entry is None else types.Hover(types.MarkupContent(types.MarkupKind.Markdown, _markdown(entry)))

    @server.feature(types.TEXT_DOCUMENT_DEFINITION)
    def define(params: types.DefinitionParams) -> types.Location | None:
        found = document(params.text_document.uri)
        place = found.definition(*_position(params.position, found.tree.lines))
        if place is None:
            return None
        lines = found.tree.lines if place.file == found.file else ()
        return types.Location(uris.from_fs_path(place.file) or params.text_document.uri, _range(place, lines))

    @server.feature(types.TEXT_DOCUMENT_DOCUMENT_SYMBOL)
    def symbols(params: types.DocumentSymbolParams) -> list[types.DocumentSymbol]:
        found = document(params.text_document.uri)
        return [_symbol(one, found.tree.lines) for one in found.symbols()]

    @server.feature(types.TEXT_DOCUMENT_FORMATTING)
    def formatting(params: types.DocumentFormattingParams) -> list[types.TextEdit] | None:
        text = server.workspace.get_text_document(params.text_document.uri).source
        try:
            formatted = format_text(text)
        except MachineError:
            return None
        whole = types.Range(types.Position(0, 0), types.Position(len(_lines(text)), 0))
        return [] if formatted == text else [types.TextEdit(whole, formatted)]

    return server


def _path(uri: str) -> str:
    return uris.to_fs_path(uri) or uri


def _lines(text: str) -> list[str]:
    return text.replace("\r\n", "\n").split("\n")


def _position(position: types.Position, lines: Sequence[str]) -> tuple[int, int]:
    """Line and column in characters; the protocol counts columns in UTF-16 code units."""
    text = lines[position.line] if position.line < len(lines) else ""
    units = text.encode("utf-16-le")[: 2 * position.character]
    return position.line, len(units.decode("utf-16-le", errors="ignore"))


def _range(place: Place, lines: Sequence[str]) -> types.Range:
    return types.Range(
        _protocol_position(place.line, place.column, lines), _protocol_position(place.end_line, place.end_column, lines)
    )


def _protocol_position(line: int, column: int, lines: Sequence[str]) -> types.Position:
    before = lines[line - 1][: column - 1] if line <= len(lines) else " " * (column - 1)
    return types.Position(line - 1, len(before.encode("utf-16-le")) // 2)


def _diagnostic(found: Diagnostic, path: str, lines: Sequence[str]) -> types.Diagnostic:
    assert found.place is not None
    hint = f"\n{found.suggestion}" if found.suggestion else ""
    related = [
        types.DiagnosticRelatedInformation(
            types.Location(
                uris.from_fs_path(one.place.file) or one.place.file,
                _range(one.place, lines if one.place.file == path else ()),
            ),
            one.message,
        )
        for one in found.related
    ]
    return types.Diagnostic(
        range=_range(found.place, lines),
        message=found.message + hint,
        severity=_SEVERITIES[found.severity],
        code=found.code,
        source="maze-machine",
        related_information=related,
    )


def _item(entry: Entry) -> types.CompletionItem:
    return types.CompletionItem(
        label=entry.label,
        kind=_KINDS[entry.kind],
        detail=entry.detail or None,
        documentation=types.MarkupContent(types.MarkupKind.Markdown, entry.doc) if entry.doc else None,
    )


def _markdown(entry: Entry) -> str:
    told = entry.detail if entry.detail.startswith(entry.label) else f"{entry.label} : {entry.detail}".rstrip(" :")
    head = f"`{told}` ({entry.kind.value})"
    return f"{head}\n\n{entry.doc}" if entry.doc else head


def _symbol(symbol: Symbol, lines: Sequence[str], depth: int = 0) -> types.DocumentSymbol:
    """A state of the outline; nested as deep as an editor can show it."""
    kind = types.SymbolKind.Event if symbol.kind is StateKind.FINAL else types.SymbolKind.Class
    inner = [_symbol(one, lines, depth + 1) for one in symbol.children] if depth < _DEEPEST else []
    place = _range(symbol.place, lines)
    return types.DocumentSymbol(symbol.name, kind, place, place, detail=symbol.kind.value, children=inner)
