"""``maze-machine import`` and ``maze-machine export``: machines from and to other tools."""

from __future__ import annotations

import sys
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from maze_machine.arguments.files import check_outputs, check_suffix
from maze_machine.arguments.options import ChartArgument, LibraryOption
from transport.files import write_text as write_file

Output = Annotated[
    Path | None, typer.Option("--output", "-o", help="The file to write. Default: standard output.", metavar="FILE")
]


class Target(StrEnum):
    """What a machine can be exported to."""

    SCXML = "scxml"


def import_chart(
    file: Annotated[Path, typer.Argument(help="An .scxml file.", metavar="FILE")], output: Output = None
) -> None:
    """Turn a statechart in SCXML into a .maze-machine file.

    A feature without a counterpart in the language is refused, with its name and place; the exit status is then 3.

    Example: `maze-machine import lift.scxml -o lift.maze-machine`
    """
    from hsm.dsl.format.formatter import format_text
    from hsm.dsl.syntax.sources import SUFFIX
    from hsm.interchange.scxml import read_file
    from hsm.interchange.scxml.translation import to_machine_text

    check_outputs({"--output": output}, [file])
    check_suffix("--output", output, [SUFFIX])
    _write(format_text(to_machine_text(read_file(file))), output)


def export(
    file: ChartArgument,
    to: Annotated[Target, typer.Option("--to", help="The format.")] = Target.SCXML,
    output: Output = None,
    library: LibraryOption = None,
) -> None:
    """Write a machine for other tools.

    States, history, events, time-outs and outcomes become SCXML. SCXML has no signals, activities and units: they are
    written as in this language, so only a machine without them can be imported again. Every difference in meaning is
    reported on standard error.

    If the output ends in `.rrd`, a recording is converted for the viewer Rerun; this needs the extra `rerun`.

    Example: `maze-machine export pledge --to scxml -o pledge.scxml`

    Example: `maze-machine export run.mcap -o run.rrd`
    """
    check_outputs({"--output": output}, [file])
    check_suffix("--output", output, [".scxml", ".rrd"])
    if output is not None and output.suffix == ".rrd":
        from maze_machine.commands.to_rerun import to_rerun

        to_rerun(Path(file), output)
        return
    from hsm.dsl.reporting.render import as_text
    from hsm.interchange.scxml import differences, write_text
    from maze_machine.commands.diagram import load_chart

    assert to is Target.SCXML, "there is no other"
    model = load_chart(file, library).model
    found = differences(model)
    if found:
        print(as_text(found, _sources(model.files)), file=sys.stderr)
    _write(write_text(model), output)


def _sources(files: tuple[str, ...]) -> dict[str, str]:
    """The texts of a machine's files, to quote from them."""
    return {file: Path(file).read_text(encoding="utf-8") for file in files if Path(file).is_file()}


def _write(text: str, output: Path | None) -> None:
    if output is None:
        sys.stdout.write(text)
        return
    write_file(output, text)
