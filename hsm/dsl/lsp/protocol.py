"""Conversions to the protocol's terms: positions in UTF-16 code units, kinds, edits."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from lsprotocol import types
from pygls import uris

from hsm.dsl.lsp.actions import Edit, Fix
from hsm.dsl.lsp.entries import Entry, OpenCall, SymbolKind
from hsm.dsl.lsp.navigation import Colour, Coloured, OutlineSymbol, Span
from hsm.dsl.lsp.occurrences import NameOccurrence, Role
from hsm.dsl.lsp.refactoring import Refactoring
from hsm.model.diagnostics import Diagnostic, Place, Severity
from hsm.model.unparse import shown_text

SEVERITIES = {
    Severity.ERROR: types.DiagnosticSeverity.Error,
    Severity.WARNING: types.DiagnosticSeverity.Warning,
    Severity.NOTE: types.DiagnosticSeverity.Information,
}
KINDS = {
    SymbolKind.KEYWORD: types.CompletionItemKind.Keyword,
    SymbolKind.STATE: types.CompletionItemKind.Class,
    SymbolKind.SIGNAL: types.CompletionItemKind.Property,
    SymbolKind.ACTIVITY: types.CompletionItemKind.Method,
    SymbolKind.ACTION: types.CompletionItemKind.Function,
    SymbolKind.EVENT: types.CompletionItemKind.Event,
    SymbolKind.VARIABLE: types.CompletionItemKind.Variable,
    SymbolKind.DEFINITION: types.CompletionItemKind.Variable,
    SymbolKind.PARAMETER: types.CompletionItemKind.Constant,
    SymbolKind.ARGUMENT: types.CompletionItemKind.Field,
    SymbolKind.FUNCTION: types.CompletionItemKind.Function,
    SymbolKind.PROPERTY: types.CompletionItemKind.Property,
    SymbolKind.VALUE: types.CompletionItemKind.EnumMember,
    SymbolKind.TYPE: types.CompletionItemKind.TypeParameter,
    SymbolKind.UNIT: types.CompletionItemKind.Unit,
    SymbolKind.MACHINE: types.CompletionItemKind.Module,
}
SYMBOLS = {
    Role.STATE: types.SymbolKind.Class,
    Role.PARAMETER: types.SymbolKind.Constant,
    Role.VARIABLE: types.SymbolKind.Variable,
    Role.EVENT: types.SymbolKind.Event,
    Role.PROPERTY: types.SymbolKind.Interface,
}
LEGEND = types.SemanticTokensLegend(
    [one.value for one in (*Role, *Colour)], [types.SemanticTokenModifiers.Declaration.value]
)
UNUSED = ("W06",)
"""The prefix of the codes for unused names."""
DEEPEST = 40
"""How deep an outline is shown."""


def path_of(uri: str) -> str:
    """The file of a document."""
    return uris.to_fs_path(uri) or uri


def uri_of(file: str) -> str:
    """The document of a file."""
    return uris.from_fs_path(file) or file


def lines_of(text: str) -> list[str]:
    """The lines of a text."""
    return text.replace("\r\n", "\n").split("\n")


def characters(position: types.Position, lines: Sequence[str]) -> tuple[int, int]:
    """Line and column in characters; the protocol counts columns in UTF-16 code units."""
    text = lines[position.line] if position.line < len(lines) else ""
    units = text.encode("utf-16-le")[: 2 * position.character]
    return position.line, len(units.decode("utf-16-le", errors="ignore"))


def position(line: int, column: int, lines: Sequence[str]) -> types.Position:
    """A position in the protocol's units, of a line and a column in characters."""
    before = lines[line][:column] if line < len(lines) else " " * column
    return types.Position(line, len(before.encode("utf-16-le")) // 2)


def range_of(span: Span, lines: Sequence[str]) -> types.Range:
    """A stretch of a file."""
    return types.Range(position(span.line, span.column, lines), position(span.end_line, span.end_column, lines))


def range_of_place(place: Place, lines: Sequence[str]) -> types.Range:
    """The place of a diagnostic."""
    return types.Range(
        position(place.line - 1, place.column - 1, lines), position(place.end_line - 1, place.end_column - 1, lines)
    )


def range_of_name(one: NameOccurrence, lines: Sequence[str]) -> types.Range:
    """A name."""
    return types.Range(position(one.line, one.column, lines), position(one.line, one.end, lines))


def text_edit(edit: Edit, lines: Sequence[str]) -> types.TextEdit:
    """A replacement."""
    where = types.Range(position(edit.line, edit.column, lines), position(edit.end_line, edit.end_column, lines))
    return types.TextEdit(where, edit.text)


def diagnostic(
    found: Diagnostic, path: str, lines: Sequence[str], pages: Mapping[str, str] | None = None
) -> types.Diagnostic:
    """A diagnostic of a file, with the places that belong to it and, where ``pages`` has one, a link to its code."""
    link = (pages or {}).get(found.code)
    place = found.place or Place(path, 1, 1, 1, 1)
    hint = f"\n{found.suggestion}" if found.suggestion else ""
    related = [
        types.DiagnosticRelatedInformation(
            types.Location(uri_of(one.place.file), range_of_place(one.place, lines if one.place.file == path else ())),
            one.message,
        )
        for one in found.related
    ]
    return types.Diagnostic(
        range=range_of_place(place, lines),
        message=found.message + hint,
        severity=SEVERITIES[found.severity],
        code=found.code,
        code_description=None if link is None else types.CodeDescription(link),
        source="maze-machine",
        tags=[types.DiagnosticTag.Unnecessary] if found.code.startswith(UNUSED) else None,
        related_information=related,
    )


def completion(entry: Entry, place: int, replaced: types.Range, *, snippets: bool) -> types.CompletionItem:
    """A completion at a position, in place of what was typed.

    Args:
        entry: what.
        place: its place among the completions; editors show those that fit as well in this order.
        replaced: what was typed.
        snippets: whether the editor fills in places.
    """
    snippet = snippets and bool(entry.snippet)
    return types.CompletionItem(
        label=entry.label,
        kind=KINDS[entry.kind],
        detail=entry.detail or None,
        documentation=types.MarkupContent(types.MarkupKind.Markdown, entry.doc) if entry.doc else None,
        filter_text=entry.label,
        sort_text=f"{place:05}",
        insert_text_format=types.InsertTextFormat.Snippet if snippet else types.InsertTextFormat.PlainText,
        text_edit=types.TextEdit(replaced, entry.snippet if snippet else entry.label),
    )


def markdown(entry: Entry) -> types.MarkupContent:
    """What is shown about a name."""
    shown = entry.detail if entry.detail.startswith(entry.label) else f"{entry.label} : {entry.detail}".rstrip(" :")
    head = f"`{shown}` ({entry.kind.value})"
    return types.MarkupContent(types.MarkupKind.Markdown, f"{head}\n\n{entry.doc}" if entry.doc else head)


def signature_help(call: OpenCall) -> types.SignatureHelp:
    """The signature of a call, and the active parameter."""
    parameters = []
    for one in call.parameters:
        text = f"{one.name} : {one.type}"
        text += "" if one.required else f" = {shown_text(one.default, one.type)}"
        parameters.append(types.ParameterInformation(text))
    label = f"{call.name}({', '.join(str(one.label) for one in parameters)})"
    doc = types.MarkupContent(types.MarkupKind.Markdown, call.doc) if call.doc else None
    signature = types.SignatureInformation(label, doc, parameters, call.active)
    return types.SignatureHelp([signature], 0, call.active)


def symbol(one: OutlineSymbol, lines: Sequence[str], depth: int = 0) -> types.DocumentSymbol:
    """A declaration of the outline; nested as deep as an editor can show it."""
    inner = [symbol(child, lines, depth + 1) for child in one.children] if depth < DEEPEST else []
    kind = types.SymbolKind.Event if one.detail == "final" else SYMBOLS[one.role]
    return types.DocumentSymbol(
        one.name, kind, range_of(one.whole, lines), range_of(one.place, lines), detail=one.detail, children=inner
    )


def semantic_tokens(coloured: Iterable[Coloured], lines: Sequence[str]) -> types.SemanticTokens:
    """Colours as the protocol packs them: five numbers each, relative to the previous one."""
    kinds = {kind: number for number, kind in enumerate((*Role, *Colour))}
    data: list[int] = []
    line = start = 0
    for one in coloured:
        begin = position(one.line, one.column, lines).character
        length = position(one.line, one.column + one.length, lines).character - begin
        start = start if one.line == line else 0
        data += (one.line - line, begin - start, length, kinds[one.kind], int(one.declares))
        line, start = one.line, begin
    return types.SemanticTokens(data)


def code_action(fix: Fix, uri: str, path: str, lines: Sequence[str]) -> types.CodeAction:
    """A quick fix."""
    return types.CodeAction(
        title=fix.title,
        kind=types.CodeActionKind.QuickFix,
        diagnostics=[diagnostic(fix.diagnostic, path, lines)],
        is_preferred=fix.certain,
        edit=types.WorkspaceEdit(
            changes={uri_of(fix.file) if fix.file else uri: [text_edit(one, lines) for one in fix.edits]}
        ),
    )


def refactoring_action(found: Refactoring, uri: str, lines: Sequence[str]) -> types.CodeAction:
    """A change of the file, perhaps with files that it makes."""
    edits = [text_edit(one, lines) for one in found.edits]
    if not found.created:
        return types.CodeAction(found.title, found.kind, edit=types.WorkspaceEdit(changes={uri: edits}))
    changes: list[types.TextDocumentEdit | types.CreateFile | types.RenameFile | types.DeleteFile] = []
    for path, text in found.created:
        made, begin = uri_of(str(path)), types.Position(0, 0)
        changes.append(types.CreateFile(made, options=types.CreateFileOptions(overwrite=False)))
        identifier = types.OptionalVersionedTextDocumentIdentifier(made)
        changes.append(types.TextDocumentEdit(identifier, [types.TextEdit(types.Range(begin, begin), text)]))
    changes.append(types.TextDocumentEdit(types.OptionalVersionedTextDocumentIdentifier(uri), list(edits)))
    return types.CodeAction(found.title, found.kind, edit=types.WorkspaceEdit(document_changes=changes))
