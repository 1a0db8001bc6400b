"""A machine without its robot: shares its model with ``maze-machine simulate``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf
from typing import Any

from hsm.model.registry import Library
from hsm.testing.scenarios.driver import Driver
from hsm.testing.scenarios.session import Session, SessionError
from hsm.testing.scenarios.watching import property_watch
from maze_machine.debug.chart import Chart
from maze_machine.debug.runs import RunError
from maze_machine.debug.steps import LocalStep, Step
from maze_machine.errors import CommandError
from maze_machine.simulated.console import Console


class TriedRun:
    """A machine without its robot, as in ``maze-machine simulate``: signals and variables can be set."""

    fixed = ""

    def __init__(self, chart: Chart, library: Library[Any, Any], parameters: Mapping[str, Any]) -> None:
        """Start it.

        Raises:
            SessionError: it cannot start.
        """
        self.chart = chart
        self.steps: list[Step] = []
        self._changes: dict[str, str] = {}
        self._driver: Driver | None = None
        self._session = Session(chart.machine, library, parameters, watch=self._watch)
        self._console = Console(self._session)

    @property
    def quiet(self) -> bool:
        """Whether nothing happens until a signal changes or an outcome or event arrives."""
        driver = self._session.driver
        return not self._changes and not driver.last and driver.supervisor.due == inf

    @property
    def over(self) -> str:
        """Why no more steps come."""
        outcome = self._session.driver.outcome
        return "" if outcome is None else f"the machine ended in {outcome}"

    def advance(self) -> bool:
        """One tick, with the signals that were set meanwhile."""
        if self.over:
            return False
        changes, self._changes = self._changes, {}
        try:
            if changes:
                self._session.do(f"when {', '.join(changes.values())}")
            else:
                self._session.tick()
        except SessionError as error:
            raise RunError(str(error)) from None
        return True

    def forget(self) -> int:
        """Does nothing: steps can be undone."""
        return 0

    def pending(self) -> Mapping[str, str]:
        """Signals that get another value in the next step."""
        return self._changes

    def change(self, step: int, name: str, value: str) -> None:
        """Set a signal, for the next step, or a variable, at once."""
        self._return_to(step)
        try:
            if name in self.chart.signals:
                line = setting(name, value.strip())
                self._session.check(f"when {line}")
                self._changes[name] = line
            else:
                self._session.do(f"set {name} = {value}")
        except SessionError as error:
            raise RunError(str(error)) from None
        if name not in self.chart.signals:
            last = self._session.driver
            self.steps[-1] = self._seen(last, self.steps[-1].violations)

    def tell(self, step: int, line: str) -> str:
        """Do a line of a session."""
        self._return_to(step)
        before = self.steps[:]
        try:
            return self._console.answer(line)
        except (SessionError, CommandError) as error:
            if self._driver is not self._session.driver:  # it could not go back and is unchanged
                self.steps[:] = before
                self._driver = self._session.driver
            raise RunError(str(error)) from None

    def hold(self) -> None:
        """It stands still anyway."""

    def go(self, ticks: int | None) -> None:
        """The run continues on request."""

    def close(self) -> None:
        """Nothing to release."""

    def _watch(self, driver: Driver) -> None:
        if driver is not self._driver:  # begun again
            self._driver = driver
            self._violated = property_watch(self.chart.model.properties)
            self.steps.clear()
            initial = driver.supervisor.initial
            if initial is not None:
                values, begun = dict(driver.variables), driver.supervisor.arguments
                self.steps.append(
                    LocalStep(self.chart, initial, values, None, arguments=begun, read=driver.script.read)
                )
        self.steps.append(self._seen(driver, [f"property {one} is violated" for one in self._violated(driver)]))

    def _seen(self, driver: Driver, violations: Sequence[str]) -> Step:
        return LocalStep(
            self.chart,
            driver.last,
            dict(driver.variables),
            driver.outcome,
            arguments=driver.supervisor.arguments,
            before=self.steps[-1] if self.steps else None,
            violations=violations,
            read=driver.script.read,
        )

    def _return_to(self, step: int) -> None:
        """Undo everything after a step."""
        if step >= len(self.steps) - 1:
            return
        try:
            self._session.back_to(self.steps[step].time)
        except SessionError as error:
            raise RunError(str(error)) from None


def setting(name: str, value: str) -> str:
    """A signal with its new value as a scenario writes it."""
    return {"true": name, "false": f"not {name}"}.get(value, f"{name} = {value}")
