"""Properties checked on every run of a machine up to a bound, with a shortest run that violates one."""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from hsm.engine.machine import Machine
from hsm.engine.monitoring import Holds, begin, deadline, look
from hsm.model.chart import Model
from hsm.model.expressions import Expression
from hsm.model.properties import AlwaysHolds, Never, Property, conditions_of
from hsm.testing.exploration.exploring import Edge, Explorer, Moment, Regions, Watcher
from hsm.testing.scenarios.driver import TICK, Driver
from hsm.testing.scenarios.inputs import Input
from hsm.testing.scenarios.replaying import replay
from hsm.testing.scenarios.scenarios import Scenario
from hsm.testing.scenarios.script import scripted_machine
from hsm.testing.scenarios.watching import property_watch
from hsm.testing.scenarios.writing import Writer

MOST_STEPS = 40_000
"""So many steps are tried for each property that remembers something, for those of instances, and for all others."""

Trail = tuple[tuple[Any, ...] | None, Edge]
"""A step with the situation that it begins in."""

NO_FAULT = "no step fails"
"""Checked of every machine: no run ends in a fault that the machine does not handle, none spins."""


@dataclass(frozen=True, slots=True)
class PropertyVerdict:
    """What is known of one property.

    Attributes:
        name: the property's name, or ``NO_FAULT``.
        text: the property.
        violation: what is wrong, or None where nothing was found.
        counterexample: a shortest run to it, as a scenario; None where there is none.
        situations: how many different situations were looked at.
        steps: how many steps were tried.
        depth: how many steps deep all runs were followed.
        complete: whether those are all the situations there are, so that the property is proved.
    """

    name: str
    text: str
    violation: str | None
    counterexample: Scenario | None
    situations: int
    steps: int
    depth: int
    complete: bool

    @property
    def holds(self) -> bool:
        """Whether no violation was found."""
        return self.violation is None

    def __str__(self) -> str:
        if self.violation is not None:
            return f"{self.name}: VIOLATED: {self.violation}"
        bound = f"in all runs of {self.depth} step{'' if self.depth == 1 else 's'}"
        bound = "always" if self.complete else bound
        return f"{self.name}: holds {bound} ({self.situations} situations, {self.steps} steps tried)"


def check(
    machine: Machine | Model,
    parameters: Mapping[str, Any] | None = None,
    *,
    tick: float = TICK,
    steps: int = MOST_STEPS,
    only: Collection[str] | None = None,
) -> list[PropertyVerdict]:
    """Check the properties of a machine, its signals, outcomes and events free.

    Args:
        machine: the machine.
        parameters: in SI units; by default as declared.
        tick: seconds from one step to the next in counterexamples.
        steps: how many steps to try at most: for all properties that look at one moment together, for those of
            instances together, and for each other.
        only: names of properties, ``NO_FAULT`` among them; by default all.
    """
    ready = scripted_machine(machine)
    stated = [one for one in ready.model.properties if only is None or one.name in only]
    instant = [one for one in stated if isinstance(one.claim, Never | AlwaysHolds)]
    verdicts: list[PropertyVerdict] = []
    if instant or only is None or NO_FAULT in only:
        search = _search(
            ready, parameters, tick, instant, steps=steps, wanted={one.name for one in instant} or {NO_FAULT}
        )
        if only is None or NO_FAULT in only:
            text = "no signal, activity or action fails, nothing spins"
            verdicts.append(search.verdict(NO_FAULT, text, ready, tick))
        verdicts += [search.verdict(one.name, one.text, ready, tick) for one in instant]
    own = [one for one in stated if one not in instant and one.scope is None]
    parts = [one for one in stated if one not in instant and one.scope is not None]
    for group in (*([one] for one in own), *([parts] if parts else ())):
        search = _search(ready, parameters, tick, group, steps=steps, wanted={one.name for one in group})
        verdicts += [search.verdict(one.name, one.text, ready, tick) for one in group]
    return verdicts


def _search(
    machine: Machine,
    parameters: Mapping[str, Any] | None,
    tick: float,
    group: Sequence[Property],
    *,
    steps: int,
    wanted: set[str],
) -> _Search:
    """Look for violations: first with one region awake at a time, which reaches far, then with all of them."""
    regions = Regions(machine)
    alone = [Regions(machine, number) for number in range(len(regions))] if len(regions) > 1 else []
    found: dict[str, tuple[_Search, Trail]] = {}
    searches = []
    for limited in (*alone, regions):
        explorer = Explorer(machine, parameters, tick=tick, watcher=PropertyWatcher(group), regions=limited)
        search = _Search(explorer, steps // (1 + bool(alone) * (len(alone) if limited is not regions else 1)), found)
        search.run(wanted)
        searches.append(search)
    searches[-1].steps = sum(one.steps for one in searches)
    return searches[-1]


class PropertyWatcher(Watcher):
    """Watches some properties along every run of an exploration."""

    def __init__(self, properties: Sequence[Property]) -> None:
        self._properties = properties
        self.expressions: tuple[Expression, ...] = tuple(
            expression for one in properties for expression in conditions_of(one.claim)
        )

    def begin(self) -> Any:
        """What is remembered of each property, with a key that does not depend on the time."""
        return self._remember([begin(one, 0.0) for one in self._properties], 0.0)

    def look(self, watched: Any, time: float, holds: Holds, entered: Collection[str]) -> tuple[Any, tuple[str, ...]]:
        """What is remembered after a step, and the names of the properties that are violated."""
        memories = []
        violated: list[str] = []
        for one, memory in zip(self._properties, watched[1], strict=True):
            remembered, wrong = look(one, memory, time, holds, entered)
            memories.append(remembered)
            violated += [one.name] if wrong else []
        return self._remember(memories, time), tuple(violated)

    def deadline(self, watched: Any) -> float | None:
        """When the first property will be violated, if nothing happens."""
        due = [deadline(one, memory) for one, memory in zip(self._properties, watched[1], strict=True)]
        return min((one for one in due if one is not None), default=None)

    def _remember(self, memories: Sequence[float | None], time: float) -> Any:
        key = tuple(
            memory if memory is None or deadline(one, memory) is None else round(memory - time, 6)
            for one, memory in zip(self._properties, memories, strict=True)
        )
        return key, tuple(memories)


@dataclass(slots=True)
class _Search:
    """Breadth first: the first violation found is one of the shortest."""

    explorer: Explorer
    limit: int
    violations: dict[str, tuple[_Search, Trail]]
    parents: dict[tuple[Any, ...], tuple[tuple[Any, ...] | None, Edge]] = field(default_factory=dict)
    queue: deque[tuple[int, tuple[Any, ...], Moment]] = field(default_factory=deque)
    steps: int = 0
    depth: int = 0

    def run(self, wanted: set[str]) -> None:
        """Explore until every property is violated, all is seen, or the limit is reached."""
        for edge in self.explorer.start():
            self._take(None, edge, 0)
        while self.queue and self.steps < self.limit and not wanted <= self.violations.keys():
            depth, key, moment = self.queue.popleft()
            self.depth = depth
            for edge in self.explorer.successors(moment):
                self._take(key, edge, depth + 1)

    def _take(self, source: tuple[Any, ...] | None, edge: Edge, depth: int) -> None:
        self.steps += 1
        if edge.fault is not None:
            self.violations.setdefault(NO_FAULT, (self, (source, edge)))
            return
        for name in edge.violations:
            self.violations.setdefault(name, (self, (source, edge)))
        key = edge.target.key()
        if key not in self.parents:
            self.parents[key] = (source, edge)
            self.queue.append((depth, key, edge.target))

    def verdict(self, name: str, text: str, machine: Machine, tick: float) -> PropertyVerdict:
        """What was found out about one property."""
        violation = example = None
        if name in self.violations:
            search, trail = self.violations[name]
            edges = list(search._way(*trail))[::-1]
            violation = edges[-1].fault or text
            example = self._example(name, machine, edges, tick)
        complete = not self.queue
        return PropertyVerdict(name, text, violation, example, len(self.parents), self.steps, self.depth, complete)

    def _way(self, source: tuple[Any, ...] | None, edge: Edge) -> Iterator[Edge]:
        yield edge
        while source is not None:
            source, edge = self.parents[source]
            yield edge

    def _example(self, name: str, machine: Machine, edges: Sequence[Edge], tick: float) -> Scenario | None:
        """The run as a scenario; where a tick takes too long to show the violation, with shorter ones."""
        inputs: list[Input] = [one.input for one in edges]
        expressions = [one for stated in machine.model.properties for one in conditions_of(stated.claim)]
        title = f"counterexample to {name}"
        for period in (tick, tick / 10, tick / 100):
            watch = property_watch(machine.model.properties)
            seen: list[str] = []

            def note(driver: Driver, watch: Any = watch, seen: list[str] = seen) -> None:
                seen += [one for one in watch(driver) if one == name]

            found = replay(
                title, machine, inputs, Writer(machine.model, expressions), tick=period, watch=note, stop=seen
            )
            if seen or found.fault:
                return replace(found.scenario, name=title if period == tick else f"{title} (tick {period:g} s)")
        return None
