"""The library that a machine is checked against and runs with: that of these robots, or one of somebody's own."""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path

import perception.library
import perception.signals
import skills.library
from hsm.model.registry import Library
from maze_machine.catalogue.machines import SHIPPED
from maze_machine.errors import UsageError
from skills.settings import SkillSettings


def robot_library(settings: SkillSettings | None = None) -> Library:
    """Everything that a maze robot's machine may name: perception's signals, motion skills, the door bell, events.

    What a machine imports is looked for among the shipped machines, too.

    Args:
        settings: the gains of the robot's motion skills; by default those of PICO.
    """
    library = Library("maze robot", folders=[SHIPPED])
    library.include(perception.library.LIBRARY)
    library.include(skills.library.library(settings or SkillSettings()))
    return library


def named_library(name: str, folder: Path | None = None) -> Library:
    """A library of one's own, by its name.

    Args:
        name: ``module:function`` for a function that gives the library, or ``module:name`` for the library itself.
        folder: where modules are looked for as well; by default the present folder.

    Raises:
        UsageError: there is no such library.
    """
    module, _, attribute = name.partition(":")
    if not module or not attribute:
        raise UsageError(f"`{name}` names no library", "give a module and a function, such as `my_robot:library`")
    place = str((folder or Path.cwd()).resolve())
    if place not in sys.path:
        sys.path.insert(0, place)
    try:
        found = getattr(import_module(module), attribute)
    except ModuleNotFoundError as error:
        if error.name != module.split(".")[0] and error.name != module:
            raise
        way_out = f"it is looked for in {place} and among what is installed"
        raise UsageError(f"there is no module `{module}`", way_out) from None
    except AttributeError:
        raise UsageError(f"module `{module}` has no `{attribute}`") from None
    try:
        made = found if isinstance(found, Library) else found()
    except TypeError as error:
        raise UsageError(f"`{name}` gives no library: {error}") from None
    if not isinstance(made, Library):
        raise UsageError(f"`{name}` gives no library but {made!r}")
    return made
