"""From the text of a .maze-test file to scenarios, or to all its diagnostics."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from enum import StrEnum
from pathlib import Path
from typing import Any

from hsm.dsl.reporting.report import Report
from hsm.dsl.semantics.typing import Scope
from hsm.dsl.semantics.values import Declared
from hsm.dsl.syntax import ast
from hsm.dsl.syntax.ast import first_token, last_token, place_of
from hsm.dsl.syntax.sources import read_text
from hsm.dsl.syntax.tokens import Token
from hsm.engine.occurrences import event_text
from hsm.model.chart import Emit, Model, On, Raise, Send
from hsm.model.diagnostics import MachineError, Place
from hsm.model.expressions import Literal
from hsm.model.members import library_of_members
from hsm.model.messages import Adjustment, Occurrence
from hsm.model.registry import Library, Parameter, SignalDeclaration
from hsm.model.rewriting import actions_of
from hsm.model.types import BOOLEAN, Quantity
from hsm.model.values import dataclass
from hsm.testing.scenarios.driver import TICK
from hsm.testing.scenarios.lines import (
    Performance,
    Reporting,
    ScenarioLine,
    Sending,
    Setting,
    name_of,
    read_lines,
    text_of,
)
from hsm.testing.scenarios.scenarios import (
    ConditionHolds,
    Expectation,
    ExpectationClause,
    InState,
    Performs,
    Raises,
    Requirement,
    Scenario,
    Stimulus,
    Suite,
)
from hsm.testing.scenarios.script import FAULT, SignalKey
from hsm.testing.scenarios.unusual import unusual_value

SUFFIX = ".maze-test"
"""The suffix of scenario files."""

NAME_OF_REQUIREMENT = re.compile(r"[A-Za-z0-9][\w./-]*")

_DURATION = Quantity(time=1)
_NO_HEADING = "the first line must be `test`, with the machine's name"

SHORTEST_TICK, LONGEST_TICK = 1e-6, 1e6
"""Seconds from one step to the next: at least and at most."""

MOST_STEPS = 1_000_000
"""One line lets time pass for at most this many steps."""


def read_suite(path: str | Path, model: Model, library: Library) -> Suite:
    """The scenarios in a file.

    Args:
        path: the file.
        model: the machine that they are about.
        library: what the machine was checked against.

    Raises:
        MachineError: the file cannot be read, or is invalid; the error has all diagnostics.
    """
    return parse_suite(read_text(path), model, library, str(path))


def tested_machine(path: str | Path) -> Path:
    """The machine's file that a file with scenarios is about: the one beside it that its first line names.

    Raises:
        MachineError: it cannot be read, or does not say.
    """
    return Path(path).with_name(f"{_heading(path).parts[0]}.maze-machine")


def heading_place(path: str | Path) -> Place:
    """The place of the machine's name in the first line of a file with scenarios.

    Raises:
        MachineError: the file cannot be read, or does not say.
    """
    return place_of(str(path), _heading(path).parts[0])


def _heading(path: str | Path) -> ScenarioLine:
    report = Report(str(path))
    line = next(read_lines(read_text(path), report), None)
    if line is not None and line.kind == "heading":
        return line
    if not report.found:
        place = Place(str(path), 1, 1, 1, 2) if line is None else line.place
        report.add("E0401", place, _NO_HEADING)
    raise MachineError(report.found[:1])


def parse_suite(text: str, model: Model, library: Library, file: str = "<text>") -> Suite:
    """The scenarios in a text.

    Raises:
        MachineError: it is invalid; the error has all diagnostics.
    """
    report = Report(file)
    reader = _Reader(model, library, report)
    suite = reader.suite(list(read_lines(text, report)))
    if report.found:
        raise MachineError(sorted(report.found, key=lambda one: (one.place is None, one.place)))
    return suite


def parse_expectation(text: str, model: Model, library: Library, file: str = "<text>") -> Expectation:
    """A condition to wait for, in the syntax of an ``expect`` line: ``in_door``, ``turns == 2``, ``doing drive``.

    Raises:
        MachineError: it cannot be read, or names what the machine does not know.
    """
    report = Report(file)
    reader = _Reader(model, library, report)
    found = [reader.expectation(line) for line in read_lines(f"    expect {text}", report) if line.kind == "expect"]
    if not report.found and len(found) != 1:
        report.add("E0101", Place(file, 1, 1, 1, 2), f"`{text}` is not one condition")
    if report.found:
        raise MachineError(report.found)
    return found[0]


def parse_assignment(text: str, model: Model, library: Library, file: str = "<text>") -> tuple[str, Any]:
    """A variable's or parameter's full name and the value that ``NAME = VALUE`` gives it, in SI units.

    Raises:
        MachineError: it cannot be read, there is no such variable, or the value is not of its type.
    """
    report = Report(file)
    reader = _Reader(model, library, report)
    settings = [part for line in read_lines(f"    given {text}", report) if line.kind == "given" for part in line.parts]
    found = [one for one in map(reader.assignment, settings) if one is not None]
    if not report.found and len(found) != 1:
        report.add("E0101", Place(file, 1, 1, 1, 2), f"`{text}` does not set one variable")
    if report.found:
        raise MachineError(report.found)
    return found[0]


def parse_signal(text: str, model: Model, library: Library, file: str = "<text>") -> tuple[str | SignalKey, Any]:
    """A signal, by name or by name and arguments, with the value that ``NAME``, ``not NAME``, ``NAME = VALUE`` gives.

    Raises:
        MachineError: it cannot be read, there is no such signal, or the value is not of its type.
    """
    report = Report(file)
    reader = _Reader(model, library, report)
    lines = [line for line in read_lines(f"    when {text}", report) if line.kind == "step"]
    signals = [found for line in lines for found in reader.stimulus(line).signals.items()]
    if not report.found and len(signals) != 1:
        report.add("E0101", Place(file, 1, 1, 1, 2), f"`{text}` does not set one signal")
    if report.found:
        raise MachineError(report.found)
    return signals[0]


@dataclass(slots=True)
class _Reader:
    """Resolves the names in a file."""

    model: Model
    library: Library
    report: Report
    scope: Scope = field(init=False)
    parameters: dict[str, Parameter] = field(init=False)
    tick: float = TICK
    states: dict[str, list[str]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        unknown = Place(self.report.file, 1, 1, 1, 1)
        self.library = library_of_members(self.library, self.model.members)
        self.parameters = {one.name: one for one in self.model.parameters}
        declared = {name: Declared(one.type, constant=True, place=unknown) for name, one in self.parameters.items()}
        declared.update(
            {one.name: Declared(one.type, one.constant, one.place or unknown) for one in self.model.variables}
        )
        names = [state.name for state in self.model.states[1:]]
        for name in names:
            self.states.setdefault(name, []).insert(0, name)
            if "." in name:
                self.states.setdefault(name.rpartition(".")[2], []).append(name)
        self.scope = Scope(self.library, self.report, declared, frozenset(names))
        self.scope.enumerations.update((one.__name__, one) for one in self.model.enumerations)
        for one in self.model.variables:  # how instances have ended
            if isinstance(one.initial, Literal) and isinstance(one.initial.value, StrEnum):
                kind = type(one.initial.value)
                if kind.__name__ not in self.scope.enumerations:
                    self.scope.outcomes[kind.__name__] = kind

    def suite(self, lines: list[ScenarioLine]) -> Suite:
        """The whole file."""
        self._headed(lines)
        scenarios: list[Scenario] = []
        titles: set[str] = set()
        requirements: dict[str, Requirement] = {}
        covered: dict[str, dict[str, Place | None]] = {}
        for line in lines[1:]:
            match line.kind:
                case "heading":
                    self.report.add("E0403", line.place, "a second `test`")
                case "tick":
                    self.tick = self._tick(line.parts[0])
                case "requirement":
                    self._require(line, requirements)
                case "covered":
                    covered.setdefault(self._property(line.parts[0]), {}).update(self._covers(line.parts[1:]))
                case "scenario":
                    name = str(line.parts[0]).strip()
                    if name in titles:
                        self.report.add("E0209", line.place, f"scenario `{name}` is declared twice")
                    titles.add(name)
                    scenarios.append(Scenario(name, place=line.place))
                case _ if not scenarios:
                    self.report.add("E0402", line.place, "this line must follow a `scenario` line")
                case _:
                    scenarios[-1] = self._extended(scenarios[-1], line)
        for one in scenarios:
            if not any(isinstance(step, Expectation) for step in one.steps):
                self.report.add("E0403", one.place, f"scenario `{one.name}` expects nothing", "add a line `expect ...`")
        if len(lines) == 1 and not self.report.found:
            self.report.add("E0403", lines[0].place, "there is no scenario below this line", "add `scenario TITLE`")
        stated = tuple(requirements.values())
        return Suite(self.report.file, self.model.name, self.tick, tuple(scenarios), stated, covered)

    def _headed(self, lines: list[ScenarioLine]) -> None:
        """The first line names this machine."""
        if not lines or lines[0].kind != "heading":
            place = lines[0].place if lines else Place(self.report.file, 1, 1, 1, 2)
            self.report.add("E0401", place, _NO_HEADING)
        elif str(lines[0].parts[0]).rpartition(".")[2] != self.model.name:
            name = lines[0].parts[0]
            message = f"these scenarios are about machine `{name}`, and this is `{self.model.name}`"
            self.report.add("E0208", place_of(self.report.file, name), message, f"write `test {self.model.name}`")

    def _require(self, line: ScenarioLine, known: dict[str, Requirement]) -> None:
        """A requirement is stated: its name, then what is required."""
        name, _, text = str(line.parts[0]).strip().partition(" ")
        name = name.removesuffix(":")
        if NAME_OF_REQUIREMENT.fullmatch(name) is None:
            self.report.add("E0211", line.place, f"`{name}` cannot be the name of a requirement", "write it as in `R1`")
        elif not text.strip():
            message = f"requirement `{name}` has no text"
            self.report.add("E0101", line.place, message, f"write what is required: `requirement {name} it stops`")
        elif name in known:
            self.report.add("E0209", line.place, f"requirement `{name}` is stated twice")
        else:
            known[name] = Requirement(name, text.strip(), line.place)

    def _property(self, name: Token) -> str:
        """The name of a property of the machine."""
        known = [one.name for one in self.model.properties]
        if str(name) not in known:
            hint = self.report.guess(name, known)
            self.report.add("E0202", self._span(name), f"the machine has no property `{name}`", hint.text)
        return str(name)

    def _covers(self, names: Sequence[Token]) -> dict[str, Place | None]:
        """The requirements that something covers."""
        return {str(one): self._span(one) for one in names}

    def _extended(self, scenario: Scenario, line: ScenarioLine) -> Scenario:
        if line.kind == "covers":
            if scenario.steps or scenario.given or scenario.parameters:
                message = "`covers` must come directly below the scenario's title"
                self.report.add("E0402", line.place, message, "move the line up")
            return replace(scenario, covers={**scenario.covers, **self._covers(line.parts)})
        if line.kind == "given":
            if scenario.steps:
                self.report.add("E0402", line.place, "`given` must come before the steps", "use `when`")
            parameters, signals = dict(scenario.parameters), dict(scenario.given)
            for setting in line.parts:
                self._set(setting, signals, parameters)
            return replace(scenario, parameters=parameters, given=signals)
        step = self.expectation(line) if line.kind == "expect" else self.stimulus(line)
        return replace(scenario, steps=(*scenario.steps, step))

    def stimulus(self, line: ScenarioLine) -> Stimulus:
        """What a line lets happen."""
        after = None if line.kind == "step" else self._waiting(line.parts[1])
        signals: dict[str | SignalKey, Any] = {}
        reports: dict[str, str] = {}
        failing: set[str] = set()
        events: list[str] = []
        for part in line.parts[1 if line.kind == "step" else 2 :]:
            match part:
                case Setting(subject=Token() as name) if self.model.adjustable_named(str(name)) is not None:
                    events += self._adjustment(part, self.parameters[str(name)])
                case Setting():
                    self._set(part, signals, None)
                case Reporting(name, None) if str(name) in self.library.signals:
                    failing.add(str(name))
                case Reporting(name, outcome):
                    self._report(name, outcome, reports)
                case Sending(event):
                    events += self._event(event)
        return Stimulus(after, signals, reports, frozenset(failing), tuple(events), line.place)

    def _set(self, setting: Setting, signals: dict[str | SignalKey, Any], parameters: dict[str, Any] | None) -> None:
        name, arguments = name_of(setting.subject), isinstance(setting.subject, ast.CallSyntax)
        place = place_of(self.report.file, name)
        parameter = self.parameters.get(str(name)) if parameters is not None and not arguments else None
        signal = self.library.signals.get(str(name))
        if parameter is None and signal is None:
            hint = self.report.guess(
                name, [*self.library.signals, *(self.parameters if parameters is not None else ())]
            )
            self.report.add("E0202", place, f"there is no signal `{name}`", hint.text)
            return
        declared: Parameter | SignalDeclaration | None = parameter or signal
        assert declared is not None
        value = self._value(setting, declared, place)
        if value is None:
            return
        if parameter is not None and parameters is not None:
            parameters[str(name)] = value.value
            return
        key: str | SignalKey | None = str(name)
        if isinstance(setting.subject, ast.CallSyntax) and signal is not None:
            key = self._key(setting.subject, signal)
        if key is not None:
            signals[key] = value.value

    def _adjustment(self, setting: Setting, declared: Parameter) -> list[str]:
        """The new value of an adjustable parameter, as a text; nothing if it is invalid."""
        place = self._span(name_of(setting.subject))
        value = self._value(setting, declared, place)
        if value is None:
            return []
        try:
            return [event_text(self.model, Adjustment(declared.name, value.value))]
        except ValueError as error:
            self.report.add("E0301", place, str(error))
            return []

    def _value(self, setting: Setting, declared: Parameter | SignalDeclaration, place: Place) -> Literal | None:
        if setting.value is None:
            if declared.type != BOOLEAN:
                self.report.add(
                    "E0301", place, f"`{declared.name}` is not a condition", f"write `{declared.name} = ...`"
                )
                return None
            return Literal(not setting.negated, BOOLEAN)
        if setting.negated:
            self.report.add("E0101", place, "`not` cannot be combined with a value")
        if isinstance(declared, SignalDeclaration):
            unusual = unusual_value(setting.value, declared.type, self.scope)
            if unusual is not None:
                return unusual
        value = self.scope.value(setting.value, declared.type)
        if value is not None and not isinstance(value, Literal):
            self.report.add("E0303", self._span(setting.value), "a value in a scenario must be constant")
            return None
        return value

    def _key(self, call: ast.CallSyntax, signal: SignalDeclaration) -> SignalKey | None:
        arguments = self.scope.arguments(call, signal.parameters, f"signal `{signal.name}`")
        if arguments is None:
            return None
        values = [one.value for one in arguments if isinstance(one, Literal)]
        if len(values) < len(arguments):
            self.report.add("E0303", self._span(call), "an argument in a scenario must be constant")
            return None
        return signal.name, tuple(values)

    def _report(self, name: Token, outcome: Token | None, reports: dict[str, str]) -> None:
        calls = {state.name: state.activity for state in self.model.states if state.activity is not None}
        found = {call.activity.name: call.activity for call in calls.values()}
        found.update({state: call.activity for state, call in calls.items()})
        activity = found.get(str(name))
        if activity is None and len(self.states.get(str(name), ())) == 1:
            name = name.instead(self.states[str(name)][0])
            activity = found.get(str(name))
        if activity is None:
            hint = self.report.guess(name, found)
            self.report.add("E0204", self._span(name), f"no state does `{name}`", hint.text)
        elif outcome is not None and outcome not in activity.outcomes:
            hint = self.report.guess(outcome, activity.outcomes)
            known = f"its outcomes are {', '.join(activity.outcomes) or 'none'}"
            message = f"activity `{activity.name}` never reports `{outcome}`"
            self.report.add("E0203", self._span(outcome), message, hint.text or known)
        else:
            reports[str(name)] = FAULT if outcome is None else str(outcome)

    def _event(self, sent: Token | ast.CallSyntax) -> list[str]:
        """The event that is sent, as a text with its data; None if it is invalid."""
        event = name_of(sent)
        heard = {one for t in self.model.transitions if isinstance(t.trigger, On) for one in t.trigger.names}
        patterns = [one.removesuffix("*") for one in heard if one.endswith("*")]
        heard |= {one for one in self.model.events or () if any(map(one.startswith, patterns))}
        if str(event) not in heard and str(event) not in self.library.events:
            self.report.add(
                "E0203",
                self._span(event),
                f"nothing in the machine waits for `{event}`",
                self.report.guess(event, heard).text,
            )
            return []
        data = self.model.data_of(str(event))
        call = sent if isinstance(sent, ast.CallSyntax) else ast.CallSyntax(sent, (), sent, 1)
        fields = () if data is None else data.fields
        values = self.scope.arguments(call, [Parameter(one.name, one.type) for one in fields], f"event `{event}`")
        if values is None:
            return []
        known = {one.name: value.value for one, value in zip(fields, values, strict=True) if isinstance(value, Literal)}
        if len(known) < len(fields):
            self.report.add("E0303", self._span(call), "the data of an event in a scenario must be constant")
            return []
        return [event_text(self.model, Occurrence(str(event), known))]

    def assignment(self, setting: Setting) -> tuple[str, Any] | None:
        """A variable or parameter and its new value."""
        name = name_of(setting.subject)
        place = place_of(self.report.file, name)
        declared = self.scope.variables.get(str(name))
        if declared is None or isinstance(setting.subject, ast.CallSyntax):
            hint = self.report.guess(name, self.scope.variables)
            self.report.add("E0201", place, f"there is no variable or parameter `{name}`", hint.text)
            return None
        value = self._value(setting, Parameter(str(name), declared.type), place)
        return None if value is None else (str(name), value.value)

    def expectation(self, line: ScenarioLine) -> Expectation:
        """What a line expects."""
        parts = [part for part in line.parts if not isinstance(part, tuple)]
        limits = [part[1][0] for part in line.parts if isinstance(part, tuple)]
        claims = [self._claim(part) for part in parts]
        within = self._waiting(limits[0]) if limits else None
        return Expectation(tuple(one for one in claims if one is not None), within, line.place)

    def _claim(self, part: Performance | ast.Expression) -> ExpectationClause | None:
        match part:
            case Performance():
                return self._performs(part)
            case Token(type="NAME" | "NOT_FINITE") if str(part) in self.states:
                return self._in_state(part, negated=False)
            case ast.UnarySyntax(operator="not", operand=Token(type="NAME" | "NOT_FINITE") as name) if (
                str(name) in self.states
            ):
                return self._in_state(name, negated=True)
            case Token(type="NAME") if str(part) not in self.scope.variables and str(part) not in self.library.signals:
                hint = self.report.guess(part, [*self.states, *self.scope.variables, *self.library.signals])
                message = f"there is no state, variable or signal `{part}`"
                self.report.add("E0201", self._span(part), message, hint.text)
                return None
        condition = self.scope.condition(part)
        return None if condition is None else ExpectationClause(ConditionHolds(condition), text_of(part))

    def _in_state(self, name: Token, *, negated: bool) -> ExpectationClause | None:
        found = self.states[str(name)]
        if found[0] != str(name) and len(found) > 1:
            message = f"`{name}` may be {' or '.join(f'`{one}`' for one in found)}"
            self.report.add("E0201", self._span(name), message, "write its full name")
            return None
        return ExpectationClause(InState(found[0], negated), f"{'not ' if negated else ''}{name}")

    def _performs(self, part: Performance) -> ExpectationClause | None:
        if part.keyword.type in ("RAISED", "SENT"):
            return self._raises(part)
        action = part.keyword.type == "CALLED"
        name = name_of(part.what)
        table: Mapping[str, Any] = self.library.actions if action else self.library.activities
        declared = table.get(str(name))
        if declared is None:
            kind = "action" if action else "activity"
            hint = self.report.guess(name, table)
            self.report.add("E0205" if action else "E0204", self._span(name), f"there is no {kind} `{name}`", hint.text)
            return None
        arguments = None
        if isinstance(part.what, ast.CallSyntax):
            arguments = self._given_arguments(part.what, declared.parameters)
            if arguments is None:
                return None
        text = f"{'not ' if part.negated else ''}{part.keyword} {text_of(part.what)}"
        return ExpectationClause(Performs(str(name), arguments, action, part.negated), text)

    def _raises(self, part: Performance) -> ExpectationClause | None:
        sent, word = part.keyword.type == "SENT", str(part.keyword)
        kinds = Emit if sent else Raise | Send
        raised = {one.event for one in actions_of(self.model) if isinstance(one, kinds)}
        name = name_of(part.what)
        if isinstance(part.what, ast.CallSyntax):
            message = f"`{word} {name}` takes only the event's name, without data"
            self.report.add("E0213", self._span(part.what), message, "expect a variable that has received the data")
            return None
        if str(name) not in raised:
            hint = self.report.guess(name, raised).text
            message = f"the machine never {'sends' if sent else 'raises'} `{name}`"
            self.report.add("E0203", self._span(name), message, hint)
            return None
        text = f"{'not ' if part.negated else ''}{word} {name}"
        return ExpectationClause(Raises(str(name), part.negated, sent), text)

    def _given_arguments(self, call: ast.CallSyntax, parameters: tuple[Parameter, ...]) -> dict[int, Any] | None:
        """The given arguments, by position; the others may have any value."""
        positions = {one.name: index for index, one in enumerate(parameters)}
        found: dict[int, Any] = {}
        for position, argument in enumerate(call.arguments):
            index: int | None = position
            node: Any = argument
            if isinstance(argument, ast.Named):
                index, node = positions.get(str(argument.name)), argument.value
            if index is None or index >= len(parameters):
                known = f"its arguments are {', '.join(positions) or 'none'}"
                self.report.add("E0210", self._span(argument), f"`{call.name}` has no such argument", known)
                return None
            kind = parameters[index].type
            value = unusual_value(node, kind, self.scope) or self.scope.value(node, kind)
            if not isinstance(value, Literal):
                if value is not None:
                    self.report.add("E0303", self._span(node), "a value in a scenario must be constant")
                return None
            found[index] = value.value
        return found

    def _seconds(self, node: ast.Expression) -> float | None:
        """A time in seconds; if it is invalid, report it and return None."""
        value = self.scope.value(node, _DURATION)
        if value is None:
            return None
        if not isinstance(value, Literal) or value.value < 0:
            self.report.add("E0303", self._span(node), "a duration in a scenario must be constant and not negative")
            return None
        return float(value.value)

    def _tick(self, node: ast.Expression) -> float:
        """The time from one step to the next."""
        found = self._seconds(node)
        if found is None or SHORTEST_TICK <= found <= LONGEST_TICK:
            return found or TICK
        message = f"the time from one step to the next is {SHORTEST_TICK:g} s to {LONGEST_TICK:g} s"
        self.report.add("E0306", self._span(node), message, "leave the line out: then it is 100 ms")
        return TICK

    def _waiting(self, node: ast.Expression) -> float:
        """A time that passes step by step."""
        found = self._seconds(node) or 0.0
        if found <= MOST_STEPS * self.tick:
            return found
        message = f"this is more than {MOST_STEPS:,} steps of {self.tick:g} s"
        self.report.add(
            "E0306", self._span(node), message, "write a longer `tick` below the first line, or wait for less"
        )
        return 0.0

    def _span(self, node: ast.Expression | ast.Named) -> Place:
        return place_of(self.report.file, first_token(node), last_token(node))
