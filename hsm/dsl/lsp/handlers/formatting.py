"""A file, some lines, or the line that was just ended, laid out."""

from __future__ import annotations

from lsprotocol import types

from hsm.dsl.lsp import protocol
from hsm.dsl.lsp.machine_server import MachineServer


def add(server: MachineServer) -> None:
    """Have a server answer them."""

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


def _formatted(server: MachineServer, uri: str) -> list[types.TextEdit] | None:
    """The lines that the formatter changes; None where the text cannot be read."""
    text = server.workspace.get_text_document(uri).source
    formatted = server.file(uri).formatted()
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
