"""``maze-machine new``: a project to begin with."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from maze_machine.arguments.options import JsonOption


def new(
    name: Annotated[str, typer.Argument(help="The machine's name.")],
    folder: Annotated[
        Path | None, typer.Option(metavar="FOLDER", help="The folder to create. Default: a new folder of that name.")
    ] = None,
    json: JsonOption = False,
) -> None:
    """Make a project: a machine, its tests, the library of a small robot, a loop that drives it, editor and CI files.

    The new project passes its checks and tests; change it step by step into your own. No file is overwritten. The
    library of the project is trusted, since this command wrote it.

    Example: `maze-machine new vacuum`
    """
    from json import dumps
    from shlex import quote

    from maze_machine.catalogue.template import make_project
    from maze_machine.catalogue.trust import trust

    place = Path(name) if folder is None else folder
    written = make_project(name, place)
    trust(place)
    if json:
        print(dumps([str(path) for path in written]))
        return
    print("\n".join(str(path) for path in written))
    machine = f"{name}.maze-machine"
    print(f"\nNow: cd {quote(str(place))} && maze-machine check {machine} && maze-machine test {machine}")
