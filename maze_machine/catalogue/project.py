"""A project's settings: the library of its machines, their folders, and the robot.

A project is a folder with a file ``maze-machine.toml``, or with a table ``[tool.maze-machine]`` in its
``pyproject.toml``. It applies to all machines in that folder and below it.

    library = "my_robot:library"       # a function or a Library in Python, as MODULE:NAME
    machines = ["machines"]            # folders whose machines are found by name, before the shipped ones
    robot = "robots/vacuum.toml"       # the robot's profile, for every command that takes --robot
    maze = "mazes/home.maze"           # where `run` drives by default
    ignore = ["N0701"]                 # warnings and notes that `check` leaves out
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from maze_machine.errors import FileError

NAME = "maze-machine.toml"
PYPROJECT = "pyproject.toml"
_KEYS = {"library": str, "machines": list, "robot": str, "maze": str, "ignore": list}
_LARGEST = 1_000_000  # bytes: a larger file cannot be a settings file


@dataclass(frozen=True, slots=True)
class Project:
    """The settings of a folder of machines.

    Attributes:
        file: where they are written.
        library: ``MODULE:NAME`` of the machines' library; None for the shipped one.
        machines: folders whose machines are found by name.
        robot: a profile, by name or as a path; None if the project has none.
        maze: a maze, by name or as a path; None if the project has none.
        ignore: prefixes of the codes of warnings and notes that ``check`` leaves out.
    """

    file: Path
    library: str | None = None
    machines: tuple[Path, ...] = ()
    robot: str | None = None
    maze: str | None = None
    ignore: tuple[str, ...] = ()

    @property
    def folder(self) -> Path:
        """The project's folder: relative paths and modules are looked up from it."""
        return self.file.parent


def find_project(start: Path) -> Project | None:
    """The innermost project around a file or folder, or None if there is none.

    Raises:
        FileError: its settings cannot be read or are wrong.
    """
    place = start.resolve()
    for folder in (place, *place.parents):
        own = folder / NAME
        if own.is_file():
            return read_project(own)
        shared = folder / PYPROJECT
        if shared.is_file() and (found := _in_pyproject(shared)) is not None:
            return found
    return None


def read_project(file: Path) -> Project:
    """The project that a ``maze-machine.toml`` describes.

    Raises:
        FileError: the file cannot be read or has an unknown setting.
    """
    return _project(file, _table(file))


def _in_pyproject(file: Path) -> Project | None:
    """The project of a ``pyproject.toml``; an unreadable one is ignored."""
    try:
        tool = _table(file).get("tool", {})
    except FileError:
        return None
    own = tool.get("maze-machine") if isinstance(tool, dict) else None
    return _project(file, own) if isinstance(own, dict) else None


def _table(file: Path) -> dict[str, Any]:
    try:
        if file.stat().st_size > _LARGEST:
            raise FileError(f"{file} is too large for a settings file", f"the limit is {_LARGEST} bytes")
        return tomllib.loads(file.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise FileError(f"{file} cannot be read: {error.strerror or error}") from None
    except (UnicodeDecodeError, tomllib.TOMLDecodeError, RecursionError) as error:
        raise FileError(f"{file} is not valid TOML: {error}") from None


def _project(file: Path, table: dict[str, Any]) -> Project:
    for key, value in table.items():
        kind = _KEYS.get(key)
        if kind is None:
            close = get_close_matches(key, _KEYS, n=1)
            hint = f"did you mean `{close[0]}`?" if close else f"known: {', '.join(_KEYS)}"
            raise FileError(f"{file}: unknown setting `{key}`", hint)
        if not isinstance(value, kind) or (kind is list and not all(isinstance(one, str) for one in value)):
            expected = "a list of strings" if kind is list else "a string"
            raise FileError(f"{file}: `{key}` is {expected}, not {value!r}")
    folders = tuple(file.parent / one for one in table.get("machines", ()))
    robot, maze = (_beside(file, table.get(name)) for name in ("robot", "maze"))
    return Project(file, table.get("library"), folders, robot, maze, tuple(table.get("ignore", ())))


def _beside(file: Path, name: str | None) -> str | None:
    """A file by its path from the project's folder; else a name, as it is written."""
    path = file.parent / name if name is not None else None
    return str(path) if path is not None and path.is_file() else name


def default_robot(named: str | None = None, near: str | None = None) -> str:
    """The robot's profile: the one that is named, else that of the project, else PICO's.

    Args:
        named: what the user has named, or None.
        near: a machine; where it is a file, its project counts, else that around the present folder.

    Raises:
        FileError: the project's settings are wrong.
    """
    if named is not None:
        return named
    project = _project_near(near)
    return project.robot if project is not None and project.robot is not None else "pico"


def default_maze(otherwise: str, near: str | None = None) -> str:
    """The maze of the project, or another one where it has none.

    Args:
        otherwise: that one.
        near: as for ``default_robot``.

    Raises:
        FileError: the project's settings are wrong.
    """
    project = _project_near(near)
    return project.maze if project is not None and project.maze is not None else otherwise


def _project_near(machine: str | None) -> Project | None:
    return find_project(Path(machine).parent if machine is not None and Path(machine).is_file() else Path.cwd())
