"""One step of a machine from all that is known before it: every way it can go, with the signals for which it goes so.

The order of things within a step is that of the engine (``hsm.engine.execution``): outcomes, events from outside,
time-outs that are due, conditions, each followed by what it raises, until nothing fires. What a microstep does is
planned by the engine's own planner. Ways that come to the same point are one way, for all their signals together.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

from hsm.engine.configuration import Picked, Selector
from hsm.engine.execution import fault_event
from hsm.engine.machine import Machine
from hsm.model.events import Event, StateEvent
from hsm.testing.proofs.diagrams import FALSE, TRUE, Diagram
from hsm.testing.proofs.microsteps import Microsteps
from hsm.testing.proofs.points import ENDED, SETTLING, FailingStep, Label, Place, Point, Stage
from hsm.testing.proofs.possible import Possible
from hsm.testing.proofs.selections import Selections
from hsm.testing.proofs.values import TooMany, Value
from hsm.testing.scenarios.script import FAULT

MOST_POINTS = 4_000
"""At most this many points are looked at within one step at most."""

Ways = dict[int, dict[int, Diagram]]
"""From one place to others, by their numbers, each with the signals."""


class Stepper:
    """Takes steps of one machine.

    Args:
        machine: the machine.
        selections: what fires.
        microsteps: does it.
        events: names that may come from outside.
        settled: replaces values that would grow without end.

    Attributes:
        faults: steps that cannot be done.
        possible: what some step may exercise.
    """

    def __init__(
        self,
        machine: Machine,
        selections: Selections,
        microsteps: Microsteps,
        events: Sequence[str],
        settled: Callable[[tuple[Value, ...], Diagram], list[tuple[tuple[Value, ...], Diagram]]],
    ) -> None:
        self._machine = machine
        self._selections = selections
        self._microsteps = microsteps
        self._events = events
        self._settled = settled
        self._diagrams = selections.diagrams
        self._failed: list[tuple[Diagram, Label]] = []
        self.faults: list[FailingStep] = []
        self.possible = Possible(untold=selections.untold)

    def start(self, parameters: tuple[Value, ...]) -> list[tuple[Point, Diagram]]:
        """Entering the machine and the first step, which comes at the same time."""
        nowhere = Point((), (), frozenset(), (), parameters)
        plan = self._machine.planner.start()
        self.possible.take(plan)
        first, queue, possible = self._microsteps.planned(nowhere, plan)
        begun: dict[Place, Diagram] = {}
        for point, among in self._run({(SETTLING, first, queue): possible}, heard=()):
            due = frozenset(one.transition for one in point.timers if one.most <= 1)
            place = (Stage(2, due=due) if point.outcome is None else ENDED, point, ())
            begun[place] = self._diagrams.either(begun.get(place, FALSE), among)
        return self._run(begun, heard=())

    def step(
        self, point: Point, among: Diagram, parents: dict[Place, tuple[Place, Label]] | None = None
    ) -> list[tuple[Point, Diagram]]:
        """All points at the end of a step, each with the signals for which it comes there.

        Args:
            point: where the step begins; its time-outs that are due are marked.
            among: the signals that are possible.
            parents: takes down how each place was reached.
        """
        if point.outcome is not None:
            return []
        configuration = self._machine.configuration(point.leaves)
        running = tuple(one for one in configuration.activities if one not in point.over)
        return self._run({(Stage(0, running), point, ()): among}, self._events, parents)

    def _run(
        self,
        begin: Mapping[Place, Diagram],
        heard: Sequence[str],
        parents: dict[Place, tuple[Place, Label]] | None = None,
    ) -> list[tuple[Point, Diagram]]:
        """Follow all ways from some places to their ends."""
        either, without = self._diagrams.either, self._diagrams.without
        numbers: dict[Place, int] = {}
        places: list[Place] = []
        seen: list[Diagram] = []
        pending: dict[int, Diagram] = {}
        ends: dict[int, Diagram] = {}
        ways: Ways = {}

        def meet(place: Place, among: Diagram) -> int:
            number = numbers.setdefault(place, len(places))
            if number == len(places):
                places.append(place)
                seen.append(FALSE)
                if number > MOST_POINTS:
                    raise TooMany(f"one step with more than {MOST_POINTS} ways to go")
            pending[number] = either(pending.get(number, FALSE), among)
            return number

        for place, among in begin.items():
            meet(place, among)
        first = len(places)
        while pending:
            number = next(iter(pending))
            place, fresh = places[number], without(pending.pop(number), seen[number])
            if fresh == FALSE:
                continue
            seen[number] = either(seen[number], fresh)
            if place[0].number == ENDED.number:
                ends[number] = seen[number]
                continue
            for following, further, label in self._all_onward(place, fresh, heard):
                known = len(places)
                target = meet(following, further)
                if parents is not None and target >= max(known, first):
                    parents[following] = (place, label)
                if label is None:
                    onward = ways.setdefault(number, {})
                    onward[target] = either(onward.get(target, FALSE), further)
            self.faults += [FailingStep(place, among, label) for among, label in self._failed]
            self._failed.clear()
        self.faults += [FailingStep(places[one], among, None) for one, among in self._spinning(ways)]
        return [(places[number][1], among) for number, among in ends.items()]

    def _spinning(self, ways: Ways) -> Iterator[tuple[int, Diagram]]:
        """Places from which what follows by itself comes round to where it was, with the signals for which it does."""
        around = _on_cycles(ways)
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

    def _all_onward(self, place: Place, among: Diagram, heard: Sequence[str]) -> Iterator[tuple[Place, Diagram, Label]]:
        """What a place leads to, values that would grow without end replaced."""
        for (stage, point, queue), further, label in self._onward(place, among, heard):
            for values, part in self._settled(point.values, further):
                settled = point if values is point.values else replace(point, values=values)
                yield (stage, settled, queue), part, label

    def _onward(self, place: Place, among: Diagram, heard: Sequence[str]) -> Iterator[tuple[Place, Diagram, Label]]:
        """What a place leads to: first what follows by itself, then what comes next."""
        stage, point, queue = place
        if point.outcome is not None:
            yield (ENDED, point, ()), among, None
            return
        configuration = self._machine.configuration(point.leaves)
        rest = among
        if configuration.always is not None:
            for picked, further in self._picked(configuration.always, point, among):
                if picked is not None:
                    yield self._fired(place, picked, further)
                    rest = self._diagrams.without(rest, further)
        if rest == FALSE:
            return
        if queue:
            yield from self._heard((stage, point, queue[1:]), queue[0], rest, None)
            return
        match stage.number:
            case 0:
                yield from self._reports(stage, point, rest)
            case 1:
                yield from self._outside(stage, point, rest, heard)
            case 2:
                yield from self._time_outs(stage, point, rest)
            case 3:
                yield from self._conditions(stage, point, rest)
            case _:
                yield (ENDED, point, ()), rest, None

    def _outside(
        self, stage: Stage, point: Point, among: Diagram, heard: Sequence[str]
    ) -> Iterator[tuple[Place, Diagram, Label]]:
        """One more event from outside, or none."""
        configuration = self._machine.configuration(point.leaves)
        for name in heard:
            if configuration.on(name) is not None:
                yield from self._heard((stage, point, ()), name, among, ("event", name, ""))
        due = frozenset(one.transition for one in point.timers if one.due or (one.fresh and one.most <= 1))
        yield (Stage(2, due=due), point, ()), among, None

    def _reports(self, stage: Stage, point: Point, among: Diagram) -> Iterator[tuple[Place, Diagram, Label]]:
        """What the activities report, one after the other; what they were doing was begun before this step."""
        if not stage.reports:
            yield (Stage(1), point, ()), among, None
            return
        state, *others = stage.reports
        following = Stage(0, tuple(others))
        yield (following, point, ()), among, None
        declared = self._machine.model.states[state]
        assert declared.activity is not None, "only states with an activity are asked"
        configuration = self._machine.configuration(point.leaves)
        ended = replace(point, over=point.over | {state}) if state in configuration.active else point
        events = {
            outcome: StateEvent((outcome,), state, f"done.invoke.{declared.name}")
            for outcome in declared.activity.activity.outcomes
        }
        if self._selections.handled:
            events[FAULT] = fault_event(state)
        self.possible.outcomes.update((state, outcome) for outcome in events)
        for outcome, event in events.items():
            if outcome != FAULT or configuration.on(event) is not None:
                yield from self._heard((following, ended, ()), event, among, ("report", declared.name, outcome))

    def _heard(
        self, place: Place, event: Event, among: Diagram, label: Label
    ) -> Iterator[tuple[Place, Diagram, Label]]:
        """What an event leads to."""
        point = place[1]
        selector = self._machine.configuration(point.leaves).on(event)
        if selector is None:
            yield place, among, label
            return
        for picked, further in self._picked(selector, point, among, label=label):
            yield (place, further, label) if picked is None else self._fired(place, picked, further, label)

    def _time_outs(self, stage: Stage, point: Point, among: Diagram) -> Iterator[tuple[Place, Diagram, Label]]:
        configuration = self._machine.configuration(point.leaves)
        if not stage.due or configuration.after is None:
            yield (Stage(3), point, ()), among, None
            return
        for picked, further in self._picked(configuration.after, point, among, stage.due):
            if picked is None:
                yield (Stage(3), point, ()), further, None
            else:
                plan = self._machine.planner.plan(configuration, picked, dict(point.history))
                left = Stage(2, due=stage.due.difference(plan.disarmed))
                yield self._fired((left, point, ()), picked, further)

    def _conditions(self, stage: Stage, point: Point, among: Diagram) -> Iterator[tuple[Place, Diagram, Label]]:
        when = self._machine.configuration(point.leaves).when
        if when is None:
            yield (ENDED, point, ()), among, None
            return
        for picked, further in self._picked(when, point, among):
            ended = ((ENDED, point, ()), further, None)
            yield ended if picked is None else self._fired((stage, point, ()), picked, further)

    def _picked(
        self, selector: Selector, point: Point, among: Diagram, due: frozenset[int] | None = None, label: Label = None
    ) -> Iterator[tuple[Picked | None, Diagram]]:
        """What a selector can pick, None for nothing, each with the signals for which it does."""
        self.possible.paths(self._selections.paths(selector, point, due), among, self._diagrams.both)
        for picked, condition in self._selections.choices(selector, point, due):
            further = self._diagrams.both(among, condition)
            if further != FALSE:
                among = self._diagrams.without(among, condition)
                yield picked, further
        if among != FALSE:
            self._failed.append((among, label))

    def _fired(self, place: Place, picked: Picked, among: Diagram, label: Label = None) -> tuple[Place, Diagram, Label]:
        """What a selector picked is done: where it leads, and the signals for which nothing in it fails."""
        stage, point, queue = place
        configuration = self._machine.configuration(point.leaves)
        plan = self._machine.planner.plan(configuration, picked, dict(point.history))
        self.possible.take(plan)
        following, raised, possible = self._microsteps.planned(point, plan)
        further = self._diagrams.both(among, possible)
        if further != among:
            self._failed.append((self._diagrams.without(among, possible), label))
        return (stage, following, (*queue, *raised)), further, label


def _on_cycles(ways: Ways) -> set[int]:
    """The places from which a way leads back to them, and those between: all others are taken away."""
    left = {place: {one for one in onward if one in ways} for place, onward in ways.items()}
    before: dict[int, list[int]] = {}
    for place, onward in left.items():
        for one in onward:
            before.setdefault(one, []).append(place)
    ended = [place for place, onward in left.items() if not onward]
    while ended:
        place = ended.pop()
        del left[place]
        for one in before.get(place, ()):
            if one in left:
                left[one].discard(place)
                if not left[one]:
                    ended.append(one)
    return set(left)
