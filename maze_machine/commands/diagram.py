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
        typer.Option("--output", "-o", help="The file to write: .svg, .png, .dot or .mmd (Mermaid).", metavar="FILE"),
    ],
    library: LibraryOption = None,
    depth: Annotated[
        int | None,
        typer.Option(
            min=1,
            max=60,
            metavar="N",
            help="Show states to this depth, including those of imported machines. Default: "
            "all states except those of imported machines.",
        ),
    ] = None,
    state: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Show only this state, given by its full name, and the states inside it."),
    ] = None,
    no_guards: Annotated[bool, typer.Option("--no-guards", help="Omit the conditions after `if`.")] = False,
    theme: Annotated[str, typer.Option(help="light or dark.")] = "light",
    transparent: Annotated[bool, typer.Option("--transparent", help="Use a transparent background.")] = False,
) -> None:
    """Draw a machine: hierarchy, regions, history, guards, time-outs, activities.

    Each imported machine is drawn as one state with the number of states in it. `--depth` shows more or less.

    Pictures need Graphviz, which is in the extra `diagrams`; Mermaid text does not.

    Example: `maze-machine diagram pledge -o pledge.svg`

    Example: `maze-machine diagram tremaux -o inside.png --state explore --no-guards --theme dark`
    """
    from hsm.interchange.diagrams import FORMATS, THEMES, DiagramError, Look, render
    from hsm.interchange.folding import down_to, own_states
    from maze_machine.arguments.files import check_outputs, check_suffix
    from transport.files import write_bytes

    check_outputs({"--output": output}, [file])
    check_suffix("--output", output, [f".{one}" for one in FORMATS])
    if theme not in THEMES:
        raise UsageError(f"--theme {theme}: there is no such theme", f"one of {', '.join(THEMES)}")
    chart = load_chart(file, library)
    opened = down_to(chart.model, depth) if depth is not None else lambda one: one.name == state or own_states(one)
    look = Look(theme, transparent, guards=not no_guards, opened=opened, within=state)
    try:
        drawn = render(chart, output.suffix.removeprefix("."), look)
    except DiagramError as error:
        raise UsageError(str(error)) from None
    write_bytes(output, drawn)


def load_chart(file: str, library: str | None = None) -> Machine:
    """The machine of a ``.maze-machine`` or ``.scxml`` file, or of a machine's name.

    Args:
        file: the file or name.
        library: what the machine may name, as ``MODULE:NAME``; by default that of its project.
    """
    import hsm
    from maze_machine.catalogue.library import chosen_library
    from maze_machine.catalogue.machines import find_machine

    if file.endswith(".scxml"):
        from hsm.interchange import scxml

        return scxml.load(file)
    path = find_machine(file)
    return hsm.load(str(path), chosen_library(library, path))
