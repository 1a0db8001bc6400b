"""Hierarchical state machines, written as text: the engine, its registry and the language."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hsm.engine.machine import Machine, build
from hsm.engine.macrostep import Macrostep, Microstep
from hsm.engine.run import Supervisor
from hsm.engine.snapshots import SnapshotError
from hsm.interchange import scxml
from hsm.model.diagnostics import Diagnostic, MachineError, Place, Severity
from hsm.model.faults import MachineFault, Spin
from hsm.model.registry import Library, Outcome

if TYPE_CHECKING:
    from hsm.interchange.backend import TransitionsMachine

__all__ = [
    "Diagnostic",
    "Library",
    "Machine",
    "MachineError",
    "MachineFault",
    "Macrostep",
    "Microstep",
    "Outcome",
    "Place",
    "Severity",
    "SnapshotError",
    "Spin",
    "Supervisor",
    "build",
    "load",
    "scxml",
    "to_transitions",
]


def load(path: str | Path, library: Library) -> Machine:
    """The machine that a ``.maze-machine`` file describes.

    Args:
        path: the file.
        library: what the machine may name.

    Raises:
        MachineError: the file cannot be read or describes no valid machine; all findings are in it.
    """
    from hsm.dsl import load_model  # noqa: PLC0415 - the engine works without the language

    return build(load_model(path, library))


def to_transitions(
    machine: Machine, model: object | None = None, parameters: Mapping[str, Any] | None = None
) -> TransitionsMachine:
    """A machine on the library ``transitions``, live: events are sent as ``model.trigger(name, facts)``.

    Args:
        machine: the machine.
        model: the object that gets the state and the triggers; by default the result itself.
        parameters: values by name, in SI units.

    Raises:
        MachineError: the machine has something that ``transitions`` does not share; all of it is in the error.
        ValueError: a parameter is unknown, or one without a default is missing.
    """
    from hsm.interchange.backend import to_transitions as convert  # noqa: PLC0415 - nobody else needs the library

    return convert(machine, model, parameters)
