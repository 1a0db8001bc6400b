"""A machine with its scenario files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from hsm.dsl import load_model
from hsm.dsl.reporting.report import Report
from hsm.engine.machine import Machine
from hsm.model.diagnostics import Diagnostic, MachineError
from hsm.model.registry import Library
from hsm.model.values import dataclass
from hsm.testing.scenarios.reading import SUFFIX, heading_place, read_suite, tested_machine
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


def load_machine(path: str | Path, library: Library, assumed: Sequence[str] = ()) -> Machine:
    """A machine without its scenarios, which may be older than its changes.

    Args:
        path: the machine's file, or a file of scenarios, which names it.
        library: what the machine may name.
        assumed: further assumptions, as ``NAME : CLAIM``.

    Raises:
        MachineError: the machine cannot be used; with all diagnostics.
    """
    path = Path(path)
    return Machine(load_model(tested_machine(path) if path.suffix == SUFFIX else path, library, assumed))


def load_tested_machine(path: str | Path, library: Library, assumed: Sequence[str] = ()) -> TestedMachine:
    """A machine with its scenarios.

    Args:
        path: a machine's file, for it and all scenarios beside it that are about it; or one file of scenarios.
        library: what the machine may name.
        assumed: further assumptions, as ``NAME : CLAIM``.

    Raises:
        MachineError: the machine or its scenarios cannot be used; with all diagnostics.
    """
    path = Path(path)
    machine = load_machine(path, library, assumed)
    findings: list[Diagnostic] = []
    suites: list[Suite] = []
    for file in [path] if path.suffix == SUFFIX else sorted(path.parent.glob(f"*{SUFFIX}")):
        try:
            if file == path or _is_about(file, path):
                suites.append(read_suite(file, machine.model, library))
        except MachineError as error:
            findings.extend(error.diagnostics)
    if path.suffix != SUFFIX:  # the requirements of one file may be stated in another
        findings += _unstated(suites)
    if findings:
        raise MachineError(findings)
    return TestedMachine(machine, tuple(suites))


def _unstated(suites: Sequence[Suite]) -> list[Diagnostic]:
    """The names of requirements that are covered, but stated nowhere, although some are; and those stated twice."""
    stated: dict[str, str] = {}
    found: list[Diagnostic] = []
    for suite in suites:
        report = Report(suite.file)
        for one in suite.requirements:
            if one.name in stated and one.place is not None:
                report.add("E0209", one.place, f"requirement `{one.name}` is stated in {stated[one.name]} as well")
            stated.setdefault(one.name, suite.file)
        found += report.found
    for suite in suites if stated else ():
        report = Report(suite.file)
        for covers in (*suite.covered.values(), *(one.covers for one in suite.scenarios)):
            for name, place in covers.items():
                if name not in stated and place is not None:
                    hint = report.guess(name, stated).text or "state it: `requirement NAME what is required`"
                    report.add("E0202", place, f"there is no requirement `{name}`", hint)
        found += report.found
    return found


def _is_about(file: Path, machine: Path) -> bool:
    """Whether a file of scenarios beside a machine is about it.

    Scenarios that run for no machine would be missed by nobody, so they are an error for every machine beside them.

    Raises:
        MachineError: the file does not say what it is about; or there is no such machine; or the file has the name of
            this machine and is about another one.
    """
    about = tested_machine(file)
    if about.name == machine.name:
        return True
    if file.stem != machine.stem and about.is_file():
        return False
    report = Report(str(file))
    if about.is_file():
        message = f"the file is named after machine `{machine.stem}`, and its scenarios are about `{about.stem}`"
        way_out = f"write `test {machine.stem}`, or rename the file"
    else:
        message = f"there is no machine `{about.stem}` beside this file: no machine runs these scenarios"
        known = sorted(one.stem for one in machine.parent.glob(f"*{machine.suffix}"))
        way_out = report.guess(about.stem, known).text or f"write `test {machine.stem}`, or remove the file"
    report.add("E0208", heading_place(file), message, way_out)
    raise MachineError(report.found)
