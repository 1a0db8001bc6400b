"""One step of a machine from all that is known before it: every way it can go, with the signals for which it goes so.

The order of things within a step is that of the engine (``hsm.engine.execution``): outcomes, events from outside,
time-outs that are due, conditions, each followed by what it raises, until nothing fires. What a microstep does is
planned by the engine's own planner. Ways that come to the same point are one way, for all their signals together.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf
from typing import Any

from hsm.engine.configuration import Picked, Plan, Selector
from hsm.engine.decisions import Condition, Constant, Negation, Tree
from hsm.engine.execution import fault_event
from hsm.engine.limits import within_limits
from hsm.engine.machine import Machine
from hsm.model.chart import Action, After, Assign, Call, On, Raise
from hsm.model.events import Event, StateEvent
from hsm.model.types import Quantity, Type
from hsm.testing.proofs.conditions import Evaluator
from hsm.testing.proofs.diagrams import FALSE, TRUE, Diagram
from hsm.testing.proofs.values import NO, UNKNOWN, YES, Derived, Exact, TooMany, Truth, Undecided, Value
from hsm.testing.scenarios.script import FAULT

NANOSECOND = 1e-9
MOST_POINTS = 4_000
"""So many points are looked at within one step at most."""


@dataclass(frozen=True, slots=True)
class Timer:
    """A time-out that runs.

    Attributes:
        transition: its index.
        least: its duration in nanoseconds, at least.
        most: at most.
        due: whether its time had come in an earlier step or has come in this one.
        fresh: whether it began in this step.
    """

    transition: int
    least: int
    most: int
    due: bool = False
    fresh: bool = False


@dataclass(frozen=True, slots=True)
class Point:
    """Where a step is.

    Attributes:
        leaves: the active atomic states.
        history: what each history state remembers.
        over: states whose activity has ended.
        timers: the time-outs that run.
        values: the variables.
        entered: the states that were entered in this step, as far as anybody asks.
        outcome: how the run ended, or None.
    """

    leaves: tuple[int, ...]
    history: tuple[tuple[int, tuple[int, ...]], ...]
    over: frozenset[int]
    timers: tuple[Timer, ...]
    values: tuple[Value, ...]
    entered: frozenset[int] = frozenset()
    outcome: str | None = None


@dataclass(frozen=True, slots=True)
class Stage:
    """What a step does next.

    Attributes:
        number: 0 outcomes, 1 events from outside, 2 time-outs, 3 conditions, 4 nothing more.
        reports: the activities that may report something, from this one on.
        due: the time-outs that are due and have not been looked at.
    """

    number: int
    reports: tuple[int, ...] = ()
    due: frozenset[int] = frozenset()


Place = tuple[Stage, Point, tuple[Event, ...]]
"""A point with what comes next and the events that wait in the machine's own queue."""

Label = tuple[str, str, str] | None
"""An outcome (``report``, state, outcome) or an event (``event``, name, empty) that was heard, or None."""


@dataclass(frozen=True, slots=True)
class Failure:
    """A step that cannot be done.

    Attributes:
        place: within the step.
        among: the signals for which it fails.
        label: the outcome or event that is heard there.
    """

    place: Place
    among: Diagram
    label: Label


ENDED = Stage(4)

SETTLING = Stage(5)
"""The start: only what follows by itself."""


class Stepper:
    """Takes steps of one machine.

    Args:
        machine: the machine.
        evaluator: evaluates its expressions.
        events: names that may come from outside.
        scopes: states of which it matters whether they were entered.
        duration: the least and the greatest duration that a value stands for, in nanoseconds.
        settled: replaces values that would grow without end.

    Attributes:
        failures: why some steps cannot be followed to their end, by reason.
        faults: places within steps at which a guard fails, or from which what follows by itself comes round, with the
            signals for which it is so.
    """

    def __init__(
        self,
        machine: Machine,
        evaluator: Evaluator,
        events: Sequence[str],
        scopes: Collection[int],
        *,
        duration: Callable[[Value], tuple[int, int]],
        settled: Callable[[tuple[Value, ...], Diagram], list[tuple[tuple[Value, ...], Diagram]]],
    ) -> None:
        self._machine = machine
        self._evaluator = evaluator
        self._diagrams = evaluator.symbols.diagrams
        self._events = events
        model = machine.model
        self._types: list[Type] = [one.type for one in model.parameters] + [one.type for one in model.variables]
        self._scopes = frozenset(scopes)
        self._duration = duration
        self._settled = settled
        self._guards: dict[tuple[int, tuple[Value, ...], frozenset[int]], Truth] = {}
        self._choices: dict[
            tuple[Selector, frozenset[int] | None, tuple[Value, ...]],
            list[tuple[int | tuple[int, ...] | None, Diagram]],
        ] = {}
        self.failures: dict[str, None] = {}
        self._handled = any(
            isinstance(one.trigger, On) and "fault" in one.trigger.names for one in machine.model.transitions
        )
        self.faults: list[Failure] = []
        self._failed: list[tuple[Diagram, Label]] = []

    def start(self) -> Iterator[tuple[Point, Diagram]]:
        """Entering the machine and the first step, which comes at the same time."""
        machine = self._machine
        plan = machine.planner.start()
        parameters = tuple(self._evaluator.values)
        nowhere = Point((), (), frozenset(), (), parameters)
        first, queue, possible = self._planned(nowhere, plan)
        settled = self._run({(SETTLING, first, queue): possible}, heard=())
        begun: dict[Place, Diagram] = {}
        for point, among in settled:
            due = frozenset(one.transition for one in point.timers if one.most <= 1)
            place = (Stage(2, due=due) if point.outcome is None else ENDED, point, ())
            begun[place] = self._diagrams.either(begun.get(place, FALSE), among)
        yield from self._run(begun, heard=())

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

    # The order of things.

    def _run(
        self,
        begin: Mapping[Place, Diagram],
        heard: Sequence[str],
        parents: dict[Place, tuple[Place, Label]] | None = None,
    ) -> list[tuple[Point, Diagram]]:
        either, without = self._diagrams.either, self._diagrams.without
        seen: dict[Place, Diagram] = {}
        pending: dict[Place, Diagram] = dict(begin)
        ends: dict[Point, Diagram] = {}
        ways: dict[Place, dict[Place, Diagram]] = {}
        rounds = 0
        while pending:
            place = next(iter(pending))
            among = pending.pop(place)
            fresh = without(among, seen.get(place, FALSE))
            if fresh == FALSE:
                continue
            seen[place] = either(seen.get(place, FALSE), fresh)
            rounds += 1
            if rounds > MOST_POINTS:
                raise TooMany(f"one step with more than {MOST_POINTS} ways to go")
            if place[0] == ENDED:
                ends[place[1]] = either(ends.get(place[1], FALSE), fresh)
                continue
            for following, further, label in self._all_onward(place, fresh, heard):
                if parents is not None and following not in parents and following not in begin:
                    parents[following] = (place, label)
                if label is None:
                    onward = ways.setdefault(place, {})
                    onward[following] = either(onward.get(following, FALSE), further)
                pending[following] = either(pending.get(following, FALSE), further)
            self.faults += [Failure(place, among, label) for among, label in self._failed]
            self._failed.clear()
        self._look_for_spins(ways)
        return list(ends.items())

    def _look_for_spins(self, ways: Mapping[Place, Mapping[Place, Diagram]]) -> None:
        """Take down the signals for which what follows by itself comes round to where it was."""
        around = _on_cycles(ways)
        if not around:
            return
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
        self.faults += [Failure(place, among, None) for place, among in alive.items() if among != FALSE]

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
        if self._handled:
            events[FAULT] = fault_event(state)
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

    # What fires.

    def _picked(
        self, selector: Selector, point: Point, among: Diagram, due: frozenset[int] | None = None, label: Label = None
    ) -> Iterator[tuple[Any, Diagram]]:
        """What a selector can pick, None for nothing, each with the signals for which it does."""
        if due is not None:
            due = due.intersection(one for chain in selector.chains for one in chain.candidates)
        key = (selector, due, point.values)
        choices = self._choices.get(key)
        if choices is None:
            choices = self._choices[key] = self._all_choices(selector, point, due)
        for picked, condition in choices:
            further = self._diagrams.both(among, condition)
            if further != FALSE:
                among = self._diagrams.without(among, condition)
                yield picked, further
        if among != FALSE:
            self._failed.append((among, label))

    def _all_choices(self, selector: Selector, point: Point, due: frozenset[int] | None) -> list[tuple[Any, Diagram]]:
        both, either = self._diagrams.both, self._diagrams.either
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
            if self._handled and self._diagrams.either(found.true, found.false) != TRUE:
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

    # What is done.

    def _fired(self, place: Place, picked: Picked, among: Diagram, label: Label = None) -> tuple[Place, Diagram, Label]:
        """What a selector picked is done: where it leads, and the signals for which nothing in it fails."""
        stage, point, queue = place
        configuration = self._machine.configuration(point.leaves)
        plan = self._machine.planner.plan(configuration, picked, dict(point.history))
        following, raised, possible = self._planned(point, plan)
        further = self._diagrams.both(among, possible)
        if further != among:
            self._failed.append((self._diagrams.without(among, possible), label))
        return (stage, following, (*queue, *raised)), further, label

    def _planned(self, point: Point, plan: Plan) -> tuple[Point, tuple[Event, ...], Diagram]:
        """A microstep: where it leads, the events that it raises, and the signals for which nothing in it fails."""
        timers = [one for one in point.timers if one.transition not in plan.disarmed]
        values = list(point.values)
        raised: list[Event] = []
        possible = TRUE
        for item in plan.work:
            if isinstance(item, StateEvent):
                raised.append(item)
                continue
            block, active = item
            if block.enters:
                possible = self._diagrams.both(possible, self._enter(block.state, values, timers, active))
            for action in block.actions:
                possible = self._diagrams.both(possible, self._act(action, values, raised, active))
        history = dict(point.history)
        history.update(plan.remembered)
        return (
            Point(
                plan.target.leaves,
                tuple(sorted(history.items())),
                point.over.difference(plan.exited, plan.entered),
                tuple(sorted(timers, key=lambda one: one.transition)),
                tuple(values),
                point.entered | self._scopes.intersection(plan.entered),
                plan.outcome or point.outcome,
            ),
            tuple(raised),
            possible,
        )

    def _enter(self, state: int, values: list[Value], timers: list[Timer], active: frozenset[int]) -> Diagram:
        """Enter a state: its variables are set, its time-outs begin."""
        model, possible = self._machine.model, TRUE
        for slot in self._machine.generator.opened(state):
            variable = model.variables[slot - len(model.parameters)]
            values[slot] = self._evaluator.at(values, active).value(variable.initial)
            possible = self._diagrams.both(possible, self._held(values[slot], variable.type))
        for index in model.states[state].transitions:
            trigger = model.transitions[index].trigger
            if isinstance(trigger, After):
                duration = self._evaluator.at(values, active).value(trigger.duration)
                possible = self._diagrams.both(possible, self._lasting(duration))
                timers[:] = [one for one in timers if one.transition != index]
                timers.append(Timer(index, *self._duration(duration), fresh=True))
        return possible

    def _act(self, action: Action, values: list[Value], raised: list[Event], active: frozenset[int]) -> Diagram:
        """Do one action; the signals for which it does not fail."""
        match action:
            case Assign(variable, expression):
                slot = self._evaluator.slots[variable]
                values[slot] = self._evaluator.at(values, active).value(expression)
                return self._held(values[slot], self._types[slot])
            case Call():
                pass
            case Raise(event):
                raised.append(event)
            case _:
                raise Undecided(f"an action of a kind that proofs do not know: {type(action).__name__}")
        return TRUE

    def _held(self, value: Value, kind: Type) -> Diagram:
        """Where a variable can hold a value: whole numbers of 63 bits are taken to be enough, floats are finite."""
        if value == UNKNOWN:
            return FALSE
        if not isinstance(kind, Quantity):
            return TRUE
        match value:
            case Exact(content):
                return TRUE if content is None or within_limits(content, kind) else FALSE
            case Derived():
                return self._between(value, -inf, inf)
        return TRUE

    def _lasting(self, duration: Value) -> Diagram:
        """Where a time-out can have a duration."""
        match duration:
            case Exact(content):
                return TRUE if content is not None and 0 <= content < inf else FALSE
            case Derived():
                least = self._evaluator.symbols.compared(">=", duration, Exact.of(0.0)).true
                return self._diagrams.both(least, self._between(duration, -inf, inf))
        return FALSE

    def _between(self, value: Derived, low: float, high: float) -> Diagram:
        compared = self._evaluator.symbols.compared
        above, below = compared(">", value, Exact.of(low)).true, compared("<", value, Exact.of(high)).true
        return self._diagrams.both(above, below)


def _on_cycles(ways: Mapping[Place, Mapping[Place, Diagram]]) -> set[Place]:
    """The places from which a way leads back to them, and those between: all others are taken away."""
    left = {place: {one for one in onward if one in ways} for place, onward in ways.items()}
    before: dict[Place, list[Place]] = {}
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
