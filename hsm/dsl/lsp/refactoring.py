"""Refactorings that an editor or its diagram offers: another state, another target."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from hsm.dsl.lsp import completion
from hsm.dsl.lsp.actions import Edit
from hsm.dsl.lsp.document import Document
from hsm.dsl.lsp.entries import SymbolKind
from hsm.dsl.lsp.navigation import OutlineSymbol, block_end, outline
from hsm.dsl.lsp.occurrences import NameOccurrence, Role
from hsm.dsl.syntax.sources import SUFFIX
from hsm.model.values import dataclass

ADD_STATE = "refactor.rewrite.maze-machine.addState"
EXTRACT = "refactor.extract.maze-machine.submachine"
RETARGET = "refactor.rewrite.maze-machine.retarget"
_INDENT = "    "
_TARGET = re.compile(r"(?:->|=>)\s*([A-Za-z_][\w.]*)(?!\s*,)")


@dataclass(frozen=True, slots=True)
class Refactoring:
    """A change that keeps the file valid or leaves an obvious gap to fill.

    Attributes:
        title: what it does.
        kind: the protocol's name for what it is.
        edits: how.
        created: files that are made, each with its text.
    """

    title: str
    kind: str
    edits: tuple[Edit, ...]
    created: tuple[tuple[Path, str], ...] = ()


def refactorings(document: Document, line: int) -> Iterator[Refactoring]:
    """Refactorings on a line (from 0): add a state beside or inside its state, change the target of its transition."""
    state = next((one for one in _states(outline(document)) if one.place.line == line), None)
    if state is not None:
        yield from _new_states(document, state)
        yield from _extracted(document, state)
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
    """The edit that puts a text below the block that begins on a line, with a blank line between."""
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
    for entry in completion.completions(document, line, begin):
        if entry.kind is SymbolKind.STATE and entry.label != match[1]:
            edit = Edit(line, begin, line, end, entry.label)
            yield Refactoring(f"Change the target to `{entry.label}`", RETARGET, (edit,))


def _extracted(document: Document, state: OutlineSymbol) -> Iterator[Refactoring]:
    """The inside of a state as a machine of its own, which the state is then an instance of.

    It is offered if the inside uses no declaration of the rest of the file, and the rest names no state in it.
    The state's own transitions stay where they are.
    """
    first, last = state.place.line, block_end(document, state.place.line)
    lines = document.tree.lines
    name = state.name.rpartition(".")[2]
    path = Path(document.file).with_name(f"{name}{SUFFIX}")
    if not state.children or state.detail == "parallel" or path.exists() or "#" in lines[first]:
        return
    inner = _indentation(lines[first]) + len(_INDENT)
    words = {number: lines[number].split()[0] for number in range(first + 1, last + 1) if lines[number].strip()}
    own = {number: word for number, word in words.items() if _indentation(lines[number]) == inner}
    if any(word in ("do", "entry", "exit") for word in own.values()):
        return
    stays = {number for number, word in own.items() if word in _TRIGGERS}
    moved = [number for number in range(first + 1, last + 1) if number not in stays]
    within = [one for one in document.occurrences if one.line in moved]
    without = [one for one in document.occurrences if one.line not in moved]
    inside = {one.name for one in within if one.declares}
    outside = {one.name for one in without if one.declares}
    if any(one.name in outside or one.role is Role.MACHINE for one in within):
        return
    if any(one.role is Role.STATE and one.name in inside for one in without):
        return
    body = [lines[number][inner:] for number in moved]
    text = "\n".join([f"machine {name}", "", *body]).rstrip() + "\n"
    kept = "".join(f"\n{lines[number]}" for number in sorted(stays))
    replaced = Edit(first, 0, last, len(lines[last]), f"{lines[first].rstrip()} = {name}(){kept}")
    heading = max((one.line for one in document.occurrences if _heads(one)), default=0)
    end = len(lines[heading])
    begin = "\n" if lines[heading].startswith("import") else "\n\n"
    imported = Edit(heading, end, heading, end, f"{begin}import {name}")
    title = f"Move the inside of `{name}` to a machine of its own"
    yield Refactoring(title, EXTRACT, (imported, replaced), ((path, text),))


_TRIGGERS = ("on", "when", "after", "every", "else")


def _heads(one: NameOccurrence) -> bool:
    """Whether a name is that of the machine or of an import."""
    return one.role is Role.MACHINE and one.column <= len("machine ")


def _indentation(text: str) -> int:
    return len(text) - len(text.lstrip())
