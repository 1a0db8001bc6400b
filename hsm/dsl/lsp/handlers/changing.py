"""Changes of files that the editor makes: new names, quick fixes, other shapes of a machine."""

from __future__ import annotations

from functools import partial

from lsprotocol import types
from pygls.exceptions import JsonRpcInvalidParams

from hsm.dsl.lsp import actions, protocol, refactoring
from hsm.dsl.lsp.machine_server import MachineServer
from hsm.dsl.lsp.references import RenameError, renamable, rename

FIX_ALL = "source.fixAll.maze-machine"
CODE_ACTIONS = (
    types.CodeActionKind.QuickFix,
    FIX_ALL,
    refactoring.ADD_STATE,
    refactoring.EXTRACT,
    refactoring.RETARGET,
)
"""The kinds of code actions."""


def add(server: MachineServer) -> None:
    """Have a server answer them."""

    @server.feature(types.TEXT_DOCUMENT_PREPARE_RENAME)
    def prepare(params: types.PrepareRenameParams) -> types.Range:
        file = server.file(params.text_document.uri)
        try:
            here = renamable(file, *protocol.characters(params.position, file.lines))
        except RenameError as error:
            raise JsonRpcInvalidParams(str(error)) from None
        return protocol.range_of_name(here, file.lines)

    @server.feature(types.TEXT_DOCUMENT_RENAME, types.RenameOptions(prepare_provider=True))
    def change_name(params: types.RenameParams) -> types.WorkspaceEdit:
        file = server.file(params.text_document.uri)
        line, column = protocol.characters(params.position, file.lines)
        try:
            found = rename(file, line, column, params.new_name, server.around(file))
        except RenameError as error:
            raise JsonRpcInvalidParams(str(error)) from None
        changes: dict[str, list[types.TextEdit]] = {}
        for of, one in found:
            edit = types.TextEdit(protocol.range_of_name(one, of.lines), params.new_name)
            changes.setdefault(protocol.uri_of(of.file), []).append(edit)
        return types.WorkspaceEdit(changes=changes)

    @server.feature(types.TEXT_DOCUMENT_CODE_ACTION, types.CodeActionOptions(CODE_ACTIONS))
    def act(params: types.CodeActionParams) -> list[types.CodeAction]:
        uri = params.text_document.uri
        document, other = server.document(uri), server.other(uri)
        if other is None:
            found, lines = server.documents.diagnostics(document.file), document.lines
            fixes = partial(actions.fixes, document)
        else:
            found, lines = tuple(other.diagnostics()), other.lines
            fixes = partial(actions.meant, other.file)
        asked = params.context.only
        offered: list[types.CodeAction] = []
        if asked is None or any(types.CodeActionKind.QuickFix.value.startswith(str(one)) for one in asked):
            first, last = params.range.start.line, params.range.end.line
            near = [one for one in found if one.place is not None and first <= one.place.line - 1 <= last]
            offered += [protocol.code_action(one, uri, document.file, lines) for one in fixes(near)]
        edits = [protocol.text_edit(one, lines) for one in actions.all_fixes(fixes(found))]
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
