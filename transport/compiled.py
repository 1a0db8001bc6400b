"""Functions that exist twice: as Python and, where the package was built with a C compiler, as machine code.

The two give the same bits, so it does not matter which one runs. The Python is the definition, and it is what runs
where no compiler was there; ``MAZE_MACHINE_PLAIN=1`` in the environment asks for it, too.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib.machinery import PathFinder
from importlib.util import find_spec, module_from_spec
from types import ModuleType
from typing import Any, TypeVar

Function = TypeVar("Function", bound=Callable[..., Any])

PLAIN = "MAZE_MACHINE_PLAIN"
"""The variable of the environment that turns the machine code off."""
PACKAGES = ("transport", "sim", "perception", "skills")
"""The packages that have kernels; each has them in a module ``_kernels`` of its own."""


@dataclass(frozen=True)
class Twins:
    """One function in both forms.

    Attributes:
        plain: as Python.
        fast: as machine code; None where it was not built.
    """

    plain: Callable[..., Any]
    fast: Callable[..., Any] | None


TWINS: dict[str, Twins] = {}
"""What exists twice, by package and name, as far as its modules are imported."""


@cache
def kernels_of(package: str) -> ModuleType | None:
    """The machine code of a package, which itself is not imported; None where it was not built."""
    parent = find_spec(package)
    places = None if parent is None else parent.submodule_search_locations
    spec = None if places is None else PathFinder.find_spec(f"{package}._kernels", list(places))
    if spec is None or spec.loader is None:
        return None
    try:
        module = module_from_spec(spec)
        spec.loader.exec_module(module)
    except ImportError:
        return None
    return module


def compiled(function: Function) -> Function:
    """Decorator: the kernel of the same name in the function's package if it was built, otherwise the function."""
    package = function.__module__.partition(".")[0]
    fast: Function | None = getattr(kernels_of(package), function.__name__.lstrip("_"), None)
    TWINS[f"{package}.{function.__name__.lstrip('_')}"] = Twins(function, fast)
    return function if fast is None or os.environ.get(PLAIN) else fast


def arithmetic_in_use() -> str:
    """In words, which of the two runs here."""
    missing = [package for package in PACKAGES if kernels_of(package) is None]
    if missing:
        return "plain Python: built without a C compiler"
    return f"plain Python: {PLAIN} is set" if os.environ.get(PLAIN) else "compiled kernels"
