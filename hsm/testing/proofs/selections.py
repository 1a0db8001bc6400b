"""What fires at a point within a step: what a selector can pick, each with the signals for which it does."""

from __future__ import annotations

from collections.abc import Sequence

from hsm.engine.configuration import Picked, Selector
from hsm.engine.decisions import Condition, Constant, Negation, Tree
from hsm.engine.machine import Machine
from hsm.model.chart import On
from hsm.testing.proofs.conditions import Evaluator
from hsm.testing.proofs.diagrams import FALSE, TRUE, Diagram
from hsm.testing.proofs.points import Point
from hsm.testing.proofs.values import NO, YES, Truth, Value

Choice = tuple[Picked | None, Diagram]
"""What is picked, None for nothing, and the signals."""


class Selections:
    """The choices of one machine's selectors.

    Args:
        machine: the machine.
        evaluator: evaluates its expressions.

    Attributes:
        failures: guards that may fail in a machine that handles faults, which is not followed: in words.
        handled: whether the machine handles faults.
        diagrams: the sets of signals.
    """

    def __init__(self, machine: Machine, evaluator: Evaluator) -> None:
        self._machine = machine
        self._evaluator = evaluator
        self.diagrams = evaluator.symbols.diagrams
        self._guards: dict[tuple[int, tuple[Value, ...], frozenset[int]], Truth] = {}
        self._choices: dict[tuple[Selector, frozenset[int] | None, tuple[Value, ...]], list[Choice]] = {}
        self._candidates: dict[Selector, frozenset[int]] = {}
        triggers = [one.trigger for one in machine.model.transitions]
        self.handled = any(isinstance(one, On) and "fault" in one.names for one in triggers)
        self.failures: dict[str, None] = {}

    def choices(self, selector: Selector, point: Point, due: frozenset[int] | None = None) -> list[Choice]:
        """What a selector can pick; the signals that are in no choice make a guard fail.

        Args:
            selector: of the active states.
            point: where the step is.
            due: for time-outs: those that are due.
        """
        if due is not None:
            candidates = self._candidates.get(selector)
            if candidates is None:
                candidates = frozenset(one for chain in selector.chains for one in chain.candidates)
                self._candidates[selector] = candidates
            due &= candidates
        key = (selector, due, point.values)
        choices = self._choices.get(key)
        if choices is None:
            choices = self._choices[key] = self._all_choices(selector, point, due)
        return choices

    def _all_choices(self, selector: Selector, point: Point, due: frozenset[int] | None) -> list[Choice]:
        both, either = self.diagrams.both, self.diagrams.either
        active = self._machine.configuration(point.leaves).active
        found: dict[tuple[int, ...], Diagram] = {(): TRUE}
        for chain in selector.chains:
            ways: list[tuple[int | None, Diagram]] = []
            left = TRUE
            for index in chain.candidates:
                if due is not None and index not in due:
                    continue
                guard = self._guard(index, point.values, active)
                fires = both(left, guard.true)
                if fires != FALSE:
                    ways.append((index, fires))
                left = both(left, guard.false)
                if left == FALSE:
                    break
            ways.append((None, left))
            extended: dict[tuple[int, ...], Diagram] = {}
            for chosen, condition in found.items():
                for way, added in ways:
                    further = both(condition, added)
                    if further != FALSE:
                        key = chosen if way is None or way in chosen else (*chosen, way)
                        extended[key] = either(extended.get(key, FALSE), further)
            found = extended
        return [((one if len(one) > 1 else one[0]) if one else None, condition) for one, condition in found.items()]

    def _guard(self, transition: int, values: tuple[Value, ...], active: frozenset[int]) -> Truth:
        key = (transition, values, active)
        found = self._guards.get(key)
        if found is None:
            decision = self._machine.generator.decision(transition)
            evaluator = self._evaluator.at(values, active)
            found = self._truth(decision.tree, [evaluator.truth(one) for one in decision.conditions])
            if self.handled and self.diagrams.either(found.true, found.false) != TRUE:
                place = self._machine.model.transitions[transition].place
                self.failures[f"a guard that may fail in a machine that handles faults ({place})"] = None
            self._guards[key] = found
        return found

    def _truth(self, tree: Tree, conditions: Sequence[Truth]) -> Truth:
        symbols = self._evaluator.symbols
        match tree:
            case Condition(number):
                return conditions[number]
            case Constant(held):
                return YES if held else NO
            case Negation(operand):
                return symbols.negated(self._truth(operand, conditions))
            case _:
                first, *others = (self._truth(one, conditions) for one in tree.parts)
                for one in others:
                    first = symbols.both(first, one) if tree.conjunction else symbols.either(first, one)
                return first
