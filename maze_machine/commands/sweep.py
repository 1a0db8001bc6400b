"""``maze-machine sweep``: machines over mazes and seeds, on all cores."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from maze_machine.arguments.options import (
    CellOption,
    ExitsOption,
    GoalOption,
    GreyOption,
    JsonOption,
    LibraryOption,
    ObjectsOption,
    PixelOption,
    RobotOption,
    SettingsOption,
    StartOption,
    TimeLimitOption,
)
from maze_machine.errors import NO_ROOM, ExitStatus, FileError, UsageError

if TYPE_CHECKING:
    from maze_machine.campaign.summary import Row


def sweep(
    machines: Annotated[
        list[str],
        typer.Option(metavar="A,B,...", help="Machines: files or names, separated by commas; may be repeated."),
    ],
    mazes: Annotated[
        list[str],
        typer.Option(
            metavar="A,B,...", help="Mazes: files, folders of files or names, separated by commas; may be repeated."
        ),
    ],
    out: Annotated[
        Path, typer.Option(metavar="FILE", help="The results, one JSON line per run; resumed if the file exists.")
    ],
    start: StartOption = None,
    exits: ExitsOption = None,
    goal: GoalOption = None,
    metres_a_pixel: PixelOption = None,
    metres_a_cell: CellOption = 1.0,
    grey: GreyOption = None,
    objects: ObjectsOption = None,
    seeds: Annotated[
        int, typer.Option(min=1, max=1_000_000, help="Number of seeds for each machine and maze, from 0.")
    ] = 1,
    workers: Annotated[int | None, typer.Option(min=1, help="Number of processes. Default: one per core.")] = None,
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Run on this dask.distributed cluster instead.")
    ] = None,
    robot: RobotOption = None,
    settings: SettingsOption = None,
    library: LibraryOption = None,
    time_limit: TimeLimitOption = None,
    columns: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write the results as columns (Parquet), too. Needs the extra `columns`."),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Run machines over mazes and seeds and report the results.

    The results do not depend on the number of workers. An interrupted sweep resumes when it is started again with the
    same file; only one sweep at a time may write the file. If the worker of a run dies, the run is tried once more, and
    then counts as `crashed`. The exit status is 0 if every run was solved.

    Example: `maze-machine sweep --machines pledge,right_hand --mazes mazes/ --seeds 10 --out results.jsonl`
    """
    import os

    from maze_machine.arguments.files import check_outputs
    from maze_machine.campaign.cluster import on_cluster
    from maze_machine.campaign.columns import columns_in
    from maze_machine.campaign.jobs import Setup, jobs_of
    from maze_machine.campaign.results import Results
    from maze_machine.campaign.summary import failures, summary
    from maze_machine.campaign.workers import on_cores
    from maze_machine.catalogue.project import default_robot
    from maze_machine.simulated.choices import MazeWords
    from transport.connect import controller_name
    from transport.files import locked

    if scheduler is not None and workers is not None:
        raise UsageError("--workers does not go with --scheduler", "the cluster has its own workers")
    check_outputs({"--out": out, "--columns": columns}, [*_each(machines), *_each(mazes)])
    words = MazeWords(start, tuple(exits or ()), goal, metres_a_pixel, metres_a_cell, grey, objects)
    words.choices()
    setup = Setup(default_robot(robot), tuple(settings or ()), time_limit, words, library)
    jobs = jobs_of(_each(machines), _each(mazes), seeds)
    loss = ""
    with locked(out, controller_name()):
        results = Results(out, setup, jobs)
        todo = results.open_jobs
        try:
            with columns_in(columns) as write, shown(len(todo)) as advance:
                doing = (
                    on_cluster(setup, todo, scheduler)
                    if scheduler is not None
                    else on_cores(setup, todo, workers or os.cpu_count() or 1)
                )
                with doing as done:
                    for record in done:
                        results.add(record)
                        advance()
                        write(results.next_in_order())
                write(results.next_in_order())
            results.write()
        except OSError as error:
            if error.filename is None:
                raise
            room = " when there is room" if error.errno in NO_ROOM else ""
            loss = f"{error.filename}: {error.strerror}; start the sweep again{room}, and it continues here"
    _print(summary(results.records), failures(results.records), json=json)
    if loss:
        raise FileError(loss)
    solved = all(record["solved"] for record in results.records)
    raise typer.Exit(ExitStatus.OK if solved else ExitStatus.FAILED)


def show(
    file: Annotated[
        Path,
        typer.Argument(metavar="FILE", help="Results: JSON lines, or columns (Parquet; needs the extra `columns`)."),
    ],
    json: JsonOption = False,
) -> None:
    """Summarise the results of a sweep.

    Example: `maze-machine sweep show results.parquet`
    """
    from maze_machine.campaign.columns import summary_of_columns
    from maze_machine.campaign.results import records_in
    from maze_machine.campaign.summary import failures, summary

    if file.exists() and not file.is_file():
        raise FileError(f"{file} is not a regular file", "give the results that a sweep has written")
    with file.open("rb") as opened:
        has_columns = opened.read(4) == b"PAR1"
    if has_columns:
        rows, failed = summary_of_columns(file)
    else:
        records = records_in(file)
        rows, failed = summary(records), failures(records)
    _print(rows, failed, json=json)


def _print(rows: list[Row], failed: list[str], *, json: bool) -> None:
    from dataclasses import asdict
    from json import dumps

    from rich.console import Console

    from maze_machine.campaign.summary import table

    if json:
        print(dumps({"machines": [asdict(row) for row in rows], "failures": failed}))
        return
    console = Console()
    console.print(table(rows))
    for line in failed:
        console.print(line, markup=False, highlight=False)


@contextmanager
def shown(total: int) -> Iterator[Callable[[], None]]:
    """A bar on a terminal for this many runs; what is yielded moves it on by one."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    console = Console(stderr=True)
    columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
    bar = Progress(*columns, console=console, disable=not console.is_terminal or not total)
    with bar:
        task = bar.add_task("runs", total=total)
        yield lambda: bar.advance(task)


def _each(values: list[str]) -> list[str]:
    """The names in all values of an option, each of which may hold several with commas."""
    return [name for value in values for name in value.split(",")]
