"""The library that a machine is checked against and runs with: the shipped one, or one of the user's own."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from importlib import import_module
from inspect import Parameter, signature
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from hsm.model.registry import Library
from maze_machine.catalogue.machines import SHIPPED
from maze_machine.catalogue.manifest import shipped_names
from maze_machine.catalogue.project import Project, find_project
from maze_machine.catalogue.trust import require_trust
from maze_machine.errors import UsageError
from maze_machine.installation import HiddenPackageError, require_packages

if TYPE_CHECKING:
    from perception.facts import Facts
    from skills.settings import SkillSettings
    from transport.description import RobotDescription
    from transport.messages import Command

RobotLibrary: TypeAlias = "Library[Facts, Command]"
"""The type of a maze robot's library: its facts, and its commands."""


def robot_library(settings: SkillSettings | None = None, robot: RobotDescription | None = None) -> RobotLibrary:
    """Everything that a maze robot's machine may name: perception's signals, motion skills, the robot's constants.

    Imports are also searched for among the shipped machines.

    Args:
        settings: the gains of the robot's motion skills; by default those of PICO.
        robot: the robot; by default PICO.
    """
    # Checking a machine needs none of this, and it takes half a second to import.
    import perception.signals  # noqa: PLC0415
    import skills.catalogue  # noqa: PLC0415
    from maze_machine.catalogue.constants import robot_constants  # noqa: PLC0415
    from skills.settings import SkillSettings  # noqa: PLC0415
    from transport.description import RobotDescription  # noqa: PLC0415

    settings, robot = settings or SkillSettings(), robot or RobotDescription()
    library: RobotLibrary = Library("maze robot", folders=[SHIPPED])
    library.include(perception.signals.LIBRARY)
    library.include(skills.catalogue.library(settings, robot))
    library.include(robot_constants(robot, settings))
    return library


def robot_names() -> RobotLibrary:
    """The declarations of the same library: enough for checks, editors and tests, and fast to import."""
    return shipped_names(SHIPPED)


def chosen_library(
    named: str | None,
    machine: Path | None = None,
    shipped: Callable[[], RobotLibrary] | None = None,
    ask: Callable[[str], bool] | None = None,
    *,
    vouched: bool = False,
) -> RobotLibrary:
    """The library that a machine is written against.

    It is the one named on the command line; otherwise that of the machine's project, if it names one and the user
    trusts it; otherwise the shipped one. A shipped machine belongs to no project.

    Args:
        named: ``MODULE:NAME``, or None.
        machine: the machine's file, or a folder of machines; None for the present folder.
        shipped: returns the shipped library for driving; by default only its declarations, with the constants of the
            project's robot.
        ask: asks a person whether to trust a project; by default a question on the terminal where there is one.
        vouched: the caller has checked that the user trusts the project.

    Raises:
        UsageError: there is no such library, or its project is not trusted.
        FileError: the project's settings are wrong.
    """
    is_shipped = machine is not None and machine.resolve().parent == SHIPPED.resolve()
    project = None if is_shipped else find_project(Path.cwd() if machine is None else machine.resolve())
    whole = shipped or partial(_library_for, project)
    if named is not None:
        library = named_library(named, shipped=whole)
    elif project is not None and project.library is not None:
        if not vouched:
            require_trust(project, ask)
        library = named_library(project.library, project.folder, whole)
    else:
        library = shipped() if shipped is not None else _names_for(project)
    return library if project is None else replace(library, folders=[*project.machines, *library.folders])


def _library_for(project: Project | None) -> RobotLibrary:
    """The shipped library as the robot of a project has it."""
    if project is None or project.robot is None:
        return robot_library()
    from maze_machine.catalogue.profile import load_profile  # noqa: PLC0415 - only where a project has its own robot

    profile = load_profile(project.robot)
    return robot_library(profile.skills, profile.robot)


def _names_for(project: Project | None) -> RobotLibrary:
    """The names of the shipped library, with the constants of a project's robot."""
    names = robot_names()
    if project is None or project.robot is None:
        return names
    # Only a project with its own robot loads the modules that compute a robot's constants.
    from maze_machine.catalogue.constants import robot_constants  # noqa: PLC0415
    from maze_machine.catalogue.profile import load_profile  # noqa: PLC0415

    profile = load_profile(project.robot)
    return replace(names, constants={**names.constants, **robot_constants(profile.robot, profile.skills).constants})


def named_library(
    name: str, folder: Path | None = None, shipped: Callable[[], RobotLibrary] = robot_library
) -> RobotLibrary:
    """A library of your own, by its name.

    Args:
        name: ``module:name`` for the library itself, or ``module:function`` for a function that gives it: one without
            arguments, or one that is given the shipped library and adds names to it.
        folder: where modules are searched for as well; by default the present folder.
        shipped: returns the library that such a function is given.

    Raises:
        UsageError: there is no such library.
    """
    found = _imported(name, (folder or Path.cwd()).resolve())
    try:
        made = found if isinstance(found, Library) else found(shipped()) if _takes_one(found) else found()
    except Exception as error:  # the module is foreign: any exception is an error in it, not in this program
        raise UsageError(f"`{name}` returns no library: {_fault(error)}") from None
    if not isinstance(made, Library):
        raise UsageError(f"`{name}` returns no library but {made!r}")
    return made


def _imported(name: str, folder: Path) -> Any:
    """The object of a module that is named ``module:name``; the module may lie in a folder."""
    module, _, attribute = name.partition(":")
    if not all(part.isidentifier() for part in (*module.split("."), attribute)):
        raise UsageError(f"`{name}` names no library", "give a module and a function, such as `my_robot:library`")
    place = str(folder)
    if place not in sys.path:
        sys.path.insert(0, place)
    try:
        require_packages()
        return getattr(import_module(module), attribute)
    except HiddenPackageError as error:
        raise UsageError(str(error)) from None
    except ModuleNotFoundError as error:
        if error.name != module.split(".")[0] and error.name != module:
            raise UsageError(f"`{name}` cannot be imported: {_fault(error)}") from None
        way_out = f"searched in {place} and in the installed packages"
        raise UsageError(f"there is no module `{module}`", way_out) from None
    except AttributeError:
        raise UsageError(f"module `{module}` has no `{attribute}`") from None
    except Exception as error:  # the module is foreign, as above
        raise UsageError(f"`{name}` cannot be imported: {_fault(error)}") from None


def _takes_one(function: Callable[..., object]) -> bool:
    """Whether a function must be given one argument."""
    needed = [one for one in signature(function).parameters.values() if one.default is Parameter.empty]
    return [one.kind in {Parameter.POSITIONAL_ONLY, Parameter.POSITIONAL_OR_KEYWORD} for one in needed] == [True]


def _fault(error: Exception) -> str:
    """The error in a foreign module, with its place."""
    last = traceback.extract_tb(error.__traceback__)[-1]
    told = str(error) if isinstance(error, SyntaxError) else f"{error} ({Path(last.filename).name}, line {last.lineno})"
    return f"{type(error).__name__}: {told}"
