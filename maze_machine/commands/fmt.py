"""``maze-machine fmt``: machines in their one canonical form."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from maze_machine.errors import ExitStatus, UsageError


def fmt(
    files: Annotated[
        list[str] | None,
        typer.Argument(
            help=".maze-machine files, or folders of them; `-` formats standard input. Default: those of the project.",
            metavar="FILE",
        ),
    ] = None,
    check: Annotated[bool, typer.Option("--check", help="Change nothing; print which files would change.")] = False,
) -> None:
    """Format machines in their canonical form: indentation, spaces, arrows in columns; comments and meaning stay.

    A file with lines that cannot be read stays unchanged, and its diagnostics are printed. The exit status is 1 in that
    case, and with `--check` if a file would change; it is 3 if a file does not exist.

    Example: `maze-machine fmt my.maze-machine`

    Example: `maze-machine fmt --check .`
    """
    from pathlib import Path

    from hsm.dsl.format.formatter import format_text
    from hsm.dsl.reporting import render
    from hsm.dsl.syntax.sources import SUFFIX, read_text, text_in
    from hsm.model.diagnostics import MachineError
    from maze_machine.catalogue.machines import named_files
    from transport.files import write_text

    named = named_files(files or [])
    others = [name for name in named if name != "-" and Path(name).suffix not in ("", SUFFIX)]
    if others:
        raise UsageError(f"{', '.join(others)}: only {SUFFIX} files can be formatted", "leave out the others")
    status = ExitStatus.OK
    for name in named:
        try:
            text = text_in(sys.stdin.buffer, "standard input") if name == "-" else read_text(name)
        except MachineError as error:
            print(render.as_text(error.diagnostics, {}, colour=sys.stderr.isatty()), file=sys.stderr)
            status = ExitStatus.BAD_FILE
            continue
        try:
            formatted = format_text(text, name)
        except MachineError as error:
            print(render.as_text(error.diagnostics, {name: text}, colour=sys.stderr.isatty()), file=sys.stderr)
            status = max(status, ExitStatus.FAILED)
            continue
        if name == "-" and not check:
            print(formatted, end="")
        elif formatted != text:
            if check:
                status = max(status, ExitStatus.FAILED)
            else:
                write_text(Path(name), formatted)
            print(f"{name}: {'would be formatted' if check else 'formatted'}")
    if status:
        raise typer.Exit(status)
