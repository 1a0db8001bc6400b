"""One symbolic step of a machine: every possible course, with the signals that lead to it.

The order of things within a step is that of the engine (``hsm.engine.execution``): outcomes, events from outside,
time-outs that are due, conditions, each followed by what it raises, until nothing fires. The engine's own planner plans
the microsteps. Courses that reach the same point are merged, with the union of their signals.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from typing import Any

from hsm.engine.configuration import Picked, Plan, Selector
from hsm.engine.machine import Machine
from hsm.engine.run_state import fault_event
from hsm.model.events import StateEvent
from hsm.testing.proofs.courses import Continuation, Expansion, Failing, Origin, Ways, on_cycles
from hsm.testing.proofs.diagrams import FALSE, TRUE, Diagram, TooMany
from hsm.testing.proofs.event_data import EventSymbols, carried, with_waiting
from hsm.testing.proofs.microsteps import Microsteps
from hsm.testing.proofs.points import (
    ENDED,
    NOTHING_LOOSE,
    SETTLING,
    AnyOf,
    CarriedEvent,
    FailingStep,
    Label,
    Loose,
    Part,
    Place,
    Point,
    Queued,
    Stage,
)
from hsm.testing.proofs.possible import Possible
from hsm.testing.proofs.selections import Selections
from hsm.testing.proofs.values import Value
from hsm.testing.proofs.zones import ROUNDING
from hsm.testing.scenarios.script import FAULT

MOST_POINTS = 4_000
"""At most this many points are visited within one step."""


class Stepper:
    """Takes steps of one machine.

    Args:
        machine: the machine.
        selections: what fires.
        microsteps: does it.
        messages: the events of the machine.
        events: names that may come from outside.
        settled: replaces values that would grow without bound; the last argument are other values in use.
        loose: what parts that are not followed may do.

    Attributes:
        faults: steps that cannot be done.
        possible: what some step may exercise.
        reached: the signals with which some step comes to each place, where this is asked for.
    """

    def __init__(
        self,
        machine: Machine,
        selections: Selections,
        microsteps: Microsteps,
        *,
        messages: EventSymbols,
        events: Sequence[str],
        settled: Callable[[tuple[Value, ...], Diagram, tuple[Value, ...]], list[tuple[tuple[Value, ...], Diagram]]],
        loose: Loose = NOTHING_LOOSE,
    ) -> None:
        self._machine = machine
        self._selections = selections
        self._microsteps = microsteps
        self._messages = messages
        self._events = events
        self._settled = settled
        symbols = microsteps.symbols
        self._loose = frozenset(symbols.number("signal", (one.name, ()), one.type) for one in loose.signals)
        self._loose_events = loose.events
        self._diagrams = selections.diagrams
        self._numbers: dict[Place, int] = {}
        self._places: list[Place] = []
        self._expansions: dict[int, Expansion] = {}
        self.faults: list[FailingStep] = []
        self.possible = Possible(untold=selections.untold)
        self.reached: dict[Place, Diagram] | None = None

    def start(
        self, parameters: tuple[Value, ...], given: Diagram
    ) -> tuple[list[tuple[Point, Diagram]], list[tuple[Point, Diagram]]]:
        """Entering the machine and the first step, which comes at the same time.

        Args:
            parameters: all values before the start.
            given: the signals that are possible.

        Returns:
            All points at its end, and those that it comes to only where it hears an event from outside.
        """
        nowhere = Point((), (), frozenset(), (), parameters)
        plan = self._machine.planner.start()
        self.possible.take(plan)
        first, queue, possible = self._microsteps.planned(nowhere, plan)
        if possible != TRUE:
            self._fail((SETTLING, nowhere, ()), self._failing(plan, self._diagrams.complement(possible), None), given)
        possible = self._diagrams.both(possible, given)
        quiet, hearing = dict[Place, Diagram](), dict[Place, Diagram]()
        for point, among in self._run({(SETTLING, first, queue): possible}):
            arrived, left = point.pending, replace(point, pending=())
            stages = [Stage(Part.TIME_OUTS, due=one, recalled=arrived) for one in _due(point)]
            if point.outcome is not None:
                stages = [ENDED]
            for begun, begins in ((quiet, stages), (hearing, [Stage(Part.OUTSIDE, recalled=arrived)])):
                for place in ((stage, left, ()) for stage in begins):
                    begun[place] = self._diagrams.either(begun.get(place, FALSE), among)
        ends = self._run(quiet)
        known = dict(ends)
        heard = ((point, self._diagrams.without(among, known.get(point, FALSE))) for point, among in self._run(hearing))
        return ends, [(point, among) for point, among in heard if among != FALSE]

    def step(
        self, point: Point, among: Diagram, parents: dict[Place, Origin] | None = None
    ) -> list[tuple[Point, Diagram]]:
        """All points at the end of a step, each with the signals for which it comes there.

        Args:
            point: where the step begins; its time-outs that are due are marked.
            among: the signals that are possible.
            parents: records how each place was reached.
        """
        if point.outcome is not None:
            return []
        configuration = self._machine.configuration(point.leaves)
        running = tuple(one for one in configuration.activities if one not in point.over)
        begun = Stage(Part.ARRIVALS, running, recalled=point.pending)
        return self._run({(begun, replace(point, pending=()), ()): among}, parents)

    def event_text(self, place: Place, carried: Mapping[int, Any]) -> str:
        """The event that is handled at a place, as a text.

        Args:
            place: with the event's data among its values.
            carried: the values of the symbols that represent it.
        """
        _, event = self._messages.closed(place[1], place[0].heard)
        assert isinstance(event, CarriedEvent), "only data has symbols"
        return self._messages.text(event, carried)

    def _run(
        self, begin: Mapping[Place, Diagram], parents: dict[Place, Origin] | None = None
    ) -> list[tuple[Point, Diagram]]:
        """Follow all courses from some places to their ends."""
        either, without = self._diagrams.either, self._diagrams.without
        pending = {self._number(place): among for place, among in begin.items()}
        seen: dict[int, Diagram] = {}
        ends: dict[int, Diagram] = {}
        ways: Ways = {}
        first = set(pending)
        while pending:
            number = next(iter(pending))
            known = seen.get(number, FALSE)
            fresh = without(pending.pop(number), known)
            if fresh == FALSE:
                continue
            seen[number] = either(known, fresh)
            if len(seen) > MOST_POINTS:
                raise TooMany(f"one step with more than {MOST_POINTS} ways to go")
            if self._places[number][0] == ENDED:
                ends[number] = seen[number]
                continue
            for target, further, way in self._onward(number, fresh):
                if parents is not None and target not in seen and target not in pending and target not in first:
                    parents[self._places[target]] = Origin(self._places[number], way.label, way.among, way.fresh)
                pending[target] = either(pending.get(target, FALSE), further)
                if way.label is None:
                    onward = ways.setdefault(number, {})
                    onward[target] = either(onward.get(target, FALSE), further)
        self.faults += [FailingStep(self._places[one], among, None) for one, among in self._spinning(ways)]
        if self.reached is not None:
            for number, among in seen.items():
                place = self._places[number]
                self.reached[place] = either(self.reached.get(place, FALSE), among)
        return [(self._places[number][1], among) for number, among in ends.items()]

    def _number(self, place: Place) -> int:
        number = self._numbers.setdefault(place, len(self._places))
        if number == len(self._places):
            self._places.append(place)
        return number

    def _spinning(self, ways: Ways) -> Iterator[tuple[int, Diagram]]:
        """Places on endless cycles of reactions, with the signals that lead to them."""
        around = on_cycles(ways)
        both, either = self._diagrams.both, self._diagrams.either
        alive = dict.fromkeys(around, TRUE)
        changed = True
        while changed:
            changed = False
            for place in around:
                left = FALSE
                for following, among in ways[place].items():
                    if following in alive:
                        left = either(left, both(among, alive[following]))
                left = both(left, alive[place])
                if left != alive[place]:
                    alive[place], changed = left, True
        return ((place, among) for place, among in alive.items() if among != FALSE)

    def _onward(self, number: int, among: Diagram) -> Iterator[tuple[int, Diagram, Continuation]]:
        """The successors of a place for some signals; values that would grow without bound are replaced."""
        both = self._diagrams.both
        expansion = self._expansion(number)
        for paths in expansion.paths:
            self.possible.paths(paths, among, both)
        for failing in expansion.failing:
            self._fail(self._places[number], failing, among)
        for way in expansion.ways:
            further = self.released(both(self.released(among, way.fresh), way.among), self._loose)
            if further == FALSE:
                continue
            if way.plan is not None:
                self.possible.take(way.plan)
            if way.grows:
                stage, point, queue = self._places[way.target]
                for values, part in self._settled(point.values, further, carried(queue)):
                    yield self._number((stage, point.with_values(values), queue)), part, way
            else:
                yield way.target, further, way

    def released(self, among: Diagram, fresh: frozenset[int]) -> Diagram:
        """Signals without what is known of symbols that represent something else from now on."""
        if not fresh:
            return among
        within = self._microsteps.symbols.within
        stale = frozenset(one for one in self._diagrams.symbols(among) if not fresh.isdisjoint(within(one)))
        return self._diagrams.without_symbols(among, stale)

    def _expansion(self, number: int) -> Expansion:
        """The successors of a place, computed once for all signals."""
        found = self._expansions.get(number)
        if found is None:
            found = self._expansions[number] = Expansion()
            place = self._places[number]
            for way in self._all_ways(place, found):
                if way.among != FALSE:
                    target = self._places[way.target][1].values
                    found.ways.append(replace(way, grows=self._settled(target, TRUE, ())[0][0] is not target))
        return found

    def _fail(self, place: Place, failing: Failing, among: Diagram) -> None:
        """Record that a step fails with some signals."""
        further = self._diagrams.both(among, failing.among)
        if further != FALSE:
            self.faults.append(FailingStep(place, further, failing.label))
            topology = self._machine.topology
            if self._selections.handling & {state for one in failing.states for state in topology.up(one)}:
                self._selections.failures[failing.obstacle] = None

    def _way(
        self,
        place: Place,
        among: Diagram,
        label: Label = None,
        plan: Plan | None = None,
        fresh: frozenset[int] = frozenset(),
    ) -> Continuation:
        return Continuation(self._number(place), among, label, plan, fresh=fresh)

    def _all_ways(self, place: Place, found: Expansion) -> Iterator[Continuation]:
        """The successors of a place: first reactions without input, then the next part of the step."""
        stage, point, queue = place
        if point.outcome is not None:
            yield self._way((ENDED, point, ()), TRUE)
            return
        if stage.heard:
            yield from self._handled(found, place, TRUE)
            return
        configuration = self._machine.configuration(point.leaves)
        rest = TRUE
        if configuration.always is not None:
            for picked, further in self._picked(found, configuration.always, point, rest):
                if picked is not None:
                    yield self._fired(found, place, picked, further)
                    rest = self._diagrams.without(rest, further)
        if rest == FALSE:
            return
        if stage.part <= Part.CONDITIONS or stage.part is Part.SETTLING:
            for name in self._loose_events:
                # What is not heard changes nothing; it would only look like an endless sequence.
                own = self._number(place)
                yield from (one for one in self._heard(found, place, name, rest, None) if one.target != own)
        if queue:
            yield from self._heard(found, (stage, point, queue[1:]), queue[0], rest, None)
            return
        if stage.moved:
            recalled = (*point.deferred, *stage.recalled)
            yield self._way((replace(stage, moved=False, recalled=recalled), replace(point, deferred=()), ()), rest)
            return
        if stage.recalled:
            yield from self._recalled(found, stage, point, rest)
            return
        yield from self._next(found, stage, point, rest)

    def _next(self, found: Expansion, stage: Stage, point: Point, among: Diagram) -> Iterator[Continuation]:
        """The next part of a step, once there is no further reaction."""
        match stage.part:
            case Part.ARRIVALS:
                yield from self._arrivals(found, stage, point, among)
            case Part.REPORTS:
                yield from self._reports(found, stage, point, among)
            case Part.OUTSIDE:
                yield from self._outside(found, point, among)
            case Part.TIME_OUTS:
                yield from self._time_outs(found, stage, point, among)
            case Part.CONDITIONS:
                yield from self._conditions(found, stage, point, among)
            case Part.WATCH:
                yield from self._watch(found, stage, point, among)
            case _:
                yield self._way((ENDED, point, ()), among)

    def _arrivals(self, found: Expansion, stage: Stage, point: Point, among: Diagram) -> Iterator[Continuation]:
        """The events on their way that arrive: those whose time has come, in any order; others at any time."""
        sends = self._microsteps.sends
        arriving = [one for one in point.timers if one.transition < 0 and one.due]
        for one in arriving:
            left = replace(point, timers=tuple(other for other in point.timers if other is not one))
            yield from self._heard(found, (stage, left, ()), sends[-1 - one.transition].event, among, None)
        for name in dict.fromkeys(one.name for one in sends):
            yield from self._heard(found, (stage, point, ()), name, among, ("event", name, ""))
        if not arriving:
            yield self._way((Stage(Part.REPORTS, stage.reports, stage.left), point, ()), among)

    def _outside(self, found: Expansion, point: Point, among: Diagram) -> Iterator[Continuation]:
        """One more event from outside, or none."""
        configuration = self._machine.configuration(point.leaves)
        for name in self._events:
            if configuration.on(name) is not None:
                place = (Stage(Part.OUTSIDE), point, ())
                yield from self._heard(found, place, name, among, ("event", name, ""))
        for due in _due(point):
            yield self._way((Stage(Part.TIME_OUTS, due=due), point, ()), among)

    def _reports(self, found: Expansion, stage: Stage, point: Point, among: Diagram) -> Iterator[Continuation]:
        """The reports of the activities, in order; the activities began before this step."""
        if not stage.reports:
            yield self._way((Stage(Part.OUTSIDE), point, ()), among)
            return
        state, *others = stage.reports
        following = Stage(Part.REPORTS, tuple(others), stage.left - {state})
        yield self._way((following, point, ()), among)
        declared = self._machine.model.states[state]
        assert declared.activity is not None, "only states with an activity have outcomes"
        configuration = self._machine.configuration(point.leaves)
        runs = state in configuration.active and state not in stage.left
        ended = replace(point, over=point.over | {state}) if runs else point
        events = {
            outcome: StateEvent((outcome,), state, f"done.invoke.{declared.name}")
            for outcome in declared.activity.activity.outcomes
        }
        if self._selections.handling:
            events[FAULT] = fault_event(state)
        self.possible.outcomes.update((state, outcome) for outcome in events)
        for outcome, event in events.items():
            if outcome != FAULT or configuration.on(event) is not None:
                label = ("report", declared.name, outcome)
                yield from self._heard(found, (following, ended, ()), event, among, label)

    def _recalled(self, found: Expansion, stage: Stage, point: Point, among: Diagram) -> Iterator[Continuation]:
        """The first event that was kept."""
        first, *others = stage.recalled
        left: Place = (replace(stage, recalled=tuple(others)), point, ())
        if not isinstance(first, AnyOf):
            yield from self._heard(found, left, first, among, None)
            return
        yield self._way(left, among)
        for name in sorted(first.names):
            yield from self._heard(found, (stage, point, ()), name, among, ("recalled", name, ""))

    def _heard(
        self, found: Expansion, place: Place, event: Queued, among: Diagram, label: Label
    ) -> Iterator[Continuation]:
        """What an event leads to; one with data is handled at a place where that is among the variables."""
        stage, point, queue = place
        name = event.name if isinstance(event, CarriedEvent) else event
        selector = self._machine.configuration(point.leaves).on(name)
        if selector is None:
            yield self._way(place, among, label)
            return
        opened, fresh = self._messages.opened(place, event)
        if opened is not point and isinstance(name, str):
            yield self._way((replace(stage, heard=name), opened, queue), among, label, fresh=fresh)
            return
        for picked, further in self._picked(found, selector, point, among, label=label):
            if picked is None:
                yield self._way(place, further, label)
            else:
                yield self._fired(found, place, picked, further, label=label, event=name)

    def _handled(self, found: Expansion, place: Place, among: Diagram) -> Iterator[Continuation]:
        """What an event with data leads to."""
        stage, point, queue = place
        bare, event = self._messages.closed(point, stage.heard)
        after = replace(stage, heard="")
        selector = self._machine.configuration(point.leaves).on(stage.heard)
        assert selector is not None, "nothing is handled that nothing waits for"
        for picked, further in self._picked(found, selector, point, among):
            if picked is None:
                yield self._way((after, bare, queue), further)
            else:
                yield self._fired(found, (after, point, queue), picked, further, event=event)

    def _time_outs(self, found: Expansion, stage: Stage, point: Point, among: Diagram) -> Iterator[Continuation]:
        configuration = self._machine.configuration(point.leaves)
        if not stage.due or configuration.after is None:
            yield self._way((Stage(Part.CONDITIONS), point, ()), among)
            return
        for picked, further in self._picked(found, configuration.after, point, among, due=stage.due):
            if picked is None:
                yield self._way((Stage(Part.CONDITIONS), point, ()), further)
            else:
                yield self._fired(found, (stage, point, ()), picked, further)

    def _conditions(self, found: Expansion, stage: Stage, point: Point, among: Diagram) -> Iterator[Continuation]:
        configuration = self._machine.configuration(point.leaves)
        after = Stage(Part.WATCH, held=configuration.held) if configuration.held else ENDED
        if configuration.when is None:
            yield self._way((after, point, ()), among)
            return
        for picked, further in self._picked(found, configuration.when, point, among):
            if picked is None:
                yield self._way((after, point, ()), further)
            else:
                yield self._fired(found, (stage, point, ()), picked, further)

    def _watch(self, found: Expansion, stage: Stage, point: Point, among: Diagram) -> Iterator[Continuation]:
        """The time of conditions begins that hold now, and ends of those that do not."""
        if not stage.held:
            yield self._way((ENDED, point, ()), among)
            return
        index, *others = stage.held
        following = Stage(Part.WATCH, held=tuple(others))
        truth = self._selections.held(index, point)
        holds, not_so = (self._diagrams.both(among, one) for one in (truth.true, truth.false))
        timers = tuple(one for one in point.timers if one.transition != index)
        yield self._way((following, replace(point, timers=timers, acted=point.acted - {index}), ()), not_so)
        if index in point.acted or any(one.transition == index for one in point.timers):
            yield self._way((following, point, ()), holds)
        else:
            begun, possible = self._microsteps.watched(point, index)
            holds = self._diagrams.both(holds, possible)
            yield self._way((following, begun, ()), holds)
        failing = self._diagrams.without(self._diagrams.without(among, holds), not_so)
        declared = self._machine.model.transitions[index]
        obstacle = f"a condition that may fail in a machine that handles faults ({declared.place})"
        found.failing.append(Failing(failing, None, (declared.source,), obstacle))

    def _picked(
        self,
        found: Expansion,
        selector: Selector,
        point: Point,
        among: Diagram,
        *,
        due: frozenset[int] | None = None,
        label: Label = None,
    ) -> Iterator[tuple[Picked | None, Diagram]]:
        """The possible results of a selector, None for nothing, each with its signals."""
        found.paths.append(self._selections.paths(selector, point, due))
        for picked, condition in self._selections.choices(selector, point, due):
            further = self._diagrams.both(among, condition)
            if further != FALSE:
                among = self._diagrams.without(among, condition)
                yield picked, further
        found.failing.append(Failing(among, label, (), ""))

    def _fired(
        self,
        found: Expansion,
        place: Place,
        picked: Picked,
        among: Diagram,
        *,
        label: Label = None,
        event: Queued | None = None,
    ) -> Continuation:
        """Take the selected transitions: the result, and the signals for which nothing fails."""
        stage, point, queue = place
        configuration = self._machine.configuration(point.leaves)
        plan = self._machine.planner.plan(configuration, picked, dict(point.history))
        following, raised, possible = self._microsteps.planned(point, plan)
        further = self._diagrams.both(among, possible)
        found.failing.append(self._failing(plan, self._diagrams.without(among, possible), label))
        if stage.due:
            stage = replace(stage, due=stage.due.difference(plan.disarmed, plan.transitions))
        if stage.reports:
            stage = replace(stage, left=stage.left.union(plan.exited).intersection(stage.reports))
        if self._messages.deferring and (plan.exited or plan.entered):
            stage = replace(stage, moved=True)
        if plan.kept and isinstance(event, str | CarriedEvent):
            following = replace(following, deferred=with_waiting(following.deferred, event))
        return self._way((stage, following, (*queue, *raised)), further, label, plan)

    def _failing(self, plan: Plan, among: Diagram, label: Label) -> Failing:
        """A microstep fails: that ends the run, unless the machine handles it, which is not supported."""
        transitions = [self._machine.model.transitions[index] for index in plan.transitions]
        place = transitions[0].place if transitions else None
        states = (*(one.source for one in transitions), *plan.exited, *plan.entered)
        obstacle = f"an action that may fail in a machine that handles faults ({place})"
        return Failing(among, label, states, obstacle)


def _due(point: Point) -> Iterator[frozenset[int]]:
    """The possible sets of due time-outs: of those that have just begun and may have zero duration, any subset."""
    running = [one for one in point.timers if one.transition >= 0]
    fixed = frozenset(one.transition for one in running if one.due or (one.fresh and one.most <= 1))
    short = [one.transition for one in running if one.fresh and one.least <= ROUNDING and one.transition not in fixed]
    for count in range(len(short) + 1):
        yield from (fixed.union(some) for some in combinations(short, count))
