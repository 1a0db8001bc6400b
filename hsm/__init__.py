"""Hierarchical state machines, written as text: the engine, its registry and the language."""

from __future__ import annotations

from pathlib import Path

from hsm import scxml
from hsm.diagnostics import Diagnostic, MachineError, Place, Severity
from hsm.faults import MachineFault, Spin
from hsm.machine import Machine, build
from hsm.macrostep import Macrostep, Microstep
from hsm.registry import Library, Outcome
from hsm.snapshots import SnapshotError
from hsm.supervisor import Supervisor

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
