"""Suppresses diagnostics that depend on lines which are probably meant to be elsewhere."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from hsm.model.diagnostics import Diagnostic

LAYOUT = ("E0103", "E0105")
"""The codes of lines that belong to no block."""

_OF_BLOCKS = ("E0203", "E04", "W05", "N07")
_MISPLACED = ("E0402", "E0403")
_REMARKS_OF_BLOCKS = ("W05", "N07")
_INCOMPLETE, _UNREAD = "E0404", "E0101"


def without_doubtful(findings: Sequence[Diagnostic], lines: Sequence[str]) -> list[Diagnostic]:
    """The diagnostics that do not depend on other ones.

    After a wrongly indented line it is unclear which lines belong to which state, in the outermost block around it and
    in the previous one. Diagnostics there that depend on it are suppressed until the line is corrected. After a line
    that a state cannot have, or has already, the same holds for remarks. A line that says too little
    continues in the next one if that cannot be read.

    Args:
        findings: all of a file.
        lines: its text.
    """
    blocks, contents = _doubts(findings, LAYOUT, lines), _doubts(findings, _MISPLACED, lines)
    unread = {one.place.line for one in findings if one.code == _UNREAD and one.place is not None}

    def follows(one: Diagnostic) -> bool:
        if one.place is None:
            return False
        if one.code == _INCOMPLETE and _next_line(one.place.end_line, lines) in unread:
            return True
        line = one.place.line
        return one.code.startswith(_OF_BLOCKS if line in blocks else _REMARKS_OF_BLOCKS if line in contents else ())

    return [one for one in findings if not follows(one)]


def _doubts(findings: Sequence[Diagnostic], codes: Sequence[str], lines: Sequence[str]) -> set[int]:
    """The lines of which it is not clear what they belong to, because of diagnostics with some codes."""
    doubts: set[int] = set()
    for one in findings:
        if one.code in codes and one.place is not None and one.place.line not in doubts:
            doubts.update(_around(one.place.line, lines))
    return doubts


def _next_line(line: int, lines: Sequence[str]) -> int:
    """The line after another one, blank ones and comments left out."""
    following = range(line + 1, len(lines) + 1)
    return next((number for number in following if lines[number - 1].partition("#")[0].strip()), 0)


def _around(line: int, lines: Sequence[str]) -> Iterable[int]:
    """The lines of the outermost block around a line, and of the block before it."""
    first, last = line, line
    for _ in range(2):
        first -= 1
        while first > 1 and not _begins(lines[first - 1]):
            first -= 1
    while last < len(lines) and not _begins(lines[last]):
        last += 1
    return range(max(first, 1), last + 1)


def _begins(line: str) -> bool:
    """Whether a line begins an outermost block."""
    return bool(line) and not line.startswith((" ", "#", "\t"))
