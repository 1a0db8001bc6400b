"""``maze-machine diagram``: a machine as a picture."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from maze_machine.arguments.options import ChartArgument, LibraryOption
from maze_machine.errors import UsageError

if TYPE_CHECKING:
    from hsm.engine.machine import Machine


def diagram(
    file: ChartArgument,
    output: Annotated[
        Path,
        typer.Option("--output", "-o", help="Where to: a .svg, .png, .dot or .mmd (Mermaid) file.", metavar="FILE"),
    ],
    library: LibraryOption = None,
) -> None:
    """Draw a machine: hierarchy, regions, history, guards, time-outs, activities.

    Pictures need Graphviz, which comes with the extra `diagrams`; Mermaid's text does not.

    Example: `maze-machine diagram pledge -o pledge.svg`
    """
    from hsm.interchange.diagrams import FORMATS, DiagramError, render
    from maze_machine.arguments.files import check_outputs
    from transport.files import write_bytes

    form = output.suffix.removeprefix(".")
    if form not in FORMATS:
        raise UsageError(f"{output}: a diagram is a {', '.join(f'.{one}' for one in FORMATS)} file")
    check_outputs({"--output": output}, [file])
    try:
        drawn = render(load_chart(file, library), form)
    except DiagramError as error:
        raise UsageError(str(error)) from None
    write_bytes(output, drawn)


def load_chart(file: str, library: str | None = None) -> Machine:
    """The machine of a ``.maze-machine`` or ``.scxml`` file, or of a shipped machine's name.

    Args:
        file: the file or name.
        library: what the machine may name, as ``MODULE:NAME``; by default what its project says.
    """
    import hsm
    from maze_machine.catalogue.library import chosen_library
    from maze_machine.catalogue.machines import find_machine

    if file.endswith(".scxml"):
        from hsm.interchange import scxml

        return scxml.load(file)
    path = find_machine(file)
    return hsm.load(str(path), chosen_library(library, path))
