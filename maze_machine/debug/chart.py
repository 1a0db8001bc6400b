"""Names of a machine's transitions, signals and lines for a debugger."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hsm import Machine
from hsm.interchange.reports import signals_of
from hsm.model.chart import Model, StateKind
from hsm.model.diagnostics import Place
from hsm.model.registry import Library
from hsm.model.types import Type
from hsm.model.unparse import trigger_text, value_text


@dataclass(frozen=True, slots=True)
class Spot:
    """A line of a file where a run can be stopped.

    Attributes:
        line: from 1.
        states: the states that begin there, by name; several where a machine is imported several times.
        transitions: the transitions that are written there, by index.
    """

    line: int
    states: frozenset[str]
    transitions: frozenset[int]


class Chart:
    """The parts of a machine that a debugger names.

    Attributes:
        machine: the machine whose runs are seen.
        library: what it was checked against.
        signals: the signals that it uses, each as it is written.
    """

    def __init__(self, machine: Machine[Any, Any], library: Library[Any, Any]) -> None:
        self.machine = machine
        self.library = library
        self.signals = signals_of(machine.model)
        self._types: dict[str, Type] = {one.name: one.type for one in self.model.parameters}
        self._types.update((one.name, one.type) for one in self.model.variables)
        self._spots = _spots(self.model)

    @property
    def model(self) -> Model:
        """The declaration."""
        return self.machine.model

    def label(self, index: int) -> str:
        """A transition in one line: what it waits for and where it leads."""
        one = self.model.transitions[index]
        targets = ", ".join(self.model.states[target].name for target in one.targets)
        return " ".join(filter(None, (trigger_text(one.trigger, one.guard), f"-> {targets}" if targets else "")))

    def variable_text(self, name: str, value: object) -> str:
        """A variable's value, with its unit."""
        return value_text(value, self._types.get(name))

    def signal_text(self, text: str, value: object) -> str:
        """A signal's value, with its unit."""
        call = self.signals.get(text)
        return value_text(value, None if call is None else call.signal.type)

    def type_text(self, name: str) -> str:
        """The type of a variable or of a signal as it is written; empty where there is none of that name."""
        if name in self.signals:
            return str(self.signals[name].signal.type)
        return str(self._types[name]) if name in self._types else ""

    def state(self, name: str) -> str | None:
        """The full name of a state by its full or, where only one is called so, its own name; None where there is none.

        A variable or a signal of that name comes first.
        """
        if self.type_text(name):
            return None
        names = [one.name for one in self.model.states[1:]]
        own = [one for one in names if one.rpartition(".")[2] == name]
        return name if name in names else own[0] if len(own) == 1 else None

    def in_order(self, names: Iterable[str]) -> tuple[str, ...]:
        """States in the order of the document."""
        return tuple(sorted(names, key=self.machine.indices.__getitem__))

    def spot(self, file: str, line: int) -> Spot | None:
        """The line where a breakpoint for a line applies: itself, or the nearest one above, or the first one below.

        Args:
            file: the file's path.
            line: from 1.
        """
        spots = self._spots.get(_resolved(file), ())
        above = [one for one in spots if one.line <= line]
        return above[-1] if above else next(iter(spots), None)

    def spots(self, file: str, first: int, last: int) -> list[Spot]:
        """All places between two lines where a run can be stopped."""
        return [one for one in self._spots.get(_resolved(file), ()) if first <= one.line <= last]


def _spots(model: Model) -> Mapping[str, list[Spot]]:
    """The lines of each file that a state or a transition has, in order."""
    found: dict[tuple[str, int], tuple[set[str], set[int]]] = {}

    def at(place: Place) -> tuple[set[str], set[int]]:
        return found.setdefault((_resolved(place.file), place.line), (set(), set()))

    for state in model.states[1:]:
        if state.place is not None and state.kind not in (StateKind.SHALLOW_HISTORY, StateKind.DEEP_HISTORY):
            at(state.place)[0].add(state.name)
    for transition in model.transitions:
        if transition.place is not None:
            at(transition.place)[1].add(transition.index)
    files: dict[str, list[Spot]] = {}
    for (file, line), (states, transitions) in sorted(found.items()):
        files.setdefault(file, []).append(Spot(line, frozenset(states), frozenset(transitions)))
    return files


def _resolved(file: str) -> str:
    return str(Path(file).resolve())
