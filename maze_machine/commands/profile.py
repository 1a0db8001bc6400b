"""``maze-machine profile``: what is tunable of a robot."""

from __future__ import annotations

from typing import Annotated

import typer

from maze_machine.arguments.completion import complete_profile
from maze_machine.arguments.options import SettingsOption


def profile(
    name: Annotated[
        str | None,
        typer.Argument(
            help="A TOML file, or the name of a shipped profile. Default: that of the project, or pico.",
            autocompletion=complete_profile,
        ),
    ] = None,
    settings: SettingsOption = None,
) -> None:
    """Print a robot profile with every setting, its value and what it means, as a TOML file to start your own from.

    Example: `maze-machine profile pico-hardware --set robot.name=pico2 > mine.toml`
    """
    from maze_machine.catalogue.profile import chosen_profile, profile_text

    print(profile_text(chosen_profile(name, None, settings or ())), end="")
