"""The summary of a campaign: one line per machine, and the failures."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from statistics import median, quantiles

from rich.box import SIMPLE_HEAD
from rich.table import Column, Table

from maze_machine.campaign.jobs import Record


@dataclass(frozen=True, slots=True)
class Row:
    """The results of one machine over all its runs.

    Attributes:
        machine: its name or file.
        runs: how many there were, without those whose maze was refused.
        solved: how many of them led out.
        touched: how many of them had a contact.
        time: median of the solved runs, s; None without any.
        time_90: the time that nine tenths of the solved runs stayed below, s.
        path: median length of the solved runs' paths, m.
        clearance: the smallest distance to a wall in any run, m.
    """

    machine: str
    runs: int
    solved: int
    touched: int
    time: float | None
    time_90: float | None
    path: float | None
    clearance: float | None


def summary(records: Iterable[Record]) -> list[Row]:
    """The results of each machine, in the order of the records."""
    by_machine: dict[str, list[Record]] = {}
    for record in records:
        by_machine.setdefault(record["machine"], []).append(record)
    return [_row(machine, [run for run in runs if "refused" not in run]) for machine, runs in by_machine.items()]


def _row(machine: str, runs: Sequence[Record]) -> Row:
    solved = [run for run in runs if run["solved"]]
    times = [run["time"] for run in solved]
    paths = [run["path_length"] for run in solved]
    clearances = [run["clearance"] for run in runs if run.get("clearance") is not None]
    return Row(
        machine,
        runs=len(runs),
        solved=len(solved),
        touched=sum(bool(run.get("contacts")) for run in runs),
        time=median(times) if times else None,
        time_90=_ninetieth(times) if times else None,
        path=median(paths) if paths else None,
        clearance=min(clearances) if clearances else None,
    )


_FIGURES = ("runs", "solved", "touched", "time", "90%", "path", "clearance")


def table(rows: Iterable[Row]) -> Table:
    """The summary as text, one line per machine."""
    lines = [
        (
            row.machine,
            str(row.runs),
            f"{row.solved / row.runs:.1%}" if row.runs else "-",
            str(row.touched),
            _figure(row.time, "s"),
            _figure(row.time_90, "s"),
            _figure(row.path, "m"),
            _figure(row.clearance, "m", digits=3),
        )
        for row in rows
    ]
    # A name is cut only if the figures leave too little room.
    widths = [max(map(len, cells)) for cells in zip(_FIGURES, *(line[1:] for line in lines), strict=True)]
    figures = [Column(name, no_wrap=True, min_width=width) for name, width in zip(_FIGURES, widths, strict=True)]
    shown = Table(Column("machine", no_wrap=True), *figures, box=SIMPLE_HEAD, padding=(0, 1, 0, 0), show_edge=False)
    for line in lines:
        shown.add_row(*line)
    return shown


def failures(records: Iterable[Record]) -> list[str]:
    """The failures, most frequent first: mazes that were refused and runs that failed, each with an example."""
    examples: dict[str, Record] = {}
    counted: Counter[str] = Counter()
    for record in records:
        if record["solved"]:
            continue
        kind = "maze refused" if "refused" in record else f"{record['machine']}: {record['outcome']}"
        counted[kind] += 1
        examples.setdefault(kind, record)
    return [f"{count} x {kind}, such as {_example(examples[kind])}" for kind, count in counted.most_common()]


def _example(record: Record) -> str:
    if "refused" in record:
        return str(record["refused"])
    return f"{record['maze']} with seed {record['seed']}: {record['reason']}"


def _figure(value: float | None, unit: str, digits: int = 1) -> str:
    return "-" if value is None else f"{value:.{digits}f} {unit}"


def _ninetieth(values: Sequence[float]) -> float:
    return quantiles(values, n=10, method="inclusive")[-1] if len(values) > 1 else values[0]
