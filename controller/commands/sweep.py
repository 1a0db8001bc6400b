"""``maze-machine sweep``: machines over mazes and seeds, on all cores."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from controller.completion import complete_profile
from controller.errors import ExitStatus, UsageError


def sweep(
    machines: Annotated[str, typer.Option(metavar="A,B,...", help="Machines: files or names, with commas.")],
    mazes: Annotated[
        str, typer.Option(metavar="A,B,...", help="Mazes: files, folders of files or names, with commas.")
    ],
    out: Annotated[Path, typer.Option(metavar="FILE", help="The results, one JSON line a run; taken up if it exists.")],
    seeds: Annotated[int, typer.Option(min=1, help="How many seeds for each machine and maze, from 0.")] = 1,
    workers: Annotated[int | None, typer.Option(min=1, help="Processes. Default: one a core.")] = None,
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Hand the runs to this dask.distributed cluster instead.")
    ] = None,
    robot: Annotated[
        str, typer.Option(help="Profile: a TOML file or a shipped one.", autocompletion=complete_profile)
    ] = "pico",
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Override a setting of the profile; may be repeated."),
    ] = None,
    time_limit: Annotated[
        float | None, typer.Option(min=0, metavar="SECONDS", help="Give up a run after so much of the robot's time.")
    ] = None,
) -> None:
    """Run machines over mazes and seeds and say how they did.

    The results do not depend on the number of workers. A sweep that was interrupted goes on where it was when it is
    started again with the same file. The exit status is 0 if every run was solved.

    Example: `maze-machine sweep --machines pledge,right_hand --mazes mazes/ --seeds 10 --out results.jsonl`
    """
    import os

    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    from controller.campaign import Results, Setup, jobs_of
    from controller.summary import failures, summary
    from controller.workers import on_cluster, on_cores

    if scheduler is not None and workers is not None:
        raise UsageError("--workers does not go with --scheduler", "the cluster has its own workers")
    setup = Setup(robot, tuple(settings or ()), time_limit)
    results = Results(out, setup, jobs_of(machines.split(","), mazes.split(","), seeds))
    todo = results.open_jobs
    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        console=Console(stderr=True),
        disable=not Console(stderr=True).is_terminal,
    )
    if todo:
        with bar:
            shown = bar.add_task("runs", total=len(todo))
            done = (
                on_cluster(setup, todo, scheduler)
                if scheduler
                else on_cores(setup, todo, workers or os.cpu_count() or 1)
            )
            for record in done:
                results.add(record)
                bar.advance(shown)
        results.write()
    console = Console()
    console.print(summary(results.records))
    for line in failures(results.records):
        console.print(line, markup=False, highlight=False)
    solved = all(record["solved"] for record in results.records)
    raise typer.Exit(ExitStatus.OK if solved else ExitStatus.FAILED)
