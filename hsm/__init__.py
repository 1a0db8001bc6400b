"""Hierarchical state machines, written as text: the engine, its registry and the language."""

from __future__ import annotations

from pathlib import Path

from hsm.engine.compiled import Machine, build
from hsm.engine.macrostep import Macrostep, Microstep
from hsm.engine.run import Supervisor
from hsm.engine.snapshots import SnapshotError
from hsm.interchange import scxml
from hsm.model.diagnostics import Diagnostic, MachineError, Place, Severity
from hsm.model.faults import MachineFault, Spin
from hsm.model.registry import Library, Outcome

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
