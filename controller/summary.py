"""A campaign's results as a table: one line a machine."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from statistics import median, quantiles

from rich.box import SIMPLE_HEAD
from rich.table import Table

from controller.campaign import Record


def summary(records: Iterable[Record]) -> Table:
    """How each machine did over all its runs.

    Time and path are medians of the solved runs; 90% is the time that so many of them stayed below; touched counts the
    runs with a contact; clearance is the smallest distance to a wall in any run.
    """
    table = Table("machine", "runs", "solved", "touched", "time", "90%", "path", "clearance", box=SIMPLE_HEAD)
    by_machine: dict[str, list[Record]] = {}
    for record in records:
        by_machine.setdefault(record["machine"], []).append(record)
    for machine, runs in by_machine.items():
        driven = [run for run in runs if "refused" not in run]
        solved = [run for run in driven if run["solved"]]
        clearances = [run["clearance"] for run in driven if run.get("clearance") is not None]
        table.add_row(
            machine,
            str(len(driven)),
            f"{len(solved) / len(driven):.1%}" if driven else "-",
            str(sum(bool(run.get("contacts")) for run in driven)),
            _figure([run["time"] for run in solved], "s"),
            _ninetieth([run["time"] for run in solved]),
            _figure([run["path_length"] for run in solved], "m"),
            f"{min(clearances):.3f} m" if clearances else "-",
        )
    return table


def failures(records: Iterable[Record]) -> list[str]:
    """What went wrong, most frequent first: mazes that were refused and runs that failed, each with an example."""
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


def _figure(values: Sequence[float], unit: str) -> str:
    return f"{median(values):.1f} {unit}" if values else "-"


def _ninetieth(values: Sequence[float]) -> str:
    return f"{quantiles(values, n=10, method='inclusive')[-1]:.1f} s" if len(values) > 1 else _figure(values, "s")
