"""Properties watched over a run, step by step. The memory of a monitor is a value, so that runs can branch."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from math import inf, ulp
from typing import Any

from hsm.engine.clock import nanoseconds, reached, tolerance
from hsm.engine.compiled import CompiledChart
from hsm.engine.evaluation import all_signals
from hsm.engine.macrostep import Macrostep
from hsm.engine.record import StepRecord, took_something
from hsm.engine.run import Supervisor
from hsm.model.expressions import Active, Expression
from hsm.model.properties import (
    LONGEST_TICK,
    AlwaysHolds,
    Claim,
    Never,
    Paced,
    Precedence,
    Property,
    Recurrence,
    Response,
    conditions_of,
    paced,
)
from hsm.model.values import dataclass

Holds = Callable[[Expression], bool | None]
"""Whether a condition holds after a step; None if it cannot be evaluated."""

Memory = float | None
"""The memory of one property: its deadline, or that it waits for something, or None."""

IDLE = -inf
"""Marks that the instance of a property is not active."""

_ARMED = 1.0
_FAR = 1e-6
"""A deadline farther away than this, s, and than some spacings of floats, has not come, however times are rounded."""


_TIMED = (Recurrence, Response)

_MOVING = (*_TIMED, Paced)
"""Claims that a step can violate although nothing changes, once they remember something."""


def begin(stated: Property, time: float) -> Memory:
    """The memory of a property at the start of a run."""
    return IDLE if stated.scope is not None else _begun(stated.claim, time)


def look(
    stated: Property, memory: Memory, time: float, holds: Holds, entered: Collection[str] = ()
) -> tuple[Memory, bool]:
    """Check a property after a step.

    Args:
        stated: the property.
        memory: the memory after the previous step.
        time: of the step, in seconds.
        holds: evaluates a condition.
        entered: the states entered in the step, by name.

    Returns:
        The new memory, and whether the property was violated in this step.
    """
    if stated.scope is not None:
        if not holds(Active(stated.scope)):
            return IDLE, False
        if memory == IDLE or stated.scope in entered:
            memory = _begun(stated.claim, time)
    return _look(stated.claim, memory, time, holds)


def deadline(stated: Property, memory: Memory) -> float | None:
    """When a property will be violated, if nothing happens until then."""
    return memory if memory != IDLE and isinstance(stated.claim, _TIMED) else None


def _begun(claim: Claim, time: float) -> Memory:
    return time + claim.within if isinstance(claim, Recurrence | Paced) else None


def _look(claim: Claim, memory: Memory, time: float, holds: Holds) -> tuple[Memory, bool]:
    match claim:
        case Paced(within):
            return time + within, memory is not None and _late(memory, time, met=True)
        case Never(condition):
            return None, holds(condition) is True
        case AlwaysHolds(condition):
            return None, holds(condition) is False
        case Recurrence(condition, within):
            met = holds(condition) is not False
            late = memory is not None and _late(memory, time, met=met)
            return (time + within if met or late else memory), late
        case Response(trigger, response, within):
            due = memory
            if due is None and holds(trigger) is True:
                due = time + within
            if due is None:
                return None, False
            met = holds(response) is True
            late = _late(due, time, met=met)
            return (None if met or late else due), late
        case Precedence(trigger, first, then):
            armed = memory is not None or holds(trigger) is True
            if not armed or holds(first) is True:
                return None, False
            return _ARMED, holds(then) is True


def _late(due: float, time: float, *, met: bool) -> bool:
    """Whether a deadline has passed; exactly at the deadline is still in time."""
    if time <= due and (met or due - time > _FAR + 8 * ulp(time)):
        return False  # most steps: the rounded comparison below says the same
    end = nanoseconds(due)
    return nanoseconds(time) > end + tolerance(time) if met else reached(end, time)


@dataclass(frozen=True, slots=True)
class Violation:
    """A property that did not hold, or an assumption.

    Attributes:
        property: which one.
        time: of the step, in seconds.
        configuration: the states that were active after it.
        assumed: whether it is an assumption: from here on, no verdict of a proof holds for the run.
    """

    property: Property
    time: float
    configuration: frozenset[str]
    assumed: bool = False

    def __str__(self) -> str:
        place = f"{self.property.place}: " if self.property.place else ""
        states = ", ".join(sorted(self.configuration))
        what = "assumption" if self.assumed else "property"
        how = "is broken" if self.assumed else "is violated"
        return f"{place}{what} {self.property.name} {how} at {self.time:.10g} s in {states}: {self.property.text}"


PACE = Property("longest tick", Paced(LONGEST_TICK), f"a step comes at most {LONGEST_TICK:g} s after the last")
"""What proofs assume of the time between two steps, unless they are asked to assume something else."""


class Monitor:
    """Watches the properties and the assumptions of a running machine; it never changes what the machine does.

    What stays violated from step to step is reported once, and a broken assumption once in a run. Assumptions come
    first; ``PACE`` is one of them where the machine states anything, but no longest tick of its own. A step that took
    nothing leaves the states and variables as they are; after it, only claims about signals, those that wait for a
    deadline, and those that were violated are examined again.
    """

    def __init__(self, supervisor: Supervisor) -> None:
        self._supervisor = supervisor
        model = supervisor.machine.model
        self._stated: Sequence[Property] = (*model.assumptions, *model.properties)
        self._assumed = len(model.assumptions)
        self._pace: Memory = begin(PACE, supervisor.time)
        self._paced = bool(self._stated) and paced(model.assumptions) is None
        self._memories: list[Memory] = [begin(one, supervisor.time) for one in self._stated]
        self._violated: set[int] = set()
        self._all = range(len(self._stated))
        self._of_signals = frozenset(index for index in self._all if _asks_signals(self._stated[index].claim))
        self._timed = frozenset(index for index in self._all if isinstance(self._stated[index].claim, _MOVING))
        self._began = False

    def look(self, facts: object, step: Macrostep) -> tuple[Violation, ...]:
        """The new violations; call this after each step, with its facts."""
        at_rest = self._began and not isinstance(step.raw, StepRecord) and not took_something(step.raw)
        self._began = True
        time = self._supervisor.time
        found: list[Violation] = []
        if self._paced:
            self._pace, late = _look(PACE.claim, self._pace, time, _not_asked)
            if late:
                self._paced = False
                found.append(Violation(PACE, time, self._supervisor.configuration, assumed=True))
        looked_at = [index for index in self._all if self._moves(index)] if at_rest else self._all
        if not looked_at:
            return tuple(found)
        holds, entered = holding(self._supervisor, facts), () if at_rest else step.entered
        for index in looked_at:
            one = self._stated[index]
            self._memories[index], violated = look(one, self._memories[index], time, holds, entered)
            if violated and index not in self._violated:
                found.append(Violation(one, time, self._supervisor.configuration, index < self._assumed))
            if violated:
                self._violated.add(index)
            elif index >= self._assumed:
                self._violated.discard(index)
        return tuple(found)

    def _moves(self, index: int) -> bool:
        """Whether a property can have another verdict, or another memory, with the same states and variables."""
        if index in self._of_signals or index in self._violated:
            return True
        memory = self._memories[index]
        return index in self._timed and memory is not None and memory != IDLE


def _not_asked(_condition: Expression) -> None:
    """The answer where a claim has no conditions."""


def _asks_signals(claim: Claim) -> bool:
    return any(True for condition in conditions_of(claim) for _ in all_signals(condition))


def holding(supervisor: Supervisor, facts: object) -> Holds:
    """Evaluates conditions at the current moment of a run; each signal is evaluated at most once."""
    values, active = supervisor.moment
    return _holding(supervisor.machine, values, active, facts)


def holding_at(
    machine: CompiledChart, variables: Mapping[str, Any], configuration: Iterable[str], facts: object
) -> Holds:
    """The same at a moment of which this is known.

    Args:
        machine: the machine.
        variables: variables and parameters by their full names.
        configuration: full names of the active states.
        facts: what the signals are given.
    """
    values = [variables.get(name) for name in machine.generator.variables]
    return _holding(machine, values, frozenset(machine.indices[name] for name in configuration), facts)


def _holding(machine: CompiledChart, values: Sequence[Any], active: frozenset[int], facts: object) -> Holds:
    generator = machine.generator
    memo: dict[Any, Any] = {}

    def holds(condition: Expression) -> bool | None:
        if type(condition) is Active:
            return generator.states[condition.state] in active
        try:
            return bool(generator.test(condition)(facts, memo, values, active))
        except Exception:
            return None  # a signal that failed, or a variable of an instance that was never entered

    return holds
