"""The coverage of a machine by the tests beside it, shown by an editor above each state."""

from __future__ import annotations

from pathlib import Path

from hsm.dsl.syntax.sources import SUFFIX
from hsm.engine.coverage import Coverage
from hsm.model.diagnostics import MachineError
from hsm.model.registry import Library
from hsm.testing.coverage.items import ItemKind, points
from hsm.testing.scenarios.running import run_suite
from hsm.testing.scenarios.tested_machine import load_tested_machine


class TestedStates:
    """The coverage of the machines that an editor has open, by the last run of their tests."""

    def __init__(self) -> None:
        self._known: dict[str, dict[int, str]] = {}

    def run(self, file: str, library: Library) -> None:
        """Run the scenarios beside a machine, as its files are on the disk; stand-ins run, never a robot's code."""
        path = Path(file)
        self._known.pop(file, None)
        if not file.endswith(SUFFIX):
            return
        try:
            tested = load_tested_machine(path, library)
        except MachineError:
            return
        if not tested.suites:
            return
        results = [one for suite in tested.suites for one in run_suite(suite, tested.machine)]
        coverage = Coverage()
        for result in results:
            coverage = coverage.merge(result.coverage)
        model = tested.machine.model
        taking = [one for one in points(model, coverage) if one.kind is ItemKind.TRANSITION and one.place is not None]
        failed = sum(not one.passed for one in results)
        texts: dict[int, str] = {}
        for state in model.states[1:]:
            if state.place is None or state.place.file != str(path):
                continue
            lines = {model.transitions[index].place for index in state.transitions}
            own = [one for one in taking if one.place in lines]
            entered = coverage.states.get(state.index, 0)
            taken = sum(one.covered for one in own)
            text = f"entered {entered} time{'s' * (entered != 1)}" if entered else "never entered"
            if own:
                text += f", {taken} of {len(own)} transitions taken"
            texts[state.place.line - 1] = f"{text}{f' ({failed} failed)' if failed else ''}"
        self._known[file] = texts

    def texts(self, file: str) -> dict[int, str]:
        """The annotations of the states of a file, by line, from 0."""
        return self._known.get(file, {})
