"""What is shown between the lines and beside them: defaults and units, coverage, commands."""

from __future__ import annotations

from lsprotocol import types

from hsm.dsl.lsp import actions, protocol
from hsm.dsl.lsp.document import Document
from hsm.dsl.lsp.machine_server import MachineServer


def add(server: MachineServer) -> None:
    """Have a server answer them."""

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


def _whole_line(line: int, document: Document) -> types.Range:
    length = len(document.lines[line]) if line < len(document.lines) else 0
    return types.Range(types.Position(line, 0), protocol.position(line, length, document.lines))
