"""The results of a campaign as columns (Apache Parquet), which pandas, duckdb and others read, and their summary.

A million results are some tens of megabytes; their summary reads only the columns that it needs. Parquet comes with
the extra `columns` (pyarrow).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from maze_machine.campaign.jobs import Record
from maze_machine.campaign.summary import Row
from maze_machine.errors import FileError, missing_package
from transport.files import replacing

if TYPE_CHECKING:
    import pyarrow as arrow

Flags = np.ndarray[Any, np.dtype[np.bool_]]
Figures = np.ndarray[Any, np.dtype[np.float64]]
Texts = tuple[np.ndarray[Any, np.dtype[np.int64]], list[str]]
"""A column of texts as numbers, -1 where there is none, and the texts."""

GROUP = 20_000
"""Number of results that are kept in memory and written at once."""

_TEXTS = ("machine", "maze", "outcome", "reason", "refused")
_NUMBERS = ("time", "path_length", "clearance")
_WAYS = ("shortest", "bound")
_LISTS = ("doors_opened", "contacts")


def _pyarrow() -> Any:
    """The library that writes and reads columns.

    Raises:
        UsageError: it is not installed.
    """
    try:
        import pyarrow.parquet  # noqa: PLC0415 - an extra
    except ImportError:
        raise missing_package("a file of columns", "pyarrow", "columns") from None
    return pyarrow


class ColumnsWriter:
    """Writes results as they come, a group of rows at a time."""

    def __init__(self, file: BinaryIO) -> None:
        self._arrow = arrow = _pyarrow()
        texts = {name: arrow.dictionary(arrow.int32(), arrow.string()) for name in _TEXTS}
        numbers = dict.fromkeys((*_NUMBERS, *_WAYS), arrow.float64())
        lists = dict.fromkeys(_LISTS, arrow.list_(arrow.string()))
        self._schema = arrow.schema(
            [*{**texts, "seed": arrow.int64(), "solved": arrow.bool_(), **numbers, **lists}.items()]
        )
        self._writer = arrow.parquet.ParquetWriter(file, self._schema, compression="zstd")
        self._rows: list[Record] = []

    def add(self, records: Iterable[Record]) -> None:
        """Take some results."""
        for record in records:
            self._rows.append(record)
            if len(self._rows) >= GROUP:
                self._write()

    def flush(self) -> None:
        """Write the results that are still in memory."""
        if self._rows:
            self._write()

    def close(self) -> None:
        """Write the end of the file."""
        self._writer.close()

    def _write(self) -> None:
        self._writer.write_table(self._arrow.Table.from_pylist(self._rows, schema=self._schema))
        self._rows = []


@contextmanager
def columns_in(path: Path | None) -> Iterator[Callable[[Iterable[Record]], None]]:
    """What writes results as columns; the file is there, whole, when the block has ended without an exception.

    Args:
        path: the file; without one, nothing is written.

    Raises:
        UsageError: pyarrow is not installed.
        FileError: the file is there and holds something else.
        OSError: the file cannot be written.
    """
    if path is None:
        yield lambda _records: None
        return
    _require_results(path)
    with replacing(path) as file:
        writer = ColumnsWriter(file)
        try:
            yield writer.add
            writer.flush()
        finally:
            writer.close()


def _require_results(path: Path) -> None:
    """Make sure that nothing but earlier results is replaced; an empty file or a device is written to."""
    arrow = _pyarrow()
    if not path.is_file() or not path.stat().st_size:
        return
    try:
        names = arrow.parquet.read_schema(path).names
    except arrow.ArrowException:
        names = []
    if not {"machine", "maze", "seed", "solved"} <= set(names):
        raise FileError(f"{path} exists and does not contain the results of a campaign", "choose another file")


def summary_of_columns(path: Path) -> tuple[list[Row], list[str]]:
    """The summary of each machine and the failures, as those of `summary` and `failures`, from a file of columns.

    Raises:
        UsageError: pyarrow is not installed.
        FileError: the file does not contain the results of a campaign.
    """
    arrow = _pyarrow()
    try:
        table = arrow.parquet.read_table(
            path, columns=["machine", "solved", "refused", "outcome", *_NUMBERS, "contacts"]
        )
        codes, machines = _codes(table, "machine")
        outcomes, names = _codes(table, "outcome")
    except (arrow.ArrowException, KeyError, OSError):
        raise FileError(
            f"{path} does not contain the results of a campaign", "give a file that `sweep` has written"
        ) from None
    ran = np.asarray(table["refused"].combine_chunks().is_null())
    solved = np.asarray(table["solved"])
    touched = np.asarray(arrow.compute.fill_null(arrow.compute.list_value_length(table["contacts"]), 0)) > 0
    time, path_length, clearance = (np.asarray(table[name], dtype=np.float64) for name in _NUMBERS)
    rows = [
        _row(machine, (codes == code) & ran, solved, touched, (time, path_length, clearance))
        for code, machine in enumerate(machines)
    ]
    return rows, _failures((codes, machines), (outcomes, names), solved, ran)


def _codes(table: arrow.Table, name: str) -> Texts:
    """A column of texts as numbers, -1 where there is none, and the texts in the order of their first use."""
    encoded = table[name].unify_dictionaries().combine_chunks()
    return np.asarray(encoded.indices.fill_null(-1), dtype=np.int64), encoded.dictionary.to_pylist()


def _row(machine: str, runs: Flags, solved: Flags, touched: Flags, figures: Sequence[Figures]) -> Row:
    led_out = runs & solved
    time, path, clearance = figures
    time, path, clearance = time[led_out], path[led_out], clearance[runs & ~np.isnan(clearance)]
    return Row(
        machine,
        runs=int(np.count_nonzero(runs)),
        solved=int(np.count_nonzero(led_out)),
        touched=int(np.count_nonzero(runs & touched)),
        time=float(np.median(time)) if len(time) else None,
        time_90=float(np.quantile(time, 0.9)) if len(time) else None,
        path=float(np.median(path)) if len(path) else None,
        clearance=float(clearance.min()) if len(clearance) else None,
    )


def _failures(machine: Texts, outcome: Texts, solved: Flags, ran: Flags) -> list[str]:
    """How often each kind of failure occurred, most frequent first."""
    (codes, machines), (outcomes, names) = machine, outcome
    counted = {"maze refused": int(np.count_nonzero(~ran))}
    failed = ran & ~solved
    kinds, counts = np.unique(np.stack((codes[failed], outcomes[failed])), axis=1, return_counts=True)
    for (which, how), count in zip(kinds.T.tolist(), counts.tolist(), strict=True):
        counted[f"{machines[which]}: {names[how]}"] = count
    ordered = sorted(counted.items(), key=lambda item: -item[1])
    return [f"{count} x {kind}" for kind, count in ordered if count]
