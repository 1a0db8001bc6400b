"""Coverage as a table, in the style of coverage.py."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from hsm.testing.coverage.data import Measured
from hsm.testing.coverage.items import CoverageItem, ItemKind, share

COLUMNS = tuple(ItemKind)


def coverage_table(machines: Sequence[Measured], base: Path | None = None) -> list[str]:
    """The lines of a table: one row per machine, with the lines of missed items.

    Args:
        machines: in the order of the rows.
        base: file names are shown relative to this folder.
    """
    heads = ["Machine", *(kind.value for kind in COLUMNS), "Cover", "Missing"]
    rows = [[_name(one, base), *_counts(one.points), _missing(one)] for one in machines]
    if len(rows) > 1:
        everything = [point for one in machines for point in one.points]
        rows.append(["TOTAL", *_counts(everything), ""])
    widths = [max(len(row[column]) for row in [heads, *rows]) for column in range(len(heads) - 1)]
    rule = "-" * (sum(widths) + 3 * len(widths) + len(heads[-1]))
    lines = [_line(heads, widths), rule, *(_line(row, widths) for row in rows)]
    if len(rows) > 1:
        lines.insert(-1, rule)
    return lines


def missed_lines(machine: Measured) -> list[str]:
    """The missed items, one line each."""
    return [f"{one.place or machine.file}: {one.text}" for one in machine.points if not one.covered]


def total_share(machines: Iterable[Measured]) -> float:
    """Percentage covered of all points of some machines."""
    return share(point for one in machines for point in one.points)


def _name(machine: Measured, base: Path | None) -> str:
    path = Path(machine.file)
    if base is not None and path.resolve().is_relative_to(base.resolve()):
        return str(path.resolve().relative_to(base.resolve()))
    return machine.file


def _counts(points: Sequence[CoverageItem]) -> list[str]:
    cells = []
    for kind in COLUMNS:
        listed = [one.covered for one in points if one.kind is kind]
        cells.append(f"{sum(listed)}/{len(listed)}" if listed else "-")
    # Like coverage.py: 100% is printed only if it is complete.
    percentage = share(points)
    return [*cells, f"{min(percentage, 99.0) if percentage < 100 else percentage:.0f}%"]


def _missing(machine: Measured) -> str:
    """The lines that are not fully covered; of imported machines with the file's name."""
    lines: dict[str, set[int]] = {}
    for one in machine.points:
        if not one.covered and one.place is not None:
            lines.setdefault(one.place.file, set()).add(one.place.line)
    parts: list[str] = []
    for file, numbers in lines.items():
        prefix = "" if file == machine.file else f"{Path(file).name}:"
        parts.extend(f"{prefix}{one}" for one in ranges(sorted(numbers)))
    return ", ".join(parts)


def ranges(numbers: Sequence[int]) -> list[str]:
    """Line numbers, neighbours joined: 3, 5-8."""
    found: list[list[int]] = []
    for number in numbers:
        if found and number == found[-1][1] + 1:
            found[-1][1] = number
        else:
            found.append([number, number])
    return [str(first) if first == last else f"{first}-{last}" for first, last in found]


def _line(cells: Sequence[str], widths: Sequence[int]) -> str:
    first, *rest = cells
    numbers = (cell.rjust(width) for cell, width in zip(rest[:-1], widths[1:], strict=True))
    return "   ".join([first.ljust(widths[0]), *numbers, rest[-1]]).rstrip()
