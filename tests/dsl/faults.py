"""Single mistakes, planted one at a time at every place of a machine."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import NamedTuple

from hsm.dsl.syntax.lexer import STATEMENTS
from hsm.dsl.syntax.parser import tokens_of

_AMOUNT = re.compile(r"([\d.]+) *(.*)")


class Fault(NamedTuple):
    """A text with one mistake in it: what kind, on which line."""

    kind: str
    line: int
    text: str


def planted(text: str) -> Iterator[Fault]:
    """All faults of a text."""
    yield from _in_tokens(text)
    yield from _in_lines(text)


def _in_tokens(text: str) -> Iterator[Fault]:
    lines = text.split("\n")
    for token in tokens_of(text):
        if token.type in ("_INDENT", "_DEDENT", "_NL"):
            continue
        number, start, end = token.line - 1, token.column - 1, token.end_column - 1
        line = lines[number]
        for kind, new in _variants(token, line[:start], line[end:]):
            yield Fault(kind, number + 1, "\n".join((*lines[:number], new, *lines[number + 1 :])))


def _variants(token, before: str, after: str) -> Iterator[tuple[str, str]]:
    word = token.value
    if word in STATEMENTS or token.type == "NAME":
        yield "a letter too many", f"{before}{word[:2]}{word[1:]}{after}"
    if token.type == "NAME":
        yield "another name", f"{before}qqxqq{after}"
    if token.type == "NUMBER":
        digits, unit = _AMOUNT.fullmatch(word).groups()
        yield "no number", f"{before}true{after}"
        if unit:
            yield "another unit", f"{before}{digits} Hz{after}"
            yield "no unit", f"{before}{digits}{after}"
            yield "no such unit", f"{before}{digits} qm{after}"
    yield "a token left out", before + after.lstrip()
    yield "a stray character", f"{before}$ {word}{after}"
    if before.strip():
        yield "the line cut off", before.rstrip()


def _in_lines(text: str) -> Iterator[Fault]:
    lines = text.split("\n")
    for number, line in enumerate(lines):
        words = line.lstrip()
        if not words or words.startswith("#"):
            continue
        depth = len(line) - len(words)

        def put(kind: str, *new: str, number: int = number) -> Fault:
            return Fault(kind, number + 1, "\n".join((*lines[:number], *new, *lines[number + 1 :])))

        yield put("a line twice", line, line)
        if depth:
            yield put("tabs", "\t" * (depth // 4) + words)
        for shift in (1, 2, 4, -1, -2, -4):
            if depth + shift >= 0:
                yield put("indented wrongly", " " * (depth + shift) + words)
