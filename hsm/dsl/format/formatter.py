"""The one canonical form of a machine's text. Only the layout changes; comments and meaning stay.

Blocks are indented by four spaces; within a block the arrows of its transitions are in one column, and so are their
actions; comments after neighbouring lines are in one column; no two blank lines follow one another.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import field
from itertools import groupby

from hsm.dsl.syntax.parser import parse, tokens_of
from hsm.dsl.syntax.tokens import Token
from hsm.model.diagnostics import MachineError
from hsm.model.values import dataclass

INDENT = 4
"""Spaces by which a block is indented."""

_CONTINUATION = 8
_WIDEST_TRIGGER = 72
_TRANSITIONS = ("ON", "WHEN", "ELSE", "AFTER", "EVERY")
_DECLARATIONS = ("PARAM", "VAR")
_AMOUNT = re.compile(r"([\d.]+(?:[eE][+-]?\d+)?) *(.*)")


@dataclass(slots=True)
class _Line:
    """One line of the text.

    Attributes:
        depth: how many blocks it lies in.
        block: which block it lies in, by number.
        tokens: what is on it; empty for a comment or a blank line.
        continued: it is part of the line before it.
        comment: its comment, with the mark.
    """

    depth: int = 0
    block: int = 0
    tokens: list[Token] = field(default_factory=list)
    continued: bool = False
    comment: str = ""


def format_text(text: str, file: str = "<text>") -> str:
    """The text in its canonical form.

    Raises:
        MachineError: a line cannot be read.
    """
    tree, findings = parse(text, file)
    if findings:
        raise MachineError(findings)
    lines = _lines(tree.lines)
    _settle_comments(lines, tree.lines)
    codes = _code_texts(lines)
    return _joined(lines, codes)


def _lines(source: Sequence[str]) -> list[_Line]:
    """All lines with their tokens, blocks and comments."""
    lines = [_Line(comment=_comment(text)) for text in source]
    depth, blocks, count = 0, [0], 0
    first = True
    for token in tokens_of("\n".join(source)):
        if token.type == "_INDENT":
            depth, count = depth + 1, count + 1
            blocks.append(count)
        elif token.type == "_DEDENT":
            depth -= 1
            blocks.pop()
        elif token.type == "_NL":
            first = True
        else:
            line = lines[token.line - 1]
            if not line.tokens:
                line.depth, line.block, line.continued = depth, blocks[-1], not first
            line.tokens.append(token)
            first = False
    return lines


def _comment(text: str) -> str:
    """The comment of a line, with one blank after its mark."""
    _, mark, comment = text.partition("#")
    if not mark:
        return ""
    gap = "" if not comment or comment[0] in " #!" else " "
    return f"#{gap}{comment}".rstrip()


def _settle_comments(lines: Sequence[_Line], source: Sequence[str]) -> None:
    """A comment on its own line belongs to the deepest block around it that is not indented further."""
    levels: list[tuple[int, int]] = [(0, 0)]
    pending: list[int] = []
    for number, line in enumerate(lines):
        if not line.tokens:
            if line.comment:
                pending.append(number)
            continue
        if line.continued:
            _place_within(lines, pending, line)
            continue
        width = _width(source[number])
        before = levels
        levels = [*(level for level in levels if level[1] < line.depth), (width, line.depth)]
        for index in pending:
            column = _width(source[index])
            fitting = [depth for start, depth in (*before, *levels) if start <= column]
            lines[index].depth = max(fitting, default=0)
        pending.clear()
    for index in pending:
        column = _width(source[index])
        lines[index].depth = max((depth for start, depth in levels if start <= column), default=0)


def _place_within(lines: Sequence[_Line], pending: list[int], line: _Line) -> None:
    """Comments between the parts of one statement have the same indentation as the parts."""
    for index in pending:
        lines[index].depth, lines[index].continued = line.depth, True
    pending.clear()


def _width(text: str) -> int:
    return len(text) - len(text.lstrip(" "))


def _code_texts(lines: Sequence[_Line]) -> list[str]:
    """The code of each line, with arrows and actions in their columns."""
    single = [
        line.tokens and not line.continued and not (number + 1 < len(lines) and lines[number + 1].continued)
        for number, line in enumerate(lines)
    ]
    columns: dict[int, list[int]] = {}
    parts: dict[int, list[str]] = {}
    for number, line in enumerate(lines):
        if single[number] and line.tokens[0].type in _TRANSITIONS:
            parts[number] = [_spaced(part) for part in _split(line.tokens)]
            columns.setdefault(line.block, []).append(number)
    texts = [_spaced(line.tokens) for line in lines]
    for numbers in columns.values():
        _align(texts, parts, numbers)
    _align_declarations(texts, lines, single)
    return texts


def _split(tokens: Sequence[Token]) -> tuple[Sequence[Token], Sequence[Token], Sequence[Token]]:
    """A transition's trigger, target and actions."""
    depth = 0
    arrow = slash = len(tokens)
    for position, token in enumerate(tokens):
        depth += (token.type == "LPAR") - (token.type == "RPAR")
        if depth:
            continue
        if token.type == "ARROW":
            arrow = min(arrow, position)
        elif token.type == "SLASH":
            slash = min(slash, position)
    return tokens[: min(arrow, slash)], tokens[min(arrow, slash) : slash], tokens[slash:]


def _align(texts: list[str], parts: dict[int, list[str]], numbers: Sequence[int]) -> None:
    wide = [len(parts[number][0]) for number in numbers if len(parts[number][0]) <= _WIDEST_TRIGGER]
    first = max(wide, default=0)
    second = max(len(parts[number][1]) for number in numbers)
    for number in numbers:
        trigger, target, actions = parts[number]
        text = f"{trigger:<{first}} {target:<{second}} {actions}" if second else f"{trigger:<{first}} {actions}"
        texts[number] = text.rstrip()


def _align_declarations(texts: list[str], lines: Sequence[_Line], single: Sequence[object]) -> None:
    """Neighbouring ``param`` and ``var`` lines have their colons and equals signs in columns."""
    for word in _DECLARATIONS:
        for declares, group in groupby(
            range(len(lines)), key=lambda number: bool(single[number]) and lines[number].tokens[0].type == word
        ):
            if not declares:
                continue
            numbers = list(group)
            cells = [re.split(r" (?=[:=] )", texts[number], maxsplit=2) for number in numbers]
            for column in (0, 1):
                width = max((len(row[column]) for row in cells if "," not in row[column]), default=0)
                for row in cells:
                    if column + 1 < len(row):
                        row[column] = row[column].ljust(width)
            for number, row in zip(numbers, cells, strict=True):
                texts[number] = " ".join(row)


def _spaced(tokens: Sequence[Token]) -> str:
    """Tokens on one line with the spaces between them."""
    text: list[str] = []
    before: Token | None = None
    sign = False
    for token in tokens:
        if before is not None and _apart(before, token, sign=sign):
            text.append(" ")
        sign = token.type == "MINUS" and (before is None or before.type not in ("NAME", "NUMBER", "RPAR"))
        text.append(_written(token))
        before = token
    return "".join(text)


def _apart(before: Token, token: Token, *, sign: bool) -> bool:
    """Whether a space belongs between two tokens; ``sign``: the first is a minus sign and no operator."""
    if token.type in ("COMMA", "RPAR") or before.type == "LPAR" or sign:
        return False
    return not (token.type == "LPAR" and before.type in ("NAME", "ADJUSTABLE"))


def _written(token: Token) -> str:
    if token.type != "NUMBER":
        return str(token.value)
    match = _AMOUNT.fullmatch(token.value)
    return token.value if match is None else f"{match[1]} {match[2]}".rstrip()


def _joined(lines: Sequence[_Line], codes: Sequence[str]) -> str:
    """The whole text: indented, comments in columns, blank lines thinned out."""
    indented = [
        f"{' ' * (INDENT * line.depth + _CONTINUATION * line.continued)}{code}" if code else ""
        for line, code in zip(lines, codes, strict=True)
    ]
    result: list[str] = []
    for shared, group in groupby(range(len(lines)), key=lambda number: bool(codes[number] and lines[number].comment)):
        numbers = list(group)
        width = max(len(indented[number]) for number in numbers)
        for number in numbers:
            line = lines[number]
            if shared:
                result.append(f"{indented[number]:<{width}}  {line.comment}")
            elif line.comment:
                result.append(" " * (INDENT * line.depth + _CONTINUATION * line.continued) + line.comment)
            elif indented[number] or (result and result[-1]):
                result.append(indented[number])
    return "\n".join(result).rstrip("\n") + "\n" if any(result) else ""


def indented_lines(lines: Sequence[str], outer: Sequence[str], parted: str) -> str:
    """Lay out lines of two levels: some at the margin, the others indented by four, continuation lines by eight.

    Args:
        lines: the lines.
        outer: the words that lines at the margin begin with.
        parted: the one of these words before whose lines, and the comments above them, there is a blank line.
    """
    found: list[str] = []
    joined = False
    for line in lines:
        text = line.strip()
        if not text:
            if found and found[-1]:
                found.append("")
            continue
        word = text.split(maxsplit=1)[0]
        margin = word in outer or (text.startswith("#") and not line.startswith(" "))
        found.append(text if margin else f"{'        ' if joined else '    '}{text}")
        joined = text.partition("#")[0].rstrip().endswith(",")
        if word == parted:
            above = len(found) - 1
            while above > 0 and found[above - 1].startswith("#"):
                above -= 1
            if above > 0 and found[above - 1]:
                found.insert(above, "")
    return "\n".join(found).rstrip() + "\n"
