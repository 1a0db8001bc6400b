"""Suppresses diagnostics that depend on the blocks around a wrongly indented line."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from hsm.model.diagnostics import Diagnostic

LAYOUT = ("E0103", "E0105")
"""The codes of lines that belong to no block."""

_OF_BLOCKS = ("E0203", "E04", "W05", "N07")


def without_doubtful(findings: Sequence[Diagnostic], lines: Sequence[str]) -> list[Diagnostic]:
    """The diagnostics that do not depend on a wrong indentation.

    After a wrongly indented line it is unclear which lines belong to which state, in the outermost block around it and
    in the previous one. Diagnostics there that depend on it are suppressed until the line is corrected.

    Args:
        findings: all of a file.
        lines: its text.
    """
    uncertain: set[int] = set()
    for one in findings:
        if one.code in LAYOUT and one.place is not None and one.place.line not in uncertain:
            uncertain.update(_around(one.place.line, lines))
    return [one for one in findings if not (_of_blocks(one) and one.place is not None and one.place.line in uncertain)]


def _of_blocks(found: Diagnostic) -> bool:
    return found.code.startswith(_OF_BLOCKS)


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
