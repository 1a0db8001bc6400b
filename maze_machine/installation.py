"""Checks that Python finds the packages of this program and not others of the same name."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from importlib.machinery import ModuleSpec
from importlib.util import find_spec
from pathlib import Path

PACKAGES = ("hsm", "skills", "perception", "machines", "transport", "sim")
"""All packages except this one, which is named after the project."""

WITHOUT_SIMULATOR = tuple(one for one in PACKAGES if one != "sim")
"""What a program needs that only drives a robot."""

HOME = Path(__file__).resolve().parents[1]
"""The folder that all packages of this program are in."""


class HiddenPackageError(ImportError):
    """A folder or module of the user has the name of one of our packages and comes first on Python's path."""


def require_packages(names: Iterable[str] = PACKAGES) -> None:
    """Make sure that Python finds our packages under their names.

    Args:
        names: the packages that are needed.

    Raises:
        HiddenPackageError: another package hides one; the message says which, where, and what to do.
    """
    hidden = {name: place for name in names if (place := _place_of(name)) is not None}
    if not hidden:
        return
    listed = ", ".join(f"{place} hides the package `{name}`" for name, place in hidden.items())
    those, them = ("them", "they are") if len(hidden) > 1 else ("it", "it is")
    raise HiddenPackageError(
        f"{listed} of maze-machine (in {HOME}): rename {those}, or run where {them} not on Python's path "
        "(PYTHONPATH, the current folder, the folder that pytest or the library is in)"
    )


def _place_of(name: str) -> Path | None:
    """The place of the package that Python finds under a name; None if it is ours."""
    spec = _spec(name)
    if spec is None:
        return HOME / name
    places = [Path(one).resolve() for one in spec.submodule_search_locations or ()]
    if HOME / name in places:
        return None
    return places[0] if places else Path(spec.origin or name)


def _spec(name: str) -> ModuleSpec | None:
    loaded = sys.modules.get(name)
    return find_spec(name) if loaded is None else loaded.__spec__
