"""Hierarchical state machines, written as text: load them, run them step by step, ask what they did and why.

The engine knows no robot. What a machine may name is declared in a ``Library``; its facts and effects are of whatever
types the library is made for.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hsm.engine.explanation import Considered, Verdict
    from hsm.engine.machine import Machine, build
    from hsm.engine.macrostep import Macrostep, Microstep
    from hsm.engine.run import Supervisor
    from hsm.engine.snapshots import SnapshotError
    from hsm.engine.transition import Inputs, transition
    from hsm.interchange import scxml
    from hsm.interchange.backend import TransitionsMachine
    from hsm.model.chart import Model
    from hsm.model.diagnostics import Diagnostic, MachineError, Place, Severity
    from hsm.model.faults import MachineFault, Spin
    from hsm.model.messages import Adjustment, Occurrence
    from hsm.model.registry import Activity, E, F, Library, Outcome, RegistryError, Stoppable
    from hsm.model.types import UNITS, Angle, Duration, Length, Speed, TurnRate, Unit

__all__ = [
    "UNITS",
    "Activity",
    "Adjustment",
    "Angle",
    "Considered",
    "Diagnostic",
    "Duration",
    "Inputs",
    "Length",
    "Library",
    "Machine",
    "MachineError",
    "MachineFault",
    "Macrostep",
    "Microstep",
    "Model",
    "Occurrence",
    "Outcome",
    "Place",
    "RegistryError",
    "Severity",
    "SnapshotError",
    "Speed",
    "Spin",
    "Stoppable",
    "Supervisor",
    "TurnRate",
    "Unit",
    "Verdict",
    "build",
    "load",
    "loads",
    "scxml",
    "to_transitions",
    "transition",
]


_PLACES = {
    "engine.explanation": ("Considered", "Verdict"),
    "engine.machine": ("Machine", "build"),
    "engine.macrostep": ("Macrostep", "Microstep"),
    "engine.run": ("Supervisor",),
    "engine.snapshots": ("SnapshotError",),
    "engine.transition": ("Inputs", "transition"),
    "model.chart": ("Model",),
    "model.diagnostics": ("Diagnostic", "MachineError", "Place", "Severity"),
    "model.faults": ("MachineFault", "Spin"),
    "model.messages": ("Adjustment", "Occurrence"),
    "model.registry": ("Activity", "Library", "Outcome", "RegistryError", "Stoppable"),
    "model.types": ("UNITS", "Angle", "Duration", "Length", "Speed", "TurnRate", "Unit"),
}
"""What comes from which module. Each is imported when it is asked for: a check of a machine needs no engine."""


def __getattr__(name: str) -> Any:
    """Import a name of ``__all__`` at its first use."""
    if name == "scxml":
        return import_module("hsm.interchange.scxml")
    for module, names in _PLACES.items():
        if name in names:
            found = globals()[name] = getattr(import_module(f"hsm.{module}"), name)
            return found
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def _require(value: object, types: tuple[type, ...], what: str) -> None:
    if not isinstance(value, types):
        raise TypeError(f"{what} is a {types[0].__name__}, not {type(value).__name__}")


def _require_library(value: object) -> None:
    from hsm.model.registry import Library  # noqa: PLC0415 - only who loads a machine has one

    _require(value, (Library,), "the library of a machine")


def load(path: str | Path, library: Library[F, E]) -> Machine[F, E]:
    """Load a machine from a ``.maze-machine`` file.

    Args:
        path: the file; its imports are searched for beside it and in the library's folders.
        library: what the machine may name.

    Returns:
        The machine, ready to run.

    Raises:
        MachineError: the file cannot be read or describes no valid machine; all diagnostics are in it.
        TypeError: the path is not a path, or the library is not a ``Library``.
    """
    _require(path, (str, PathLike), "the path of a machine")
    _require_library(library)
    from hsm.dsl import load_model  # noqa: PLC0415 - the engine works without the language
    from hsm.engine.machine import Machine  # noqa: PLC0415 - and the language without the engine

    return Machine(load_model(path, library))


def loads(text: str, library: Library[F, E], file: str = "<text>") -> Machine[F, E]:
    """Load a machine from a text.

    Args:
        text: the content of a ``.maze-machine`` file.
        library: what the machine may name.
        file: the file name shown in diagnostics; imports are searched for beside it.

    Returns:
        The machine, ready to run.

    Raises:
        MachineError: the text describes no valid machine; all diagnostics are in it.
        TypeError: the text is not text, or the library is not a ``Library``.
    """
    _require(text, (str,), "the text of a machine")
    _require(file, (str,), "the file name of a machine")
    _require_library(library)
    from hsm.dsl import parse_model  # noqa: PLC0415 - the engine works without the language
    from hsm.engine.machine import Machine  # noqa: PLC0415 - and the language without the engine

    return Machine(parse_model(text, library, file))


def to_transitions(
    machine: Machine[Any, Any], model: object | None = None, parameters: Mapping[str, Any] | None = None
) -> TransitionsMachine:
    """Build a live machine of the library ``transitions``; send it events with ``model.trigger(name, facts)``.

    Args:
        machine: the machine.
        model: the object that gets the state and the triggers; by default the result itself.
        parameters: values by name, in SI units.

    Returns:
        A ``HierarchicalMachine`` of that library.

    Raises:
        MachineError: the machine uses features outside the shared subset; the error lists all of them.
        ValueError: a parameter is unknown, or one without a default is missing.
        TypeError: the first argument is not a machine.
    """
    from hsm.engine.machine import Machine  # noqa: PLC0415 - only who converts a machine needs it here
    from hsm.interchange.backend import to_transitions as convert  # noqa: PLC0415 - nobody else needs the library

    _require(machine, (Machine,), "what is converted")

    return convert(machine, model, parameters)
