"""What could be written, what a call takes, what a name is."""

from __future__ import annotations

from lsprotocol import types

from hsm.dsl.lsp import protocol
from hsm.dsl.lsp.machine_server import MachineServer


def add(server: MachineServer) -> None:
    """Have a server answer them."""

    @server.feature(types.TEXT_DOCUMENT_COMPLETION, types.CompletionOptions(trigger_characters=[".", " ", "("]))
    def complete(params: types.CompletionParams) -> list[types.CompletionItem]:
        file = server.file(params.text_document.uri)
        lines = file.lines
        line, column = protocol.characters(params.position, lines)
        begin = column - len(file.typed(line, column))
        replaced = types.Range(protocol.position(line, begin, lines), params.position)
        found = file.completions(line, column)
        return [protocol.completion(one, place, replaced, snippets=server.snippets) for place, one in enumerate(found)]

    @server.feature(types.TEXT_DOCUMENT_SIGNATURE_HELP, types.SignatureHelpOptions(["(", ","]))
    def signature(params: types.SignatureHelpParams) -> types.SignatureHelp | None:
        file = server.file(params.text_document.uri)
        call = file.open_call(*protocol.characters(params.position, file.lines))
        return None if call is None else protocol.signature_help(call)

    @server.feature(types.TEXT_DOCUMENT_HOVER)
    def hover(params: types.HoverParams) -> types.Hover | None:
        file = server.file(params.text_document.uri)
        entry = file.hover(*protocol.characters(params.position, file.lines))
        return None if entry is None else types.Hover(protocol.markdown(entry))
