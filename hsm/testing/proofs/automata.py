"""Properties as automata over the steps of a graph: the memory of a monitor, for all signals at once."""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum

from hsm.engine.machine import Machine
from hsm.model.expressions import Expression
from hsm.model.properties import AlwaysHolds, Never, Paced, Precedence, Property, Recurrence, Response
from hsm.model.values import dataclass
from hsm.testing.proofs.conditions import Evaluator
from hsm.testing.proofs.diagrams import FALSE, Diagram
from hsm.testing.proofs.points import Point
from hsm.testing.proofs.values import Truth, Value


class Memory(IntEnum):
    """The memory of a property: no instance runs; nothing; the first condition has not held; a deadline runs."""

    OUTSIDE = 0
    NOTHING = 1
    ARMED = 2
    WAITING = 3


@dataclass(frozen=True, slots=True)
class Branch:
    """One way for a property to continue in a step.

    Attributes:
        memory: the memory afterwards.
        among: the signals for which it continues so.
        violated: whether the property is violated.
        least: the time of the property is at least that many nanoseconds; None where that does not matter.
        most: at most.
        restarts: whether the time begins again.
    """

    memory: Memory
    among: Diagram
    violated: bool = False
    least: int | None = None
    most: int | None = None
    restarts: bool = False


class Automaton:
    """One property.

    Args:
        stated: the property.
        machine: what it is about.
        evaluator: evaluates its conditions.
    """

    def __init__(self, stated: Property, machine: Machine, evaluator: Evaluator) -> None:
        self.stated = stated
        self._machine = machine
        self._scope = None if stated.scope is None else machine.indices[stated.scope]
        self._evaluator = evaluator
        self._diagrams = evaluator.symbols.diagrams
        self._truths: dict[tuple[int, tuple[int, ...], tuple[Value, ...]], Truth] = {}

    def begin(self) -> Memory:
        """The memory at the start."""
        return Memory.OUTSIDE if self._scope is not None else self._begun()

    def _begun(self) -> Memory:
        return Memory.WAITING if isinstance(self.stated.claim, Recurrence) else Memory.NOTHING

    def branches(self, memory: Memory, point: Point, among: Diagram) -> Sequence[Branch]:
        """All ways to continue in a step.

        Args:
            memory: the memory before.
            point: the end of the step.
            among: the signals that lead there.
        """
        if self._scope is not None:
            if self._scope not in self._machine.configuration(point.leaves).active:
                return (Branch(Memory.OUTSIDE, among),)
            if memory is Memory.OUTSIDE or self._scope in point.entered:
                found = self._branches(self._begun(), point, among, again=True)
                return [one for one in found if one.among != FALSE]
        return [one for one in self._branches(memory, point, among, again=False) if one.among != FALSE]

    def _branches(self, memory: Memory, point: Point, among: Diagram, *, again: bool) -> Sequence[Branch]:
        both, without = self._diagrams.both, self._diagrams.without
        match self.stated.claim:
            case Never(condition):
                wrong = both(among, self._truth(condition, point).true)
                return (
                    Branch(Memory.NOTHING, wrong, violated=True),
                    Branch(Memory.NOTHING, without(among, wrong)),
                )
            case AlwaysHolds(condition):
                wrong = both(among, self._truth(condition, point).false)
                return (
                    Branch(Memory.NOTHING, wrong, violated=True),
                    Branch(Memory.NOTHING, without(among, wrong)),
                )
            case Precedence(trigger, first, then):
                armed = among if memory is Memory.ARMED else both(among, self._truth(trigger, point).true)
                waits = without(armed, self._truth(first, point).true)
                wrong = both(waits, self._truth(then, point).true)
                return (
                    Branch(Memory.ARMED, wrong, violated=True),
                    Branch(Memory.ARMED, without(waits, wrong)),
                    Branch(Memory.NOTHING, without(among, waits)),
                )
            case Recurrence(condition, within):
                return self._recurrence(among, self._truth(condition, point), _nanoseconds(within), again=again)
            case Response(trigger, response, within):
                limit = _nanoseconds(within)
                answered = self._truth(response, point).true
                if memory is Memory.WAITING:
                    answer, waits = both(among, answered), without(among, answered)
                    return (
                        Branch(Memory.NOTHING, answer, most=limit),
                        Branch(Memory.NOTHING, answer, violated=True, least=limit + 1),
                        Branch(Memory.WAITING, waits, most=limit - 1),
                        Branch(Memory.NOTHING, waits, violated=True, least=limit),
                    )
                asked = without(both(among, self._truth(trigger, point).true), answered)
                return (
                    Branch(Memory.NOTHING, without(among, asked)),
                    Branch(Memory.WAITING, asked, violated=limit <= 1, restarts=True),
                )
            case Paced():
                return (Branch(Memory.NOTHING, among),)  # the search takes no other steps

    def _truth(self, condition: Expression, point: Point) -> Truth:
        """Where a condition holds at the end of a step."""
        key = (id(condition), point.leaves, point.values)
        found = self._truths.get(key)
        if found is None:
            active = self._machine.configuration(point.leaves).active
            found = self._truths[key] = self._evaluator.at(point.values, active).truth(condition)
        return found

    def _recurrence(self, among: Diagram, truth: Truth, limit: int, *, again: bool) -> Sequence[Branch]:
        missed = self._diagrams.both(among, truth.false)
        met = self._diagrams.without(among, missed)
        if again:
            return (
                Branch(Memory.WAITING, met, restarts=True),
                Branch(Memory.WAITING, missed, violated=limit <= 1, restarts=True),
            )
        return (
            Branch(Memory.WAITING, met, most=limit, restarts=True),
            Branch(Memory.WAITING, met, violated=True, least=limit + 1, restarts=True),
            Branch(Memory.WAITING, missed, most=limit - 1),
            Branch(Memory.WAITING, missed, violated=True, least=limit, restarts=True),
        )


def _nanoseconds(seconds: float) -> int:
    return round(seconds * 1e9)
