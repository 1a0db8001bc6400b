"""Changes of a machine that an editor or its diagram offers: another state, another target."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from hsm.dsl.lsp.actions import Edit
from hsm.dsl.lsp.editing import Document, SymbolKind
from hsm.dsl.lsp.navigation import OutlineSymbol, block_end, outline
from hsm.dsl.lsp.occurrences import Role

ADD_STATE = "refactor.rewrite.maze-machine.addState"
RETARGET = "refactor.rewrite.maze-machine.retarget"
_INDENT = "    "
_TARGET = re.compile(r"(?:->|=>)\s*([A-Za-z_][\w.]*)(?!\s*,)")


@dataclass(frozen=True, slots=True)
class Refactoring:
    """A change that keeps the file valid or leaves a plain gap to fill.

    Attributes:
        title: what it does.
        kind: the protocol's name for what it is.
        edits: how.
    """

    title: str
    kind: str
    edits: tuple[Edit, ...]


def refactorings(document: Document, line: int) -> Iterator[Refactoring]:
    """What can be done on a line (from 0): states beside and inside the one it declares, targets of its transition."""
    state = next((one for one in _states(outline(document)) if one.place.line == line), None)
    if state is not None:
        yield from _new_states(document, state)
    yield from _targets(document, line)


def _states(symbols: list[OutlineSymbol]) -> Iterator[OutlineSymbol]:
    pending = [one for one in symbols if one.role is Role.STATE]
    while pending:
        one = pending.pop()
        yield one
        pending += one.children


def _new_states(document: Document, state: OutlineSymbol) -> Iterator[Refactoring]:
    name = _fresh(document)
    line, pad = state.place.line, " " * state.whole.column
    yield Refactoring(f"Add a state after `{state.name}`", ADD_STATE, (_after(document, line, f"{pad}state {name}"),))
    if state.detail in ("final", "parallel") or state.detail.startswith("instance of"):
        return
    inner = f"{pad}{_INDENT}"
    new = f"{inner}state {name}" if state.children else f"{inner}initial {name}\n\n{inner}state {name}"
    yield Refactoring(f"Add a state inside `{state.name}`", ADD_STATE, (_after(document, line, new),))


def _after(document: Document, line: int, text: str) -> Edit:
    """What puts a text below the block that begins on a line, with a blank line between."""
    last = block_end(document, line)
    end = len(document.tree.lines[last])
    return Edit(last, end, last, end, f"\n\n{text}")


def _fresh(document: Document) -> str:
    taken = {one.name for one in document.occurrences}
    number = 1
    while (name := f"new_state{number if number > 1 else ''}") in taken:
        number += 1
    return name


def _targets(document: Document, line: int) -> Iterator[Refactoring]:
    text = document.tree.lines[line].partition("#")[0] if line < len(document.tree.lines) else ""
    match = _TARGET.search(text)
    if match is None:
        return
    begin, end = match.span(1)
    for entry in document.completions(line, begin):
        if entry.kind is SymbolKind.STATE and entry.label != match[1]:
            edit = Edit(line, begin, line, end, entry.label)
            yield Refactoring(f"Change the target to `{entry.label}`", RETARGET, (edit,))
