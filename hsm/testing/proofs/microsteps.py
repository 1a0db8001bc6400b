"""One microstep, as the engine's planner has it, where not all values are known."""

from __future__ import annotations

from collections.abc import Callable
from math import inf

from hsm.engine.configuration import Plan
from hsm.engine.limits import within_limits
from hsm.engine.machine import Machine
from hsm.model.chart import Action, After, Assign, Call, Raise
from hsm.model.events import Event, StateEvent
from hsm.model.types import Quantity, Type
from hsm.testing.proofs.conditions import Evaluator
from hsm.testing.proofs.diagrams import FALSE, TRUE, Diagram
from hsm.testing.proofs.points import Point, Timer
from hsm.testing.proofs.values import UNKNOWN, Derived, Exact, Undecided, Value


class Microsteps:
    """Does what plans ask for.

    Args:
        machine: the machine.
        evaluator: evaluates its expressions.
        scopes: states of which it matters whether they were entered.
        duration: the least and the greatest duration that a value represents, in nanoseconds.
    """

    def __init__(
        self,
        machine: Machine,
        evaluator: Evaluator,
        scopes: frozenset[int],
        duration: Callable[[Value], tuple[int, int]],
    ) -> None:
        self._machine = machine
        self._evaluator = evaluator
        self._diagrams = evaluator.symbols.diagrams
        self._scopes = scopes
        self._duration = duration
        model = machine.model
        self._types: list[Type] = [one.type for one in model.parameters] + [one.type for one in model.variables]

    def planned(self, point: Point, plan: Plan) -> tuple[Point, tuple[Event, ...], Diagram]:
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
