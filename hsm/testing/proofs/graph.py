"""The state space of a machine as a graph: locations between two steps, and steps with their signals.

Time is abstracted here: at each step any running time-out may be due, in the order of the durations within one state.
Zones (``zones``) decide later which of these are possible.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import field, replace
from itertools import product
from time import process_time
from typing import Any

from hsm.engine.clock import nanoseconds, seconds
from hsm.engine.machine import Machine
from hsm.model.chart import After, Always, Assign, Emit, Every, Held, Model, On, Send, When
from hsm.model.expressions import Literal
from hsm.model.properties import Property, conditions_of
from hsm.model.rewriting import actions_of, expressions_of
from hsm.model.types import Type
from hsm.model.values import dataclass
from hsm.testing.proofs.assumed import Assumed, Memories, is_deadline
from hsm.testing.proofs.conditions import Evaluator
from hsm.testing.proofs.diagrams import Diagram
from hsm.testing.proofs.event_data import EventSymbols
from hsm.testing.proofs.liveness import Liveness
from hsm.testing.proofs.microsteps import Microsteps
from hsm.testing.proofs.ordinals import held
from hsm.testing.proofs.points import NEVER, NOTHING_LOOSE, FailingStep, Loose, Point, Remembered, Timer, Waiting
from hsm.testing.proofs.regions import Kept, Precision, Regions
from hsm.testing.proofs.relevance import deciding, relevant
from hsm.testing.proofs.selections import Selections
from hsm.testing.proofs.steps import Stepper
from hsm.testing.proofs.values import Exact, NoRun, OneOf, Region, Symbols, Value
from hsm.testing.proofs.zones import Clock


@dataclass(frozen=True, slots=True)
class Location:
    """The location of a machine between two steps.

    Attributes:
        leaves: the active atomic states.
        history: what each history state remembers.
        over: states whose activity has ended.
        timers: the time-outs that run.
        values: the variables, as values or regions.
        acted: conditions that have held long enough, by transition.
        outcome: how the run ended, or None.
        deferred: events that wait for another state.
        pending: events that members have sent to one another; they arrive in the next step.
        assumed: what is remembered of each assumption.
    """

    leaves: tuple[int, ...]
    history: tuple[tuple[int, tuple[int, ...]], ...]
    over: frozenset[int]
    timers: tuple[Timer, ...]
    values: tuple[Kept, ...]
    acted: frozenset[int]
    outcome: str | None
    deferred: Waiting = ()
    pending: Waiting = ()
    assumed: Memories = ()


@dataclass(frozen=True, slots=True)
class Edge:
    """A step.

    Attributes:
        source: number of the location that it begins in; -1 for the first step, which comes with the start.
        target: number of the location that it leads to.
        due: the time-outs that come due in it.
        fresh: the clocks that begin in it.
        beats: the time-outs that were due in it and go on to their next times.
        among: the signals for which it leads there.
        point: its end, with what the variables are in terms of the signals.
        heard: whether it is a first step that hears an event from outside.
    """

    source: int
    target: int
    due: frozenset[int]
    fresh: frozenset[Clock]
    beats: tuple[Timer, ...]
    among: Diagram
    point: Point
    heard: bool = False

    @property
    def idle(self) -> bool:
        """Whether the machine stays as it is."""
        return self.source == self.target and not (self.due or self.fresh or self.beats or self.point.entered)


@dataclass(slots=True)
class Budget:
    """The budget of a proof.

    Attributes:
        seconds: of processor time, from ``begin`` on.
        locations: the largest number of locations.
        begin: when it began.
    """

    seconds: float
    locations: int
    begin: float = field(default_factory=process_time)

    @property
    def spent(self) -> bool:
        """Whether the time is over."""
        return process_time() - self.begin > self.seconds


FREE: Any = object()
"""Replaces the value of a parameter: any value, but constant."""


class Graph:
    """The graph of one machine.

    Args:
        machine: the machine.
        parameters: their values, in order; ``FREE`` for one that may have any.
        stated: the properties that are decided on the graph.
        events: names that may come from outside.
        precision: how many exact values of variables are kept.
        not_a_number: whether signals may be NaN.
        forgetful: whether what is not read again is left out.
        loose: what parts of the machine that are not followed may do.

    Attributes:
        locations: all of them, in the order in which they were found.
        edges: the edges of each location, by its number.
        initial: the first steps.
        complete: whether all locations have their edges; otherwise those up to ``depth`` do.
        depth: the number of steps after which all locations still have their edges.
        faults: steps that fail: the location in which they begin, the time-outs that come due, and why.
    """

    def __init__(
        self,
        machine: Machine,
        parameters: Sequence[Any],
        stated: Sequence[Property],
        events: Sequence[str],
        *,
        precision: Precision,
        not_a_number: bool = True,
        forgetful: bool = True,
        loose: Loose = NOTHING_LOOSE,
    ) -> None:
        self.machine = machine
        model = machine.model
        self.symbols = Symbols(not_a_number=not_a_number)
        names = machine.generator.own_variables
        types: list[Type] = [*(one.type for one in model.parameters), *(one.type for one in model.variables)]
        claims = (*stated, *model.assumptions)
        conditions = [condition for one in claims for condition in conditions_of(one.claim)]
        scopes = frozenset(machine.indices[one.scope] for one in claims if one.scope is not None)
        asked = [*deciding(model), *conditions]
        self.regions = Regions(
            self.symbols,
            types,
            names,
            relevant=relevant(model, asked),
            changing={one.variable for one in actions_of(model) if isinstance(one, Assign)},
            precision=precision,
        )
        kept: list[Kept] = [
            Region(*held(declared.type)) if given is FREE else Exact.of(given)
            for given, declared in zip(parameters, model.parameters, strict=True)
        ]
        kept += [Exact.of(one) for one in machine.generator.first_values(parameters)[len(kept) : len(types)]]
        values, _ = self.regions.opened(kept)
        self.evaluator = Evaluator(
            self.symbols, machine.generator.variables, machine.indices, values, compared=self.regions.compared
        )
        self.regions.look_ahead(self.evaluator, [*expressions_of(model), *conditions], _constants(model), values)
        self._selections = Selections(machine, self.evaluator)
        messages = EventSymbols(machine, self.symbols)
        buried = Liveness(machine, claims).buried if forgetful else _nothing_buried
        microsteps = Microsteps(
            machine, self.evaluator, scopes, duration=self._duration, messages=messages, buried=buried
        )
        self.stepper = Stepper(
            machine,
            self._selections,
            microsteps,
            messages=messages,
            events=events,
            settled=self.regions.settled,
            loose=loose,
        )
        self._assumed = Assumed(machine, self.evaluator)
        self.locations: list[Location] = []
        self.edges: list[list[Edge]] = []
        self.initial: list[Edge] = []
        self.complete = False
        self.depth = 0
        self.faults: list[tuple[int, frozenset[int], FailingStep]] = []
        self._numbers: dict[Location, int] = {}

    def build(self, budget: Budget, most_depth: int | None = None) -> None:
        """Find all locations and steps, those near the start first.

        Raises:
            Undecided: the machine has a feature that proofs do not support.
            NoRun: no run satisfies the assumptions.
        """
        values = tuple(self.evaluator.values)
        quiet, heard = self.stepper.start(values, self._assumed.signals(values))
        self.initial = list(self._edges(-1, frozenset(), quiet))
        self.initial += [replace(one, heard=True) for one in self._edges(-1, frozenset(), heard)]
        self.faults += [(-1, frozenset(), one) for one in self.stepper.faults]
        self.stepper.faults.clear()
        if not self.initial and self.machine.model.assumptions:
            raise NoRun("no first step succeeds" if self.faults else "no run satisfies the assumptions")
        done = 0
        while done < len(self.locations):
            if most_depth is not None and self.depth >= most_depth:
                return
            for number in range(done, len(self.locations)):
                if budget.spent or len(self.locations) > budget.locations:
                    return
                self.edges.append(list(self._from(number)))
                done = number + 1
            self.depth += 1
        self.complete = True

    @property
    def failures(self) -> Sequence[str]:
        """The unsupported features of the machine, in words."""
        return list(self._selections.failures)

    def begin(self, number: int, due: frozenset[int]) -> tuple[Point, Diagram]:
        """Where a step from a location begins when some time-outs come due in it."""
        location = self.locations[number]
        values, among = self.regions.opened(location.values)
        among = self.symbols.diagrams.both(among, self._assumed.signals(values))
        timers = tuple(
            replace(one, due=True) if one.transition in due else one for one in location.timers if not is_deadline(one)
        )
        point = Point(
            location.leaves,
            location.history,
            location.over,
            timers,
            values,
            location.acted,
            outcome=location.outcome,
            deferred=location.deferred,
            pending=location.pending,
        )
        return point, among

    def number_of(self, location: Location) -> int:
        """The number of a location; a new one if it was not known."""
        found = self._numbers.get(location)
        if found is None:
            found = self._numbers[location] = len(self.locations)
            self.locations.append(location)
        return found

    def _from(self, number: int) -> Iterator[Edge]:
        for due in self._patterns(self.locations[number]):
            yield from self._edges(number, due, self.stepper.step(*self.begin(number, due)))
            self.faults += [(number, due, one) for one in self.stepper.faults]
            self.stepper.faults.clear()

    def _edges(
        self, source: int, due: frozenset[int], ends: Sequence[tuple[Point, Diagram]] | Iterator[tuple[Point, Diagram]]
    ) -> Iterator[Edge]:
        before = self._assumed.begin() if source < 0 else self.locations[source].assumed
        for point, reaching in ends:
            running = tuple(replace(one, fresh=False, beats=False) for one in point.timers)
            begun = frozenset(one.clock for one in point.timers if one.fresh)
            beats = tuple(one for one in point.timers if one.beats)
            for memories, restarted, among in self._assumed.after(before, point, reaching, first=source < 0):
                timers = (*self._assumed.timers(memories), *running)
                for values, further in self.regions.closed(point.values, among):
                    if point.outcome is None:
                        own = (point.leaves, point.history, point.over, timers, values, point.acted, None)
                        target = Location(*own, point.deferred, point.pending, memories)
                    else:  # nothing follows
                        target = Location(point.leaves, (), frozenset(), (), values, frozenset(), point.outcome)
                    yield Edge(source, self.number_of(target), due, begun | restarted, beats, further, point)

    def _patterns(self, location: Location) -> Iterator[frozenset[int]]:
        """Which time-outs may come due in one step: of those of one state the shorter ones first."""
        clocks: dict[Clock, dict[tuple[int, int], set[int]]] = {}
        for one in location.timers:
            if not one.due and not is_deadline(one):
                clocks.setdefault(one.clock, {}).setdefault((one.least, one.most), set()).add(one.transition)
        choices: list[list[frozenset[int]]] = []
        for durations in clocks.values():
            ordered = [durations[key] for key in sorted(durations)]
            if any(least < most for least, most in durations):
                subsets = product((False, True), repeat=len(ordered))
                choices.append(
                    [
                        frozenset().union(*(one for one, taken in zip(ordered, way, strict=True) if taken))
                        for way in subsets
                    ]
                )
            else:
                choices.append([frozenset().union(*ordered[:count]) for count in range(len(ordered) + 1)])
        for chosen in product(*choices):
            due: frozenset[int] = frozenset().union(*chosen)
            if not any(one.most >= NEVER and one.least >= NEVER for one in location.timers if one.transition in due):
                yield due

    def _duration(self, value: Value) -> tuple[int, int]:
        if isinstance(value, OneOf):
            ways = [self._duration(one) for one in (value.then, value.otherwise)]
            return min(least for least, _ in ways), max(most for _, most in ways)
        if not isinstance(value, Exact):
            return 0, NEVER
        if value.value is None or not 0 <= value.value < seconds(NEVER):
            return NEVER, NEVER
        count = nanoseconds(value.value)
        return count, count


def unsupported(model: Model) -> str | None:
    """An unsupported feature of a machine; None if there is none."""
    for one in model.transitions:
        if not isinstance(one.trigger, On | When | After | Every | Held | Always):
            return f"a trigger that proofs do not support ({one.place})"
        if isinstance(one.trigger, On) and (one.trigger.prefix or ("*" in one.trigger.names and model.events is None)):
            return f"events that are matched by a pattern ({one.place})"
    for action in actions_of(model):
        if isinstance(action, Send) and (action.delay <= 0 or model.events is None):
            return f"an event that is sent without a delay ({action.place})"
    return None


def events_of(model: Model) -> list[str]:
    """The names that may come from outside, of those that some transition waits for.

    Raised ones are among them, but not what one member sends to another.
    """
    own = {name for one in actions_of(model) if isinstance(one, Emit) for name in one.receivers}
    waited = (name for one in model.transitions if isinstance(one.trigger, On) for name in one.trigger.names)
    names = dict.fromkeys(waited)
    if model.events is None:
        return list(names)
    return [
        name
        for name in ([*names, *sorted(model.events)] if "*" in names else names)
        if name in model.events and name not in own
    ]


def _nothing_buried(
    _active: frozenset[int], values: tuple[Value, ...], history: Remembered
) -> tuple[tuple[Value, ...], Remembered]:
    """All values and all that is remembered."""
    return values, history


def _constants(model: Model) -> Iterator[tuple[str, Any]]:
    """The constants that variables are given, each with the variable's name."""
    assigned = ((one.variable, one.value) for one in actions_of(model) if isinstance(one, Assign))
    for name, value in (*((one.name, one.initial) for one in model.variables), *assigned):
        if isinstance(value, Literal):
            yield name, value.value
