"""The transitions that can fire at a point within a step, each with the signals that select it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from hsm.engine.configuration import Picked, Selector
from hsm.engine.decisions import Condition, Constant, Negation, Tree
from hsm.engine.machine import Machine
from hsm.model.chart import Held, On
from hsm.testing.proofs.conditions import Evaluator
from hsm.testing.proofs.diagrams import FALSE, TRUE, Diagram
from hsm.testing.proofs.points import Point
from hsm.testing.proofs.values import NO, YES, Truth, Value

MOST_PATHS = 200
"""The paths of a guard with more paths are not distinguished."""

Choice = tuple[Picked | None, Diagram]
"""The selected transitions, None for nothing, and the signals."""


Path = tuple[int, int, Diagram]
"""A transition, a path through its guard, and the signals."""


class _Walk(NamedTuple):
    """A way through a guard.

    Attributes:
        path: through its conditions.
        held: whether the guard is true on it.
        among: the signals.
    """

    path: int
    held: bool
    among: Diagram


class Selections:
    """The choices of one machine's selectors.

    Args:
        machine: the machine.
        evaluator: evaluates its expressions.

    Attributes:
        untold: transitions whose guards have more paths than are followed.
        failures: guards that may fail in a machine that handles faults, which is not supported: in words.
        handling: states with transitions that handle faults.
        diagrams: the sets of signals.
    """

    def __init__(self, machine: Machine, evaluator: Evaluator) -> None:
        self._machine = machine
        self._evaluator = evaluator
        self.diagrams = evaluator.symbols.diagrams
        self._guards: dict[tuple[int, tuple[Value, ...], frozenset[int]], Truth] = {}
        self._choices: dict[tuple[Selector, frozenset[int] | None, tuple[Value, ...]], list[Choice]] = {}
        self._paths: dict[tuple[Selector, frozenset[int] | None, tuple[Value, ...]], list[Path]] = {}
        self._candidates: dict[Selector, frozenset[int]] = {}
        triggers = [one.trigger for one in machine.model.transitions]
        handlers = [
            one for one in machine.model.transitions if isinstance(one.trigger, On) and "fault" in one.trigger.names
        ]
        self.handling = frozenset(one.source for one in handlers)
        self.failures: dict[str, None] = {}
        decisions = map(machine.generator.decision, range(len(triggers)))
        self.untold = {index for index, one in enumerate(decisions) if one.count > MOST_PATHS}

    def choices(self, selector: Selector, point: Point, due: frozenset[int] | None = None) -> list[Choice]:
        """The possible results of a selector; the signals in no choice make a guard fail.

        Args:
            selector: of the active states.
            point: where the step is.
            due: for time-outs: those that are due.
        """
        due = self._offered(selector, due)
        key = (selector, due, point.values)
        choices = self._choices.get(key)
        if choices is None:
            choices = self._choices[key] = self._all_choices(selector, point, due)
        return choices

    def paths(self, selector: Selector, point: Point, due: frozenset[int] | None = None) -> list[Path]:
        """The paths through guards that a selector may take: the transition, the path, the signals."""
        due = self._offered(selector, due)
        key = (selector, due, point.values)
        paths = self._paths.get(key)
        if paths is None:
            paths = self._paths[key] = list(self._all_paths(selector, point, due))
        return paths

    def guard(self, index: int, point: Point) -> Truth:
        """Where the condition and the guard of a transition are true and where they are false."""
        return self._guard(index, point.values, self._machine.configuration(point.leaves).active)

    def held(self, index: int, point: Point) -> Truth:
        """Where a condition that is watched for some time is true and where it is false."""
        trigger = self._machine.model.transitions[index].trigger
        assert isinstance(trigger, Held), "nothing else is watched"
        return self._evaluator.at(point.values, self._machine.configuration(point.leaves).active).truth(
            trigger.condition
        )

    def _offered(self, selector: Selector, due: frozenset[int] | None) -> frozenset[int] | None:
        """Of the time-outs that are due, those of a selector."""
        if due is None:
            return None
        candidates = self._candidates.get(selector)
        if candidates is None:
            candidates = frozenset(one for chain in selector.chains for one in chain.candidates)
            self._candidates[selector] = candidates
        return due & candidates

    def _all_paths(self, selector: Selector, point: Point, due: frozenset[int] | None) -> Iterator[Path]:
        active = self._machine.configuration(point.leaves).active
        for chain in selector.chains:
            left = TRUE
            for index in chain.candidates:
                decision = self._machine.generator.decision(index)
                if (due is not None and index not in due) or left == FALSE or decision.count > MOST_PATHS:
                    continue
                evaluator = self._evaluator.at(point.values, active)
                conditions = [evaluator.truth(one) for one in decision.conditions]
                for path, _, among in self._walked(decision.tree, conditions, [_Walk(0, held=True, among=left)]):
                    yield index, path, among
                left = self.diagrams.both(left, self._guard(index, point.values, active).false)

    def _walked(self, tree: Tree, conditions: Sequence[Truth], ways: list[_Walk]) -> list[_Walk]:
        """How paths through a tree continue."""
        both = self.diagrams.both
        match tree:
            case Condition(number):
                truth = conditions[number]
                found = [
                    _Walk(path + 2 * 3**number, held=True, among=both(among, truth.true)) for path, _, among in ways
                ]
                found += [
                    _Walk(path + 3**number, held=False, among=both(among, truth.false)) for path, _, among in ways
                ]
            case Constant(held):
                found = [_Walk(path, held, among) for path, _, among in ways]
            case Negation(operand):
                walked = self._walked(operand, conditions, ways)
                found = [_Walk(path, not held, among) for path, held, among in walked]
            case _:
                found, going = [], ways
                for part in tree.parts:
                    walked = self._walked(part, conditions, going)
                    going = [one for one in walked if one.held is tree.conjunction]
                    found += [one for one in walked if one.held is not tree.conjunction]
                found += going
        return [one for one in found if one.among != FALSE]

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
            if self.handling and self.diagrams.either(found.true, found.false) != TRUE:
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
