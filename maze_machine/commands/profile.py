"""``maze-machine profile``: what is tunable of a robot."""

from __future__ import annotations

from typing import Annotated

import typer

from maze_machine.arguments.completion import complete_profile
from maze_machine.arguments.options import SettingsOption


def profile(
    name: Annotated[
        str, typer.Argument(help="A TOML file, or the name of a shipped profile.", autocompletion=complete_profile)
    ] = "pico",
    settings: SettingsOption = None,
) -> None:
    """Print a robot profile with every setting, its value and what it means, as a TOML file to start your own from.

    Example: `maze-machine profile pico-hardware --set robot.name=pico2 > mine.toml`
    """
    from maze_machine.catalogue.profile import load_profile, profile_text

    print(profile_text(load_profile(name, settings or ())), end="")
