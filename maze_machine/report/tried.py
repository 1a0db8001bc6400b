"""A machine that is tried without a robot, on a page: its steps as frames, and what a person does there."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from threading import Lock
from typing import Any

from hsm import Machine
from hsm.engine.clock import nanoseconds
from hsm.engine.evaluation import UNSET
from hsm.engine.macrostep import Macrostep
from hsm.interchange.reports import StepReport, model_json, signals_of
from hsm.model.chart import Model
from hsm.model.expressions import SignalValue, VariableValue
from hsm.model.registry import Library
from hsm.model.types import Enumeration, Type
from hsm.model.unparse import value_text
from hsm.testing.scenarios.driver import TICK, Driver
from hsm.testing.scenarios.session import Session, SessionError
from hsm.testing.scenarios.watching import property_watch
from maze_machine.errors import CommandError
from maze_machine.report.pages import sources_of
from maze_machine.simulated.console import Console, moment_text
from maze_machine.view.page import Frame, trial_head

LONGEST = 2_000
"""A longer line is refused, characters."""
STILL = {"pose": [0.0, 0.0, 0.0], "twist": [0.0, 0.0, 0.0], "ring": False}
"""What a tick says of the robot where there is none."""


class TriedMachine:
    """A session of ``maze-machine simulate`` on a page: publishes its steps, and does the lines that come from there.

    Args:
        machine: the machine.
        library: what it was checked against.
        parameters: its parameters, in SI units.
        publish: takes what makes a frame.

    Raises:
        SessionError: it cannot start.
    """

    def __init__(
        self,
        machine: Machine[Any, Any],
        library: Library[Any, Any],
        parameters: Mapping[str, Any],
        publish: Callable[[Callable[[], Frame]], None],
    ) -> None:
        self._publish = publish
        self._signals = _settable(machine.model)
        self._properties = machine.model.properties
        self._driver: Driver | None = None
        self._count = 0
        self._turn = Lock()
        self._console = Console(Session(machine, library, parameters, watch=self._watch), Path())

    def answer(self, question: bytes) -> bytes:
        """Do the line in a question, and say what came of it; both are JSON.

        The question is ``{"line": "when event go"}``. The answer has ``done``, a ``reason`` where it is not done, and
        as ``text`` what the terminal would show. It also has the ``lines`` so far, the signals that have a value, and
        the activities that run with their outcomes. ``enabled`` says what makes each transition of the active states
        fire next.
        """
        with self._turn:
            try:
                line = _line_of(question)
                text, reason = (self._console.answer(line) if line else moment_text(self._console.session.moment)), ""
            except (SessionError, CommandError) as error:
                text, reason = "", str(error)
            return json.dumps({"done": not reason, "reason": reason, "text": text, **self._now()}).encode()

    def _now(self) -> dict[str, Any]:
        session, driver = self._console.session, self._console.session.driver
        try:
            coming = session.prospects()
        except SessionError:
            coming = []
        states, indices = driver.machine.model.states, driver.machine.indices
        doing = []
        for state, performed in driver.doing.items():
            call = states[indices[state]].activity
            doing.append([performed.name, state, [] if call is None else list(call.activity.outcomes)])
        return {
            "lines": list(session.lines),
            "signals": {name: value for name, call in self._signals.items() if (value := _value(driver, call)) != ""},
            "doing": doing,
            "enabled": [[one.transition.index, one.enabled, one.line, one.reason] for one in coming],
            "outcome": driver.outcome,
        }

    def _watch(self, driver: Driver) -> None:
        """Publish a step, microstep by microstep."""
        if driver is not self._driver:  # it has begun again
            self._driver, self._count = driver, 0
            self._look, self._violated = property_watch(self._properties), list[str]()
            if (initial := driver.supervisor.initial) is not None:
                self._show(driver, initial, dict(driver.variables), (), {"restart": True})
        before, self._violated = self._violated, self._look(driver)
        violated = [one for one in self._violated if one not in before]
        steps = driver.microsteps() or [(driver.last, dict(driver.variables))]
        for number, (step, variables) in enumerate(steps, 1):
            said = {"microstep": [number, len(steps)]} if len(steps) > 1 else {}
            self._show(driver, step, variables, violated if number == len(steps) else (), said)

    def _show(
        self,
        driver: Driver,
        step: Macrostep,
        variables: Mapping[str, Any],
        violated: Sequence[str],
        said: Mapping[str, Any],
    ) -> None:
        arguments = {name: performed.arguments for name, performed in driver.doing.items()}
        report = StepReport(driver.machine, step, driver.outcome, variables, arguments)
        self._publish(partial(tried_frame, self._count, report, violated, said))
        self._count += 1


def tried_frame(tick: int, report: StepReport, violated: Sequence[str], said: Mapping[str, Any]) -> Frame:
    """A step as a frame: the JSON of a tick of a robot that stands still."""
    states, indices = report.machine.model.states, report.machine.indices
    innermost = (name for name in report.states if not states[indices[name]].children)
    frame: dict[str, Any] = {
        "tick": tick,
        "stamp": nanoseconds(report.step.time),
        "states": list(report.states),
        "taken": list(report.taken),
        **STILL,
        "doing": next(innermost, ""),
        "fired": [one.index for one in report.transitions],
        "regions": report.regions,
        "activities": report.activities,
        "outcomes": [list(one) for one in report.outcomes],
        "variables": report.values,
        "why": report.why,
    }
    if report.outcome is not None:
        frame["outcome"] = report.outcome
    if violated:
        frame["violated"] = list(violated)
    return {**frame, **said}


def tried_head(machine: Machine[Any, Any], parameters: Mapping[str, Any]) -> dict[str, Any]:
    """What the page gets of a machine that is tried."""
    model = machine.model
    signals = [
        {"name": name, "type": str(one.type), "members": _members(one.type)} for name, one in _settable(model).items()
    ]
    return trial_head(model.name, TICK, model_json(model, parameters), sources_of(model), signals)


def _settable(model: Model) -> dict[str, SignalValue | VariableValue]:
    """What a line can give a value, by its text: the signals that the machine asks for, and adjustable parameters."""
    types = {one.name: one.type for one in model.parameters}
    adjustable = {one.parameter: VariableValue(one.parameter, types[one.parameter]) for one in model.adjustable}
    return {**adjustable, **signals_of(model)}


def _members(kind: Type) -> list[str]:
    return list(kind.members) if isinstance(kind, Enumeration) else []


def _value(driver: Driver, settable: SignalValue | VariableValue) -> Any:
    value = driver.value(settable)
    if value is UNSET:
        return ""
    return value if isinstance(value, bool) else value_text(value, settable.type)


def _line_of(question: bytes) -> str:
    try:
        found = json.loads(question)
    except (ValueError, RecursionError):
        raise SessionError("the question cannot be read") from None
    line = found.get("line") if isinstance(found, dict) else None
    if not isinstance(line, str) or len(line) > LONGEST or "\n" in line:
        raise SessionError(f"a question has a line of at most {LONGEST} characters")
    return line.strip()
