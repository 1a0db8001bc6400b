"""A machine with its scenario files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from hsm.dsl import load_model
from hsm.engine.machine import Machine
from hsm.model.diagnostics import Diagnostic, MachineError
from hsm.model.registry import Library
from hsm.testing.scenarios.reading import SUFFIX, read_suite, tested_machine
from hsm.testing.scenarios.scenarios import Suite


@dataclass(frozen=True, slots=True)
class TestedMachine:
    """A machine and its tests.

    Attributes:
        machine: the machine, as it would drive a robot.
        suites: its scenarios, file by file.
    """

    machine: Machine
    suites: tuple[Suite, ...]


def load_machine(path: str | Path, library: Library) -> Machine:
    """A machine without its scenarios, which may be older than its changes.

    Args:
        path: the machine's file, or a file of scenarios, which names it.
        library: what the machine may name.

    Raises:
        MachineError: the machine cannot be used; with all diagnostics.
    """
    path = Path(path)
    return Machine(load_model(tested_machine(path) if path.suffix == SUFFIX else path, library))


def load_tested_machine(path: str | Path, library: Library) -> TestedMachine:
    """A machine with its scenarios.

    Args:
        path: a machine's file, for it and all scenarios beside it that are about it; or one file of scenarios.
        library: what the machine may name.

    Raises:
        MachineError: the machine or its scenarios cannot be used; with all diagnostics.
    """
    path = Path(path)
    machine = load_machine(path, library)
    findings: list[Diagnostic] = []
    suites: list[Suite] = []
    for file in [path] if path.suffix == SUFFIX else suites_beside(path):
        try:
            suites.append(read_suite(file, machine.model, library))
        except MachineError as error:
            findings.extend(error.diagnostics)
    if findings:
        raise MachineError(findings)
    return TestedMachine(machine, tuple(suites))


def suites_beside(machine: Path) -> list[Path]:
    """The files of scenarios in a machine's folder that are about it."""
    found = []
    for file in sorted(machine.parent.glob(f"*{SUFFIX}")):
        try:
            about = tested_machine(file)
        except MachineError:
            continue
        if about.name == machine.name:
            found.append(file)
    return found
