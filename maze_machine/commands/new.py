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
    robot: Annotated[
        bool,
        typer.Option(
            "--robot",
            help="Make the machine of a robot with a laser: it uses the shipped signals and skills besides its own, "
            "and drives in the simulator or over the network.",
        ),
    ] = False,
    json: JsonOption = False,
) -> None:
    """Create a project: a machine, its tests, its own library, a robot to drive, editor and CI files.

    The machine drives a toy robot in a loop that you replace by your own; with `--robot` it drives a robot with a laser
    in the simulator, and its project has a profile and a maze. The new project passes its checks and tests; change it
    step by step into your own. No file is overwritten. The library of the project is trusted, since this command wrote
    it.

    Example: `maze-machine new vacuum`

    Example: `maze-machine new courier --robot`
    """
    from json import dumps
    from shlex import quote

    from maze_machine.catalogue.template import make_project
    from maze_machine.catalogue.trust import trust

    place = Path(name) if folder is None else folder
    written = make_project(name, place, robot=robot)
    trust(place)
    if json:
        print(dumps([str(path) for path in written]))
        return
    print("\n".join(str(path) for path in written))
    then = f"maze-machine run {name}" if robot else "python drive.py"
    print(f"\nNow: cd {quote(str(place))} && maze-machine check && maze-machine test {name}.maze-machine && {then}")
