"""Diagnostics that an author accepts: ``# accept N0701`` on the line of a diagnostic, or above it.

On the line of a state, or above it, it also holds for whatever is indented below.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Mapping, Sequence

from hsm.dsl.syntax import ast
from hsm.model.codes import finding
from hsm.model.diagnostics import Diagnostic, Place, Severity

_ACCEPT = re.compile(r"#\s*accept\s+([WN]\d{4}(?:\s*,\s*[WN]\d{4})*)")
_CODE = re.compile(r"[WN]\d{4}")


def accepted(findings: Sequence[Diagnostic], tree: ast.File) -> list[Diagnostic]:
    """The diagnostics that are not accepted in the file, and a warning for each acceptance without a diagnostic.

    Where the file has errors, a diagnostic may be missing because of them: then there is no such warning.
    """
    places = _acceptances(tree)
    blocks = _blocks(tree, {line for line, _ in places})
    used: set[tuple[int, str]] = set()
    remaining: list[Diagnostic] = []
    for found in findings:
        line = found.place.line if found.place is not None else 0
        lines = (line, *blocks.get(line, ()))
        key = next(((one, found.code) for one in lines if (one, found.code) in places), None)
        if found.severity < Severity.ERROR and key is not None:
            used.add(key)
        else:
            remaining.append(found)
    complete = all(one.severity < Severity.ERROR for one in findings)
    for key, place in places.items():
        if complete and key not in used:
            remaining.append(finding("W0605", place, f"there is no {key[1]} here to accept"))
    return remaining


def _acceptances(tree: ast.File) -> dict[tuple[int, str], Place]:
    """Which code is accepted on which line, and where that is written."""
    found: dict[tuple[int, str], Place] = {}
    for number, line in enumerate(tree.lines, 1):
        match = _ACCEPT.search(line) if "accept" in line else None
        if match is None:
            continue
        subject = number if line[: match.start()].strip() else _next_line(tree, number)
        for code in _CODE.finditer(line, match.start(), match.end()):
            place = Place(tree.name, number, code.start() + 1, number, code.end() + 1)
            found.setdefault((subject, code.group()), place)
    return found


def _blocks(tree: ast.File, wanted: set[int]) -> Mapping[int, Sequence[int]]:
    """For each line, the wanted lines that begin a block around it, innermost first."""
    around: dict[int, list[int]] = defaultdict(list)
    stack: list[tuple[ast.Item, tuple[int, ...]]] = [(item, ()) for item in tree.items] if wanted else []
    while stack:
        item, lines = stack.pop()
        if isinstance(item, ast.StateBlock):
            own = item.name.line
            around[own] = list(lines)
            inner = (own, *lines) if own in wanted else lines
            stack.extend((one, inner) for one in item.items)
        elif isinstance(item, ast.TransitionLine):
            around[item.keyword.line] = list(lines)
        elif isinstance(item, ast.DoLine):
            around[item.call.name.line] = list(lines)
    return around


def _next_line(tree: ast.File, number: int) -> int:
    """The first line after a comment that is not one."""
    while number < len(tree.lines) and tree.lines[number].lstrip().startswith("#"):
        number += 1
    return number + 1
