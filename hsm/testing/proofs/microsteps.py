"""One symbolic microstep, from the engine's planner, if not all values are known."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import inf
from typing import NamedTuple

from hsm.engine.configuration import Plan
from hsm.engine.generated import Block, Occasion
from hsm.engine.limits import within_limits
from hsm.engine.machine import Machine
from hsm.model.chart import Action, After, Assign, Call, Cancel, Emit, Every, Held, Model, Raise, Send
from hsm.model.events import StateEvent
from hsm.model.expressions import Binary, Expression, Literal, VariableValue
from hsm.model.rewriting import actions_of
from hsm.model.types import LARGEST_INTEGER, Integer, Quantity, Type
from hsm.testing.proofs.conditions import Evaluator
from hsm.testing.proofs.diagrams import FALSE, TRUE, Diagram
from hsm.testing.proofs.event_data import EventSymbols, with_waiting
from hsm.testing.proofs.points import CarriedEvent, Point, Queued, Remembered, Timer, Waiting
from hsm.testing.proofs.values import DEAD, Derived, Exact, OneOf, Truth, Undecided, Value
from hsm.testing.proofs.zones import own_clock

_SHORTEST = 0.6e-9
"""In seconds: what is shorter counts as no nanosecond."""


class Sent(NamedTuple):
    """An event that arrives later.

    Attributes:
        event: of its data it has what is constant; the rest may then be anything.
        name: the event's.
        delay: s.
        label: by which it can be cancelled.
    """

    event: str | CarriedEvent
    name: str
    delay: float
    label: str | None


class Microsteps:
    """Executes plans symbolically.

    Args:
        machine: the machine.
        evaluator: evaluates its expressions.
        scopes: states of which it matters whether they were entered.
        duration: the least and the greatest duration that a value represents, in nanoseconds.
        messages: the events of the machine.
        buried: takes active states, values and what is remembered; returns the last two without what is dead.

    Attributes:
        sends: what arrives later.
        symbols: represent unknown values.
    """

    def __init__(
        self,
        machine: Machine,
        evaluator: Evaluator,
        scopes: frozenset[int],
        *,
        duration: Callable[[Value], tuple[int, int]],
        messages: EventSymbols,
        buried: Callable[[frozenset[int], tuple[Value, ...], Remembered], tuple[tuple[Value, ...], Remembered]],
    ) -> None:
        self._machine = machine
        self._evaluator = evaluator
        self._diagrams = evaluator.symbols.diagrams
        self._scopes = scopes
        self._duration = duration
        self._buried = buried
        self._messages = messages
        self.symbols = evaluator.symbols
        model = machine.model
        self._types: list[Type] = [one.type for one in model.parameters] + [one.type for one in model.variables]
        self._counters = counters(model)
        self.sends = list(dict.fromkeys(_sent(one) for one in actions_of(model) if isinstance(one, Send)))

    def planned(self, point: Point, plan: Plan) -> tuple[Point, tuple[Queued, ...], Diagram]:
        """A microstep: where it leads, the events that it raises, and the signals for which nothing in it fails."""
        timers = [one for one in point.timers if one.transition not in plan.disarmed]
        values = list(point.values)
        raised: list[Queued] = []
        pending = [point.pending]
        acted = point.acted.difference(plan.disarmed).union(plan.acted)
        possible = TRUE
        for item in plan.work:
            if isinstance(item, StateEvent):
                raised.append(item)
                continue
            block, active = item
            if block.role is Occasion.REPEAT:
                possible = self._diagrams.both(possible, self._repeat(block, plan, values, timers, active))
            if block.enters:
                possible = self._diagrams.both(possible, self._enter(block.state, values, timers, active))
            for action in block.actions:
                further = self._act(action, values, raised=raised, pending=pending, timers=timers, active=active)
                possible = self._diagrams.both(possible, further)
        history = dict(point.history)
        history.update(plan.remembered)
        own = tuple(values[: len(self._types)])
        kept, remembered = self._buried(plan.target.active, own, tuple(sorted(history.items())))
        return (
            Point(
                plan.target.leaves,
                remembered,
                point.over.difference(plan.exited, plan.entered),
                _ordered(timers),
                kept,
                acted,
                point.entered | self._scopes.intersection(plan.entered),
                plan.outcome or point.outcome,
                point.deferred,
                pending[0],
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
            possible = self._diagrams.both(possible, self._held(values[slot], variable.name, variable.type))
        for index in model.states[state].transitions:
            trigger = model.transitions[index].trigger
            if isinstance(trigger, After | Every):
                duration = self._evaluator.at(values, active).value(trigger.duration)
                possible = self._diagrams.both(possible, self._lasting(duration, again=isinstance(trigger, Every)))
                clock = state if isinstance(trigger, After) else own_clock(index)
                _begin(timers, Timer(index, *self._duration(duration), clock, fresh=True))
        return possible

    def watched(self, point: Point, index: int) -> tuple[Point, Diagram]:
        """A condition has begun to hold; the signals for which its duration can be computed."""
        trigger = self._machine.model.transitions[index].trigger
        assert isinstance(trigger, Held), "nothing else is watched"
        active = self._machine.configuration(point.leaves).active
        duration = self._evaluator.at(point.values, active).value(trigger.duration)
        timers = list(point.timers)
        _begin(timers, Timer(index, *self._duration(duration), own_clock(index), fresh=True))
        return replace(point, timers=_ordered(timers)), self._lasting(duration)

    def _repeat(
        self, block: Block, plan: Plan, values: list[Value], timers: list[Timer], active: frozenset[int]
    ) -> Diagram:
        """The next time of what is repeated: its clock continues from the one that has come."""
        possible = TRUE
        for index in plan.transitions:
            trigger = self._machine.model.transitions[index].trigger
            if isinstance(trigger, Every) and self._machine.model.transitions[index].source == block.state:
                duration = self._evaluator.at(values, active).value(trigger.duration)
                possible = self._diagrams.both(possible, self._lasting(duration, again=True))
                begun = next((one for one in timers if one.transition == index), None)
                new = begun is None or begun.fresh
                _begin(timers, Timer(index, *self._duration(duration), own_clock(index), fresh=new, beats=not new))
        return possible

    def _act(
        self,
        action: Action,
        values: list[Value],
        *,
        raised: list[Queued],
        pending: list[Waiting],
        timers: list[Timer],
        active: frozenset[int],
    ) -> Diagram:
        """Execute one action; return the signals for which it does not fail."""
        match action:
            case Assign(variable, expression):
                slot = self._evaluator.slots[variable]
                if variable in self._counters and values[slot] is DEAD and not _constant(expression):
                    return TRUE  # what is not read again is not counted
                values[slot] = self._evaluator.at(values, active).value(expression)
                return self._held(values[slot], variable, self._types[slot])
            case Call() | Emit(receivers=()):
                pass  # neither a robot's action nor an event for machines elsewhere changes this one
            case Raise(event, _, arguments):
                given, possible = self._carried(event, arguments, values, active)
                raised.append(CarriedEvent(event, given) if given else event)
                return possible
            case Emit(event, _, arguments, receivers):
                given, possible = self._carried(event, arguments, values, active)
                for name in receivers:
                    pending[0] = with_waiting(pending[0], CarriedEvent(name, given) if given else name)
                return possible
            case Send(event, delay, arguments=arguments) if delay > 0:
                _, possible = self._carried(event, arguments, values, active)
                number = -1 - self.sends.index(_sent(action))
                # Only the first of several pending events is followed; any may arrive at any time, as from outside.
                if all(one.transition != number for one in timers):
                    least, most = self._duration(Exact.of(delay))
                    _begin(timers, Timer(number, least, most, own_clock(number), fresh=True))
                return possible
            case Cancel(label):
                timers[:] = [
                    one for one in timers if one.transition >= 0 or self.sends[-1 - one.transition].label != label
                ]
            case _:
                raise Undecided(f"an action that proofs do not support ({action.place})")
        return TRUE

    def _carried(
        self, event: str, arguments: Sequence[Expression], values: Sequence[Value], active: frozenset[int]
    ) -> tuple[tuple[Value, ...], Diagram]:
        """What an event carries that is raised or sent, and the signals for which it can."""
        evaluator = self._evaluator.at(values, active)
        given, possible = tuple(map(evaluator.value, arguments)), TRUE
        for value, kind in zip(given, self._messages.types(event), strict=False):
            possible = self._diagrams.both(possible, self._held(value, "", kind))
        return given, possible

    def _held(self, value: Value, name: str, kind: Type) -> Diagram:
        """Where a variable can hold a value: floats are finite, whole numbers have 63 bits."""
        match value:
            case Truth(true, false):
                return self._diagrams.either(true, false)
            case Exact(content):
                return TRUE if content is None or within_limits(content, kind) else FALSE
            case Derived() if isinstance(kind, Quantity):
                return self._between(value, -inf, inf)
            case Derived() if isinstance(kind, Integer) and name not in self._counters:
                return self._between(value, -LARGEST_INTEGER - 2, LARGEST_INTEGER + 1)
            case OneOf(condition, then, otherwise):
                ways = (self._held(one, name, kind) for one in (then, otherwise))
                return self._evaluator.symbols.where(condition, *ways)
        return TRUE

    def _lasting(self, duration: Value, *, again: bool = False) -> Diagram:
        """Where a time-out can have a duration; a repeated one must be above zero."""
        shortest = _SHORTEST if again else 0.0
        match duration:
            case Exact(content):
                return TRUE if content is not None and shortest <= content < inf else FALSE
            case Derived():
                least = self._evaluator.symbols.compared(">=", duration, Exact.of(shortest)).true
                return self._diagrams.both(least, self._between(duration, -inf, inf))
            case OneOf(condition, then, otherwise):
                ways = (self._lasting(one, again=again) for one in (then, otherwise))
                return self._evaluator.symbols.where(condition, *ways)
        return FALSE

    def _between(self, value: Derived, low: float, high: float) -> Diagram:
        """Where a value is between two others, both excluded."""
        compared = self._evaluator.symbols.compared
        above, below = compared(">", value, Exact.of(low)).true, compared("<", value, Exact.of(high)).true
        return self._diagrams.both(above, below)


def _begin(timers: list[Timer], timer: Timer) -> None:
    """A time-out begins; one that runs already begins again."""
    timers[:] = [one for one in timers if one.transition != timer.transition]
    timers.append(timer)


def _ordered(timers: list[Timer]) -> tuple[Timer, ...]:
    return tuple(sorted(timers, key=lambda one: one.transition))


def _sent(send: Send) -> Sent:
    given = tuple(Exact.of(one.value) if isinstance(one, Literal) else None for one in send.arguments)
    return Sent(CarriedEvent(send.event, given) if given else send.event, send.event, send.delay, send.label)


def counters(model: Model) -> frozenset[str]:
    """The variables that only count: set to constants, and changed by a constant of at most 31 bits.

    In a run with fewer than 2^32 changes none of them leaves the 63 bits that a whole number has.
    """
    given: dict[str, list[Expression]] = {
        one.name: [one.initial] for one in model.variables if isinstance(one.type, Integer)
    }
    for action in actions_of(model):
        if isinstance(action, Assign) and action.variable in given:
            given[action.variable].append(action.value)
    return frozenset(
        name
        for name, values in given.items()
        if all(_counts(name, one) for one in values) and not all(map(_constant, values))
    )


def _counts(name: str, value: Expression) -> bool:
    match value:
        case Binary("+" | "-", VariableValue(own), step) if own == name:
            return _constant(step)
    return _constant(value)


def _constant(value: Expression) -> bool:
    return isinstance(value, Literal) and isinstance(value.value, int) and abs(value.value) < 1 << 31
