"""A search for runs that violate a property, from the start: for machines that proofs do not support.

Signals, outcomes, events with their data and waiting times are those that an ``Explorer`` tries. A result is a run of
the engine; no result proves nothing.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field
from itertools import islice
from typing import Any

from hsm.engine.evaluation import SignalFault
from hsm.engine.machine import Machine
from hsm.engine.monitoring import Memory, begin, deadline, look
from hsm.model.expressions import Expression, SignalValue
from hsm.model.properties import conditions_of
from hsm.model.values import dataclass
from hsm.testing.exploration.exploring import ExploredMoment, ExploredStep, Explorer
from hsm.testing.scenarios.driver import TICK, Driver
from hsm.testing.scenarios.inputs import Input, Wait
from hsm.testing.scenarios.replaying import replay
from hsm.testing.scenarios.scenarios import Scenario
from hsm.testing.scenarios.watching import property_watch
from hsm.testing.scenarios.writing import Writer

MOST_STEPS = 20_000
"""At most this many steps are tried."""

MOST_REFUSED = 20
"""After this many runs that a replay does not confirm, no further ones are shown for a property."""

_DIGITS = 6


@dataclass(frozen=True, slots=True)
class _Visit:
    """A moment with the memory of each property.

    Attributes:
        moment: where the run is.
        memories: of the properties, in order, and then of the assumptions.
        before: the previous visit and the step from there; None at the start.
        depth: how many steps it is from the start.
    """

    moment: ExploredMoment
    memories: tuple[Memory, ...]
    before: tuple[_Visit, ExploredStep] | None
    depth: int

    def steps(self) -> list[ExploredStep]:
        """The steps from the start."""
        found: list[ExploredStep] = []
        visit: _Visit | None = self
        while visit is not None and visit.before is not None:
            found.append(visit.before[1])
            visit = visit.before[0]
        return found[::-1]


@dataclass(slots=True)
class Searched:
    """The result of a search.

    Attributes:
        violations: a violating run for each violated property, by the property's name.
        fault: a run with a step that fails; None where none was found.
        steps: how many steps were tried.
        depth: all steps up to this distance from the start were tried.
        states: how many different moments were met.
        complete: whether all steps from each of them were tried.
    """

    violations: dict[str, Scenario] = field(default_factory=dict)
    fault: Scenario | None = None
    steps: int = 0
    depth: int = 0
    states: int = 0
    complete: bool = False

    @property
    def extent(self) -> str:
        """The extent of the search, in words."""
        if self.complete:
            return f"no violation found in all {self.states} states that were explored"
        return f"no violation found in {self.steps} steps, up to {self.depth} from the start"


def search(machine: Machine, parameters: Mapping[str, Any], *, steps: int = MOST_STEPS, tick: float = TICK) -> Searched:
    """Search for runs that violate the properties of a machine and keep to its assumptions, the shortest first.

    Args:
        machine: the machine, scripted.
        parameters: its parameters, in SI units.
        steps: the largest number of steps to try.
        tick: seconds from one step to the next in the runs that are found.
    """
    return _Search(machine, parameters, tick).run(steps)


class _Search:
    def __init__(self, machine: Machine, parameters: Mapping[str, Any], tick: float) -> None:
        self._machine = machine
        self._explorer = Explorer(machine, parameters, tick=tick)
        self._properties = machine.model.properties
        self._watched = (*self._properties, *machine.model.assumptions)
        self._tick = tick
        self._found = Searched()
        self._met: set[Any] = set()
        self._level: list[_Visit] = []
        self._refused: Counter[str] = Counter()

    def run(self, steps: int) -> Searched:
        """Search level by level, until all violations are found, all states are visited, or the limit is reached."""
        memories = tuple(begin(one, 0.0) for one in self._watched)
        for edge in self._explorer.start():
            self._take(None, memories, edge)
        wanted = {one.name for one in self._properties}
        while self._level:
            level, self._level = self._level, []
            for visit in level:
                if self._found.steps >= steps or (wanted <= self._found.violations.keys() and self._found.fault):
                    return self._found
                for edge in islice(self._following(visit), steps - self._found.steps):
                    self._take(visit, visit.memories, edge)
            self._found.depth += 1
        self._found.complete = self._explorer.all_data and self._found.steps < steps
        return self._found

    def _following(self, visit: _Visit) -> Iterator[ExploredStep]:
        """All steps to try, including one at the next deadline of a property or an assumption."""
        yield from self._explorer.successors(visit.moment)
        state, now = visit.moment.state, visit.moment.time
        due = [deadline(*one) for one in zip(self._watched, visit.memories, strict=True)]
        soonest = min((one for one in due if one is not None), default=now)
        if now < soonest < state.wake and state.outcome is None:
            yield from self._explorer.continued(visit.moment, Input(Wait(round(soonest - now, 9))))

    def _take(self, before: _Visit | None, memories: tuple[Memory, ...], edge: ExploredStep) -> None:
        found = self._found
        found.steps += 1
        origin = before or _Visit(edge.target, memories, None, 0)
        if edge.fault is not None:
            failed = _Visit(edge.target, memories, (origin, edge), origin.depth + 1)
            found.fault = found.fault or self._told("a step fails", failed)
            return
        looked = [
            look(one, memory, edge.target.time, lambda condition: self._holds(edge, condition), self._entered(edge))
            for one, memory in zip(self._watched, memories, strict=True)
        ]
        if any(broken for _, broken in looked[len(self._properties) :]):
            return
        visit = _Visit(edge.target, tuple(one for one, _ in looked), (origin, edge), origin.depth + 1)
        for stated, (_, violated) in zip(self._properties, looked, strict=False):
            if violated and stated.name not in found.violations and self._refused[stated.name] < MOST_REFUSED:
                scenario = self._told(f"{stated.name} is violated", visit, stated.name)
                if scenario is not None:
                    found.violations[stated.name] = scenario
                else:
                    self._refused[stated.name] += 1
        key = (edge.target.key(), tuple(self._key(index, visit) for index in range(len(looked))))
        if key not in self._met:
            self._met.add(key)
            found.states += 1
            self._level.append(visit)

    def _key(self, index: int, visit: _Visit) -> Memory:
        """The memory of a property or an assumption, with a deadline as the remaining time."""
        memory = visit.memories[index]
        due = deadline(self._watched[index], memory)
        return memory if due is None else round(due - visit.moment.time, _DIGITS)

    def _entered(self, edge: ExploredStep) -> list[str]:
        states = self._machine.model.states
        return [states[index].name for index in edge.entered]

    def _holds(self, edge: ExploredStep, condition: Expression) -> bool | None:
        """Whether a condition holds after a step; signals that the step did not use are unknown."""
        state, signals = edge.target.state, dict(edge.input.signals)

        def ask(call: SignalValue) -> Any:
            key = (call.signal.name, tuple(evaluation.value(one) for one in call.arguments))
            if key not in signals:
                raise SignalFault(call, LookupError("the step did not use it"))
            return signals[key]

        generator = self._machine.generator
        evaluation = generator.evaluation({}, state.values, state.configuration.active, ask)
        try:
            return bool(evaluation.value(condition))
        except (SignalFault, TypeError, ArithmeticError):
            return None

    def _told(self, title: str, visit: _Visit, name: str | None = None) -> Scenario | None:
        """The run as a scenario; None if it ends differently when each step takes a tick."""
        watch, seen = property_watch(self._properties, self._machine.model.assumptions), list[str]()

        def look_at(driver: Driver) -> None:
            seen.extend(one for one in watch(driver) if one == name)

        inputs = [one.input for one in visit.steps()]
        writer = Writer(self._machine.model, _conditions(self._machine))
        told = replay(title, self._machine, inputs, writer, tick=self._tick, watch=look_at, stop=seen)
        return told.scenario if (seen if name is not None else told.fault) else None


def _conditions(machine: Machine) -> Sequence[Expression]:
    return [one for stated in machine.model.properties for one in conditions_of(stated.claim)]
