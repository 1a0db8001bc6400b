"""From a chart to the text of a ``.maze-machine`` file, as far as the language has counterparts."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import field

from hsm.model.chart import Action, Model, On, Raise, State, StateKind, Transition, TransitionKind
from hsm.model.codes import finding
from hsm.model.diagnostics import Diagnostic, MachineError, Place
from hsm.model.expressions import Active, Binary, Expression, Literal, Unary
from hsm.model.topology import HISTORY, Topology
from hsm.model.types import BOOLEAN
from hsm.model.unparse import expression_text
from hsm.model.values import dataclass

_WORDS = {"machine", "import", "param", "var", "event", "state", "parallel", "final", "initial", "do", "entry", "exit"}
_WORDS |= {
    "on",
    "when",
    "after",
    "stay",
    "property",
    "if",
    "and",
    "or",
    "not",
    "true",
    "false",
    "raise",
    "in",
    "min",
    "max",
}


_DEEPEST = 1000
"""Text that is indented further grows with the square of its depth."""


def to_machine_text(model: Model) -> str:
    """The text of a machine with the same behaviour as the chart; not formatted yet.

    Names become names of the language: other characters become underscores.

    Raises:
        MachineError: the chart has features that the language lacks; the error lists all of them.
    """
    names = _names(model)
    writer = _Translator(model, names)
    lines = list(writer.lines())
    if writer.findings:
        raise MachineError(writer.findings)
    return "\n".join(lines) + "\n"


def _names(model: Model) -> dict[str, str]:
    """For each state and event its name in the language, no two alike."""
    states = [state.name for state in model.states if state.kind not in HISTORY]
    found: dict[str, str] = {}
    for name in dict.fromkeys(states):
        wanted = _word(name)
        while wanted in found.values():
            wanted += "_"
        found[name] = wanted
    return found


def _word(name: str) -> str:
    word = re.sub(r"\W", "_", name, flags=re.ASCII)
    return f"{word}_" if word in _WORDS else f"_{word}" if word[:1].isdigit() or not word else word


@dataclass
class _Translator:
    """One chart.

    Attributes:
        model: the chart.
        names: the name of each state in the language.
        findings: the features without a counterpart in the language.
        known: the events that the chart names.
        raises: the chart makes events itself: it raises them, or waits for completions.
    """

    model: Model
    names: dict[str, str]
    findings: list[Diagnostic] = field(default_factory=list)
    known: tuple[str, ...] = ()
    raises: bool = False

    def __post_init__(self) -> None:
        self.known = tuple(dict.fromkeys(self._events()))
        waits = (one.trigger.names for one in self.model.transitions if isinstance(one.trigger, On))
        completes = any(name.startswith("done.") for names in waits for name in names)
        self.raises = completes or any(isinstance(one, Raise) for one in self._all_actions())

    def lines(self) -> Iterator[str]:
        """The lines of the machine."""
        root = self.model.states[0]
        if self.model.store is not None:
            self._refuse("a data model", root.place)
            return
        if Topology(self.model).depth > _DEEPEST:
            self._refuse(f"states nested more than {_DEEPEST} deep", root.place)
            return
        yield f"machine {self.names[root.name]}"
        yield ""
        events = sorted(set(map(_word, self.known)))
        if events:
            yield f"event {', '.join(events)}"
            yield ""
        yield from self._inside(root, 0)
        depths = {0: -1}
        for state in self.model.states[1:]:
            depths[state.index] = depths[state.parent] + 1
            if state.kind not in HISTORY:
                yield ""
                yield from self._state(state, depths[state.index])

    def _events(self) -> Iterator[str]:
        for transition in self.model.transitions:
            if isinstance(transition.trigger, On):
                names = (one.removesuffix(".") for one in transition.trigger.names)
                yield from (one for one in names if "*" not in one and not one.startswith("done."))
        for action in self._all_actions():
            if isinstance(action, Raise):
                yield action.event

    def _all_actions(self) -> Iterator[Action]:
        for state in self.model.states:
            yield from (*state.initial_actions, *state.entry, *state.exit)
        for transition in self.model.transitions:
            yield from transition.actions

    def _refuse(self, reason: str, place: Place | None) -> None:
        self.findings.append(finding("E0922", place, f"the language has no counterpart: {reason}"))

    def _state(self, state: State, depth: int) -> Iterator[str]:
        word = {StateKind.PARALLEL: "parallel", StateKind.FINAL: "final"}.get(state.kind, "state")
        yield f"{'    ' * depth}{word} {self.names[state.name]}"
        if state.kind is StateKind.FINAL and (state.entry or state.exit):
            self._refuse(f"actions of the final state `{state.name}`", state.place)
        yield from self._inside(state, depth + 1)

    def _inside(self, state: State, depth: int) -> Iterator[str]:
        """The lines of a state before its inner states."""
        indent = "    " * depth
        if state.kind is StateKind.COMPOUND:
            initial = [self.model.states[one] for one in state.initial]
            if len(initial) != 1 or initial[0].parent != state.index or initial[0].kind in HISTORY:
                self._refuse(f"the initial state of `{state.name}` is not one of its own", state.place)
            else:
                yield f"{indent}initial {self.names[initial[0].name]}{self._slash(state.initial_actions)}"
        for word, actions in (("entry", state.entry), ("exit", state.exit)):
            if actions:
                yield f"{indent}{word}{self._slash(actions)}"
        for index in state.transitions:
            transition = self.model.transitions[index]
            if not transition.targets and not transition.actions:
                self._refuse("a transition that does nothing, and only hides others", transition.place)
            yield indent + "".join(
                (
                    self._trigger(state, transition),
                    self._targets(state, transition),
                    self._slash(transition.actions),
                )
            )

    def _trigger(self, state: State, transition: Transition) -> str:
        guard = None if transition.guard is None else expression_text(self._renamed(transition.guard))
        if not isinstance(transition.trigger, On):
            if self.raises:
                self._refuse(
                    "a transition without an event, which comes before events that are raised", transition.place
                )
            return f"when {guard or 'true'}"
        events = []
        for name in transition.trigger.names:
            if name == f"done.state.{state.name}":
                events.append("done")
            elif "*" in name or name.startswith(("done.", "error.")) or name in ("done", "error"):
                self._refuse(f"the event `{name}`", transition.place)
            else:
                # A descriptor also receives the events whose names it begins: of those that the chart knows.
                stem = name.removesuffix(".")
                events.extend(_word(one) for one in self.known if f"{one}.".startswith(f"{stem}."))
        return f"on {', '.join(dict.fromkeys(events))}" + (f" if {guard}" if guard else "")

    def _targets(self, state: State, transition: Transition) -> str:
        if not transition.targets:
            return ""
        inside = all(state.index < one <= state.last for one in transition.targets)
        arrow = "=>" if inside and transition.kind is TransitionKind.EXTERNAL else "->"
        return f" {arrow} {', '.join(self._target(one, transition.place) for one in transition.targets)}"

    def _target(self, index: int, place: Place | None) -> str:
        target = self.model.states[index]
        if target.kind not in HISTORY:
            return self.names[target.name]
        around = self.model.states[target.parent]
        if target.initial != around.initial or target.initial_actions:
            self._refuse(
                f"the default of the history of `{around.name}` is not its initial state", target.place or place
            )
        kind = "deep_history" if target.kind is StateKind.DEEP_HISTORY else "history"
        return f"{self.names[around.name]}.{kind}"

    def _slash(self, actions: tuple[Action, ...]) -> str:
        written = []
        for action in actions:
            if isinstance(action, Raise):
                written.append(f"raise {_word(action.event)}")
            else:
                self._refuse("an event that is sent with or without a delay", action.place)
        return f" / {', '.join(written)}" if written else ""

    def _renamed(self, expression: Expression) -> Expression:
        match expression:
            case Active(state, place):
                # A history is never active, and has no name of its own here.
                return Active(self.names[state], place) if state in self.names else Literal(False, BOOLEAN, place)  # noqa: FBT003 - a value
            case Unary(operator, operand, kind, place):
                return Unary(operator, self._renamed(operand), kind, place)
            case Binary(operator, left, right, kind, place):
                return Binary(operator, self._renamed(left), self._renamed(right), kind, place)
            case _:
                return expression
