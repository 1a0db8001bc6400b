"""A point of a run as an editor shows it: active states as a call stack, values and reasons as scopes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from hsm.model.diagnostics import Place
from maze_machine.debug.chart import Chart
from maze_machine.debug.debugger import Debugger
from maze_machine.debug.steps import TransitionReason

Item = Mapping[str, object]
_Items = Callable[[], Sequence[Item]]


class Shown:
    """The point of a run that an editor is shown; the references in it hold until the run continues."""

    def __init__(self, chart: Chart) -> None:
        self._chart = chart
        self._debugger: Debugger | None = None
        self._frames: list[tuple[str, str, Place | None]] = []
        self._lists: dict[int, Callable[[], Sequence[Item]]] = {}
        self._reasons: Sequence[TransitionReason] | None = None

    def at(self, debugger: Debugger) -> None:
        """Show where a debugger is."""
        self.forget()
        self._debugger = debugger

    def forget(self) -> None:
        """Show nothing."""
        self._debugger, self._reasons = None, None
        self._frames.clear()
        self._lists.clear()

    def frames(self) -> list[Item]:
        """The call stack: the transitions that are taken next, then the active states, the innermost first."""
        debugger, chart = self._debugger, self._chart
        if debugger is None:
            return []
        model, indices = chart.model, chart.machine.indices
        step, point = debugger.step, debugger.point
        taking = step.transitions(point) if point < step.count else ()
        self._frames = [
            (chart.label(index), model.states[model.transitions[index].source].name, model.transitions[index].place)
            for index in taking
        ]
        active = [(name, model.states[indices[name]].place) for name in reversed(step.states(point))]
        self._frames += [(name, name, place) for name, place in active]
        self._frames.append((f"machine {chart.machine.name}", model.states[0].name, model.states[0].place))
        return [_frame(number, name, place) for number, (name, _, place) in enumerate(self._frames, 1)]

    def scopes(self, frame: int) -> list[Item]:
        """Values, the activity of the state, and the verdict about each of its transitions."""
        debugger = self._debugger
        if debugger is None:
            return []
        if not self._frames:
            self.frames()
        state = self._frames[frame - 1][1] if 0 < frame <= len(self._frames) else ""
        step, point = debugger.step, debugger.point
        found = [self._scope("Variables", self._variables, hint="locals")]
        if self._chart.signals:
            found.append(self._scope("Signals", self._signals))
        doing = step.doing(point).get(state)
        if doing is not None:
            found.append(self._scope("Activity", lambda: [_item("do", doing)]))
        if self._reasons is None:
            self._reasons = step.reasons(point)
        for one in self._reasons:
            if one.state == state:
                found.append(self._scope(f"{one.label}: {one.verdict}", _because(one), line=one.line))
        return found

    def variables(self, reference: int) -> Sequence[Item] | None:
        """The contents of a scope; None if it is no longer valid."""
        found = self._lists.get(reference)
        return None if found is None else found()

    def value(self, name: str) -> tuple[str, str] | None:
        """The value and the type of a variable, a signal or a state; None where there is none of that name."""
        debugger, chart = self._debugger, self._chart
        if debugger is None:
            return None
        variables = debugger.step.variables(debugger.point)
        if name in variables:
            return chart.variable_text(name, variables[name]), chart.type_text(name)
        signals = self._signal_texts()
        if name in signals:
            return signals[name], chart.type_text(name)
        return None

    def _scope(self, name: str, items: _Items, *, hint: str = "", line: int | None = None) -> Item:
        number = len(self._lists) + 1
        self._lists[number] = items
        scope: dict[str, object] = {"name": name, "variablesReference": number, "expensive": False}
        if hint:
            scope["presentationHint"] = hint
        if line is not None:
            scope["line"] = line
        return scope

    def _variables(self) -> Sequence[Item]:
        debugger, chart = self._debugger, self._chart
        if debugger is None:
            return []
        found = debugger.step.variables(debugger.point)
        return [_item(name, chart.variable_text(name, value), chart.type_text(name)) for name, value in found.items()]

    def _signals(self) -> Sequence[Item]:
        return [_item(name, text, self._chart.type_text(name)) for name, text in self._signal_texts().items()]

    def _signal_texts(self) -> Mapping[str, str]:
        debugger, chart = self._debugger, self._chart
        if debugger is None:
            return {}
        found = {name: chart.signal_text(name, value) for name, value in debugger.step.signals().items()}
        waiting = debugger.run.pending() if debugger.newest else {}
        return found | {name: f"{text} (from the next step on)" for name, text in waiting.items()}


def _frame(number: int, name: str, place: Place | None) -> Item:
    if place is None:
        return {"id": number, "name": name, "line": 0, "column": 0}
    path = str(Path(place.file).resolve())
    return {
        "id": number,
        "name": name,
        "source": {"name": Path(place.file).name, "path": path},
        "line": place.line,
        "column": place.column,
        "endLine": place.end_line,
        "endColumn": place.end_column,
    }


def _because(reason: TransitionReason) -> Callable[[], Sequence[Item]]:
    values = [_item(name, text) for name, text in reason.values]
    return lambda: [_item("why", reason.reason), *values]


def _item(name: str, value: str, kind: str = "") -> Item:
    item: dict[str, object] = {"name": name, "value": value, "variablesReference": 0, "evaluateName": name}
    if kind:
        item["type"] = kind
    return item
