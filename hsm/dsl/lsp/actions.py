"""What an editor offers to do: quick fixes for diagnostics, hints between the words, lenses above machines."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from hsm.dsl.lsp.document import Document
from hsm.dsl.lsp.navigation import state_around, written
from hsm.dsl.lsp.occurrences import Role
from hsm.dsl.semantics.values import SIMPLE_TYPES
from hsm.dsl.syntax import ast
from hsm.model.diagnostics import Diagnostic, Severity
from hsm.model.types import NUMBER, Quantity
from hsm.model.unparse import value_text
from hsm.model.values import dataclass

_MEANT = re.compile(r"did you mean `([^`]+)`\?")
_MISSING = re.compile(r"add `on ([^`]+?) -> \.\.\.`")


@dataclass(frozen=True, slots=True)
class Edit:
    """A replacement: from a position to another (lines and columns from 0) by a text."""

    line: int
    column: int
    end_line: int
    end_column: int
    text: str


@dataclass(frozen=True, slots=True)
class Fix:
    """Something that fixes a diagnostic.

    Attributes:
        title: what it does.
        diagnostic: what it fixes.
        edits: how.
        certain: whether it can be applied without review, together with all others of its kind.
        file: the file that is changed; empty for that of the diagnostic.
    """

    title: str
    diagnostic: Diagnostic
    edits: tuple[Edit, ...]
    certain: bool = False
    file: str = ""


@dataclass(frozen=True, slots=True)
class Hint:
    """A text that is shown at a position and is not in the file."""

    line: int
    column: int
    text: str


def meant(file: str, found: Iterable[Diagnostic]) -> Iterator[Fix]:
    """The names that were probably meant, for the diagnostics of a file of either language."""
    for one in found:
        name, place = _MEANT.search(one.suggestion or ""), one.place
        if name is not None and place is not None and place.file == file and place.end_line == place.line:
            edit = Edit(place.line - 1, place.column - 1, place.line - 1, place.end_column - 1, name[1])
            yield Fix(f"Change to `{name[1]}`", one, (edit,), certain=True)


def fixes(document: Document, found: Iterable[Diagnostic]) -> Iterator[Fix]:
    """Quick fixes for the diagnostics of this file."""
    for one in found:
        if one.place is None or one.place.file != document.file:
            continue
        line, column = one.place.line - 1, one.place.column - 1
        text = document.tree.lines[line] if line < len(document.tree.lines) else ""
        yield from meant(document.file, [one])
        missing = _MISSING.fullmatch(one.suggestion or "")
        if missing is not None:
            indentation = " " * (len(text) - len(text.lstrip()))
            target = state_around(document, line).name or "state"
            edit = Edit(line, len(text), line, len(text), f"\n{indentation}on {missing[1]} -> {target}")
            yield Fix(f"Add `on {missing[1]}`", one, (edit,))
        if one.place.end_line == one.place.line:
            yield from _declarations(document, one, text[column : one.place.end_column - 1])
        if one.severity is not Severity.ERROR and "#" not in text:
            edit = Edit(line, len(text), line, len(text), f"    # accept {one.code}")
            yield Fix(f"Accept {one.code} here", one, (edit,))


def _declarations(document: Document, found: Diagnostic, name: str) -> Iterator[Fix]:
    """The edits that declare an unknown name: in the file, or in the Python code of the machine's library."""
    if not _NAME.fullmatch(name):
        return
    if found.code == "E0201" and "." not in name:
        last = len(document.tree.lines) - 1
        end = len(document.tree.lines[last])
        yield Fix(f"Declare state `{name}`", found, (Edit(last, end, last, end, f"\n\nstate {name}\n"),))
    written = {"E0202": f"var {name} : bool = false", "E0203": f"event {name}"}.get(found.code)
    heading = heading_line(document)
    if written is not None and heading is not None and "." not in name:
        end = len(document.tree.lines[heading])
        yield Fix(f"Declare `{written}`", found, (Edit(heading, end, heading, end, f"\n\n{written}"),))
    kind = {"E0202": "signal", "E0204": "activity", "E0205": "action"}.get(found.code)
    source = library_source(document) if kind is not None else None
    if kind is not None and source is not None:
        file, variable, lines = source
        edit = Edit(lines, 0, lines, 0, _STUBS[kind].format(library=variable, name=name, own=name.replace(".", "_")))
        yield Fix(f"Declare {kind} `{name}` in {Path(file).name}", found, (edit,), file=file)


def library_source(document: Document) -> tuple[str, str, int] | None:
    """The Python code of the author's own library: its file, the library's name in it, its number of lines.

    It lies in the folder of the machine, or below the one around that; packages are none of the author's. None if there
    is none.
    """
    library, around = document.library, Path(document.file).resolve().parent.parent
    declared: list[Callable[..., object]] = [one.function for one in library.signals.values()]
    declared += [one.function for one in library.actions.values()]
    declared += [one.factory for one in library.activities.values()]
    for source in declared:
        try:
            file = inspect.getsourcefile(written(source))
            text = "" if file is None else Path(file).read_text(encoding="utf-8")
        except (TypeError, OSError, UnicodeDecodeError):
            continue
        named = _LIBRARY.search(text)
        own = file is not None and Path(file).resolve().is_relative_to(around) and "site-packages" not in file
        if file is not None and own and named is not None:
            return file, named[1], text.count("\n")
    return None


_NAME = re.compile(r"[A-Za-z_][\w.]*")
_LIBRARY = re.compile(r"^([A-Za-z_]\w*)(?:\s*:[^=\n]+)?\s*=\s*(?:hsm\.)?Library\(", re.MULTILINE)
_STUBS = {
    "signal": (
        '\n\n@{library}.signal("{name}")\ndef {own}(facts) -> bool:\n    """Say what it is."""\n    return False\n'
    ),
    "action": '\n\n@{library}.action("{name}")\ndef {own}(facts) -> None:\n    """Say what it does."""\n',
    "activity": (
        '\n\n@{library}.activity("{name}")\nclass {own}:\n    """Say what it does."""\n\n'
        '    def tick(self, facts):\n        """Do the part of one tick."""\n'
    ),
}


def all_fixes(possible: Iterable[Fix]) -> tuple[Edit, ...]:
    """The edits of everything that is certain, without two at the same place."""
    edits: dict[tuple[int, int], Edit] = {}
    for fix in possible:
        if fix.certain:
            for edit in fix.edits:
                edits.setdefault((edit.line, edit.column), edit)
    return tuple(edits.values())


def hints(document: Document, first: int, last: int) -> Iterator[Hint]:
    """What some lines leave unsaid: the defaults of arguments, and the units that quantities are passed in.

    Args:
        document: the file.
        first: the first line.
        last: the last line.
    """
    yield from _defaults(document, first, last)
    yield from _units(document, first, last)


def _units(document: Document, first: int, last: int) -> Iterator[Hint]:
    """The SI unit of a declared quantity, after its type, where the line does not show it."""
    for one in document.occurrences:
        kind = SIMPLE_TYPES.get(one.name) if one.role is Role.TYPE else None
        if isinstance(kind, Quantity) and kind != NUMBER and first <= one.line <= last:
            written = document.lines[one.line].partition("#")[0][one.end :]
            if not re.search(rf"(?<![\w/]){re.escape(kind.si_unit)}(?![\w/^])", written):
                yield Hint(one.line, one.end, f" in {kind.si_unit}")


def _defaults(document: Document, first: int, last: int) -> Iterator[Hint]:
    """The defaults of the arguments that calls on some lines leave out, at the closing brackets."""
    for call in _calls(document.tree.items):
        line = call.closing.line - 1
        if not first <= line <= last:
            continue
        parameters = document.parameters_of(str(call.name))
        given = {str(one.name) for one in call.arguments if isinstance(one, ast.Named)}
        unnamed = sum(not isinstance(one, ast.Named) for one in call.arguments)
        left_out = [one for one in parameters[unnamed:] if one.name not in given and not one.required]
        if left_out:
            listed = ", ".join(f"{one.name} = {value_text(one.default, one.type)}" for one in left_out)
            yield Hint(line, call.closing.column - 1, f", {listed}" if call.arguments else listed)


def heading_line(document: Document) -> int | None:
    """The line that names the machine."""
    found = (one.line for one in document.occurrences if one.role is Role.MACHINE and one.declares)
    return next(found, None)


def _calls(items: Iterable[ast.Item]) -> Iterator[ast.CallSyntax]:
    """The calls of activities and actions; signals need no hint."""
    pending = list(items)
    while pending:
        match pending.pop():
            case ast.StateBlock(items=inner) | ast.BadLine(items=inner):
                pending.extend(inner)
            case ast.DoLine(call):
                yield call
            case ast.EntryLine(actions) | ast.ExitLine(actions):
                yield from (one for one in actions if isinstance(one, ast.CallSyntax))
            case ast.TransitionLine(actions=actions) | ast.InitialLine(actions=actions):
                yield from (one for one in actions if isinstance(one, ast.CallSyntax))
