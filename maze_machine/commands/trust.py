"""``maze-machine trust``: which projects may run their own Python code."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from maze_machine.arguments.options import JsonOption
from maze_machine.errors import UsageError


def trust(
    folder: Annotated[
        Path | None, typer.Argument(help="A project's folder. Default: the project of the current folder.")
    ] = None,
    remove: Annotated[bool, typer.Option("--remove", help="Withdraw the trust in the folder.")] = False,
    show: Annotated[bool, typer.Option("--list", help="List the trusted folders and change nothing.")] = False,
    json: JsonOption = False,
) -> None:
    """Trust a project's own library: its settings name Python code, which no command runs without your consent.

    Read the code first. The decision applies to this user and this folder, and is stored in the user's configuration
    folder. A program that has asked the user itself, as an editor does, names the folders of that decision in the
    environment, in MAZE_MACHINE_TRUSTED.

    Example: `maze-machine trust ~/robots/vacuum`

    Example: `maze-machine trust --list`
    """
    from json import dumps

    from maze_machine.catalogue.project import find_project
    from maze_machine.catalogue.trust import distrust, trusted_folders
    from maze_machine.catalogue.trust import trust as remember

    if not show:
        place = Path.cwd() if folder is None else folder
        project = find_project(place)
        if remove:
            distrust(place if project is None else project.folder)
        elif project is None:
            raise UsageError(
                f"{place} is in no project", "a project has a maze-machine.toml; `maze-machine new` makes one"
            )
        else:
            remember(project.folder)
            if not json:
                print(f"{project.folder} is trusted: {project.library or 'it names no code'}")
    if json:
        print(dumps(sorted(map(str, trusted_folders()))))
    elif show or remove:
        print("\n".join(sorted(map(str, trusted_folders()))) or "no folder is trusted")
