"""The assumptions that a machine states: runs are followed as long as these hold.

A deadline of an assumption runs like a time-out that never comes due: no step is possible after it. What an assumption
says of signals alone holds within a step already, not only at its end.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from hsm.engine.machine import Machine
from hsm.model.properties import AlwaysHolds, Never, Property, Recurrence, Response
from hsm.model.rewriting import about_signals
from hsm.testing.proofs.automata import Automaton, Branch, Memory
from hsm.testing.proofs.conditions import Evaluator
from hsm.testing.proofs.diagrams import FALSE, TRUE, Diagram
from hsm.testing.proofs.points import Point, Timer
from hsm.testing.proofs.values import Value
from hsm.testing.proofs.zones import ROUNDING, Clock, own_clock

Memories = tuple[Memory, ...]
"""What is remembered of each assumption."""

FIRST = -1_000_000
"""The number of the first assumption's deadline among the time-outs; below those of events on their way."""


class Assumed:
    """The assumptions of one machine.

    Args:
        machine: the machine.
        evaluator: evaluates its expressions.
    """

    def __init__(self, machine: Machine, evaluator: Evaluator) -> None:
        self._stated: Sequence[Property] = machine.model.assumptions
        self._automata = [Automaton(one, machine, evaluator) for one in self._stated]
        self._diagrams = evaluator.symbols.diagrams
        self._evaluator = evaluator

    def begin(self) -> Memories:
        """What is remembered at the start."""
        return tuple(one.begin() for one in self._automata)

    def signals(self, values: Sequence[Value]) -> Diagram:
        """The signals of a step that begins with some values, as far as assumptions are about signals alone."""
        found = TRUE
        for one in self._stated:
            if one.scope is None and isinstance(one.claim, AlwaysHolds | Never) and about_signals(one.claim):
                truth = self._evaluator.at(values, frozenset()).truth(one.claim.condition)
                wrong = truth.false if isinstance(one.claim, AlwaysHolds) else truth.true
                found = self._diagrams.without(found, wrong)
        return found

    def after(
        self, memories: Memories, point: Point, among: Diagram, *, first: bool
    ) -> Iterator[tuple[Memories, frozenset[Clock], Diagram]]:
        """What is remembered after a step, the clocks that begin again, and the signals for which all assumptions hold.

        Args:
            memories: what is remembered before.
            point: the end of the step.
            among: the signals that lead there.
            first: whether the step coincides with the start.
        """
        ways: list[tuple[Memories, frozenset[Clock], Diagram]] = [((), frozenset(), among)]
        for number, (automaton, memory) in enumerate(zip(self._automata, memories, strict=True)):
            branches = [one for one in automaton.branches(memory, point, among) if _holds(one, first=first)]
            ways = [
                ((*known, one.memory), fresh | {self._clock(number)} if one.restarts else fresh, further)
                for known, fresh, condition in ways
                for one in branches
                if (further := self._diagrams.both(condition, one.among)) != FALSE
            ]
        return iter(ways)

    def timers(self, memories: Memories) -> tuple[Timer, ...]:
        """The deadlines that run."""
        return tuple(
            Timer(FIRST - number, _limit(one), _limit(one), self._clock(number))
            for number, (one, memory) in enumerate(zip(self._stated, memories, strict=True))
            if memory is Memory.WAITING
        )

    def _clock(self, number: int) -> Clock:
        return own_clock(FIRST - number)


def is_deadline(timer: Timer) -> bool:
    """Whether a time-out is the deadline of an assumption."""
    return timer.transition <= FIRST


def _holds(branch: Branch, *, first: bool) -> bool:
    return not branch.violated and not (first and (branch.least or 0) > 0)


def _limit(stated: Property) -> int:
    """The time by which a step must have come, in nanoseconds, with all that rounding may add."""
    assert isinstance(stated.claim, Recurrence | Response), "nothing else has a deadline"
    return round(stated.claim.within * 1e9) + ROUNDING + 1
