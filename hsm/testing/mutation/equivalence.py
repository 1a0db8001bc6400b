"""Mutants that no test can kill: in every run they do, after every step, what the machine itself does.

Machine and mutant begin in the same state. As long as both take the same transitions with the same effects, they stay
in the same state. So it is enough to compare what the two select, and what that does, at every place within a step that
the machine itself can come to, for all signals that lead there. Places and signals are those of the proofs
(``hsm.testing.proofs``), for any values of the parameters; where not all are known, nothing is proved. Expressions over
several unknown values count as alike only where they are the same expression.

Observed are the active states, the transitions taken, the activities that run with their arguments, the actions called,
the events raised and sent, the variables, and how a run ends. Assumed is what a proof assumes: no signal and no action
fails, and a run begins at its start.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

from hsm.engine.configuration import Plan, Selector
from hsm.engine.machine import Machine
from hsm.engine.run_state import fault_event
from hsm.model.chart import Action, Call, Model, On, State, Transition, When
from hsm.model.events import Event, StateEvent
from hsm.model.expressions import EventValue, VariableValue
from hsm.model.rewriting import parts_of
from hsm.model.topology import HISTORY
from hsm.testing.mutation.operators import Mutant
from hsm.testing.proofs.diagrams import FALSE, Diagram, TooMany
from hsm.testing.proofs.graph import FREE, events_of
from hsm.testing.proofs.places import ReachedPlaces, reached_places
from hsm.testing.proofs.points import CarriedEvent, Part, Place, Point
from hsm.testing.proofs.relevance import deciding
from hsm.testing.proofs.selections import Selections
from hsm.testing.proofs.values import NoRun, Undecided
from hsm.testing.scenarios.script import scripted_machine


class Equivalence:
    """Proves mutants of one machine equivalent.

    Args:
        machine: the machine, scripted.
    """

    def __init__(self, machine: Machine) -> None:
        self._machine = machine

    def proved(self, mutant: Mutant) -> bool:
        """Whether a mutant is proved equivalent; where it is not, it may be so nevertheless."""
        if not _alike(self._machine.model, mutant.model):
            return False
        if self._known is None:
            return False
        try:
            return _Comparison(self._known, scripted_machine(mutant.model)).same()
        except (NoRun, Undecided, TooMany):
            return False

    @cached_property
    def _known(self) -> ReachedPlaces | None:
        model = self._machine.model
        if model.defers_events() or model.members:
            return None
        return reached_places(self._machine, [FREE] * len(model.parameters))


def _alike(one: Model, other: Model) -> bool:
    """Whether two models differ at most in what is compared place by place, or in activities."""
    parts = ("variables", "parameters", "derived", "events", "event_data", "members", "exposed")
    return (
        all(getattr(one, name) == getattr(other, name) for name in parts)
        and len(one.states) == len(other.states)
        and len(one.transitions) == len(other.transitions)
        and all(map(_same_state, one.states, other.states))
        and all(map(_same_transition, one.transitions, other.transitions))
        and _read(other) <= _read(one)  # no place distinguishes values that the machine does not read
    )


def _read(model: Model) -> frozenset[str]:
    """The variables, parameters and parts of events that decide what a machine does."""
    parts = (part for one in deciding(model) for part in parts_of(one))
    return frozenset(one.name for one in parts if isinstance(one, VariableValue | EventValue))


def _same_state(one: State, other: State) -> bool:
    """States that differ at most in the effects of microsteps, in the transitions they offer, or in their activity."""
    if one.kind in HISTORY and other.kind in HISTORY:
        other = replace(other, kind=one.kind)
    effects = {name: getattr(one, name) for name in ("initial", "initial_actions", "entry", "exit")}
    return one == replace(other, **effects, transitions=one.transitions, activity=one.activity)


def _call(state: State) -> object:
    """What a state does; the declaration itself is a stand-in, another one in each machine."""
    return None if state.activity is None else (state.activity.activity.name, state.activity.arguments)


def _act(action: Action) -> object:
    """An action; the declaration of what is called is a stand-in, too."""
    return (action.action.name, action.arguments) if isinstance(action, Call) else action


def _same_transition(one: Transition, other: Transition) -> bool:
    """Transitions that differ at most in when they are selected and in their effects."""
    match one.trigger, other.trigger:
        case (On(), On()) | (When(), When()):
            other = replace(other, trigger=one.trigger)
    return one == replace(other, guard=one.guard, targets=one.targets, actions=one.actions)


class _Comparison:
    """Compares a machine with a mutant at every place that the machine can come to.

    Args:
        known: the places of the machine.
        other: the mutant, scripted.
    """

    def __init__(self, known: ReachedPlaces, other: Machine) -> None:
        self._known = known
        self._machine = known.graph.machine
        self._other = other
        self._diagrams = known.graph.symbols.diagrams
        self._selections = Selections(self._machine, known.graph.evaluator)
        self._mutated = Selections(other, known.graph.evaluator)
        self._events = list(dict.fromkeys([*events_of(self._machine.model), *events_of(other.model)]))
        self._carrying = frozenset(one.event for one in self._machine.model.event_data if one.fields)
        dropped = (
            set(one.transitions) ^ set(two.transitions)
            for one, two in zip(self._machine.model.states, other.model.states, strict=True)
        )
        self._dropped = frozenset[int]().union(*dropped)

    def same(self) -> bool:
        """Whether both select the same, with the same effects, everywhere."""
        states = zip(self._machine.model.states, self._other.model.states, strict=True)
        if any(_call(one) != _call(two) and one.index in self._known.resting for one, two in states):
            return False
        if self._effect(self._machine.planner.start()) != self._effect(self._other.planner.start()):
            return False
        return all(self._same_at(place, among) for place, among in self._known.reached.items())

    def _same_at(self, place: Place, among: Diagram) -> bool:
        point = place[1]
        if point.outcome is not None:
            return True
        own, other = (one.configuration(point.leaves) for one in (self._machine, self._other))
        if place[0].heard:
            heard = place[0].heard
            return self._same_choice(point, own.on(heard), other.on(heard), among)
        if not self._same_choice(point, own.always, other.always, among):
            return False
        if own.held != other.held:
            return False
        for event in self._heard(place):
            first, second = own.on(event), other.on(event)
            if isinstance(event, str) and event in self._carrying:  # compared where its data is known
                if (first is None) != (second is None):
                    return False
            elif not self._same_choice(point, first, second, among):
                return False
        match place[0].part:
            case Part.TIME_OUTS:
                return self._same_choice(point, own.after, other.after, among, place[0].due)
            case Part.CONDITIONS:
                return self._same_choice(point, own.when, other.when, among)
        return True

    def _heard(self, place: Place) -> Iterator[Event]:
        """The events that may be heard next at a place."""
        stage, _, queue = place
        if queue:
            yield queue[0].name if isinstance(queue[0], CarriedEvent) else queue[0]
            return
        if stage.part in (Part.ARRIVALS, Part.OUTSIDE):
            yield from self._events
        elif stage.part is Part.REPORTS and stage.reports:
            state = self._machine.model.states[stage.reports[0]]
            assert state.activity is not None, "only states with an activity report"
            for outcome in state.activity.activity.outcomes:
                yield StateEvent((outcome,), state.index, f"done.invoke.{state.name}")
            yield fault_event(state.index)

    def _same_choice(
        self,
        point: Point,
        own: Selector | None,
        other: Selector | None,
        among: Diagram,
        due: frozenset[int] | None = None,
    ) -> bool:
        """Whether two selectors select the same for some signals, with the same effects."""
        first = self._choices(self._selections, own, point, among, due)
        second = self._choices(self._mutated, other, point, among, due)
        if first != second:
            return False
        return all(
            self._planned(self._machine, point, picked) == self._planned(self._other, point, picked)
            for picked in first
            if picked is not None
        )

    def _choices(
        self,
        selections: Selections,
        selector: Selector | None,
        point: Point,
        among: Diagram,
        due: frozenset[int] | None,
    ) -> dict[Any, Diagram]:
        """What is selected for which signals; nothing where the selector has nothing to offer."""
        if selector is None:
            return {None: among}
        found: dict[Any, Diagram] = {}
        for picked, condition in selections.choices(selector, point, due):
            further = self._diagrams.both(among, condition)
            if further != FALSE:
                found[picked] = self._diagrams.either(found.get(picked, FALSE), further)
        return found

    def _planned(self, machine: Machine, point: Point, picked: Any) -> object:
        configuration = machine.configuration(point.leaves)
        return self._effect(machine.planner.plan(configuration, picked, dict(point.history)))

    def _effect(self, plan: Plan) -> object:
        """What a microstep does, apart from time-outs of transitions that only one of the two machines has."""
        work = tuple(
            one
            if isinstance(one, StateEvent)
            else (one[0].role, one[0].state, tuple(map(_act, one[0].actions)), one[1])
            for one in plan.work
        )
        disarmed = frozenset(plan.disarmed) - self._dropped
        rest: Sequence[object] = (plan.remembered, plan.acted, plan.restored, plan.outcome, plan.kept)
        return plan.transitions, plan.exited, plan.entered, plan.target.leaves, work, disarmed, *rest
