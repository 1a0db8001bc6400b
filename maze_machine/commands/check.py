"""``maze-machine check``: what is wrong with a machine, and what may be."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from maze_machine.arguments.completion import complete_machine
from maze_machine.arguments.options import LibraryOption
from maze_machine.errors import ExitStatus, UsageError

if TYPE_CHECKING:
    from hsm.model.chart import Model
    from hsm.model.diagnostics import Diagnostic


def check(
    files: Annotated[
        list[str] | None,
        typer.Argument(
            help=".maze-machine files, folders of them, or names of machines. Default: those of the project.",
            metavar="FILE",
            autocompletion=complete_machine,
        ),
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print the diagnostics as JSON.")] = False,
    sarif: Annotated[bool, typer.Option("--sarif", help="Print the diagnostics as SARIF 2.1.0.")] = False,
    ignore: Annotated[
        list[str] | None,
        typer.Option(metavar="CODE", help="Leave out warnings and notes whose code has this prefix; may be repeated."),
    ] = None,
    deep: Annotated[
        bool,
        typer.Option(
            "--deep",
            help="Leave out notes about `when` lines that no step can meet; this enumerates the states.",
        ),
    ] = False,
    library: LibraryOption = None,
) -> None:
    """Check machines and all that they import: errors, likely mistakes, nondeterminism and incompleteness.

    `maze-machine list codes` and the reference explain the code of each diagnostic. The exit status is 1 if there
    is an error, 3 if a file cannot be read. A comment `# accept CODE` on a line accepts a warning or a note there.

    Example: `maze-machine check pledge my.maze-machine`

    Example: `maze-machine check .`

    Example: `maze-machine check my.maze-machine --deep`

    Example: `maze-machine check my.maze-machine --ignore N --sarif > check.sarif`
    """
    from importlib.metadata import version

    from hsm.dsl import check_file
    from hsm.dsl.reporting import render
    from hsm.model.diagnostics import Severity
    from maze_machine.catalogue.library import chosen_library
    from maze_machine.catalogue.machines import named_files
    from maze_machine.catalogue.project import find_project

    if json and sarif:
        raise UsageError("--json does not go with --sarif", "one form at a time")
    findings: list[Diagnostic] = []
    sources: dict[str, str] = {}
    named = named_files(files or [])
    for name in named:
        path = machine_path(name)
        checked = check_file(path, chosen_library(library, Path(path)))
        project = find_project(Path(path).parent)
        unwanted = (*(ignore or ()), *(project.ignore if project is not None else ()))
        diagnostics: Sequence[Diagnostic] = checked.diagnostics
        if deep and checked.model is not None:
            diagnostics = confirmed(diagnostics, checked.model)
        findings.extend(
            found
            for found in diagnostics
            if found not in findings and (found.severity is Severity.ERROR or not found.code.startswith(unwanted))
        )
        sources.update(checked.sources)
    if json:
        print(render.as_json(findings))
    elif sarif:
        print(render.as_sarif(findings, version("maze-machine")))
    else:
        print_findings(findings, sources, named)
    if any(found.code == "E0107" for found in findings):
        raise typer.Exit(ExitStatus.BAD_FILE)
    if any(found.severity is Severity.ERROR for found in findings):
        raise typer.Exit(ExitStatus.FAILED)


def confirmed(found: Sequence[Diagnostic], model: Model) -> Sequence[Diagnostic]:
    """Diagnostics without the notes about `when` lines that no step can meet; all where that is not decided."""
    from hsm.testing.proofs.tables import GAP, OVERLAP, tables

    if not any(one.code in (OVERLAP, GAP) for one in found):
        return found
    known = tables(model)
    return found if known is None else tuple(known.confirmed(found, model))


def machine_path(name: str) -> str:
    """The file that is meant: one of the project's, a shipped machine's, or the one at this path."""
    from maze_machine.catalogue.machines import named_machines

    return str(named_machines().get(name, name))


def print_findings(findings: Sequence[Diagnostic], sources: dict[str, str], files: Sequence[str]) -> None:
    """Print diagnostics for people, and how many there are."""
    from hsm.dsl.reporting import render

    if findings:
        print(render.as_text(findings, sources, colour=sys.stdout.isatty()))
        print()
    counted = f"{len(files)} file{'s' * (len(files) != 1)} checked"
    print(f"{counted}: {render.summary(findings) or 'no problems found'}")
