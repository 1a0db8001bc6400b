"""What may happen next in a run: for each transition of an active state, what would make it fire, or why it does not.

Nothing is guessed: each event, outcome and time-out is tried on a copy of the run, by the engine itself.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import islice, product
from typing import Any

from hsm.engine.evaluation import BINARY
from hsm.engine.explanation import Considered, Verdict, by_transition
from hsm.engine.occurrences import event_text
from hsm.engine.snapshots import SnapshotError
from hsm.model.chart import Defer, Held, On, Timed, Transition
from hsm.model.expressions import Binary, EventValue, Expression, Literal, Unary, VariableValue
from hsm.model.faults import MachineFault
from hsm.model.messages import Occurrence
from hsm.model.registry import EventField
from hsm.model.rewriting import parts_of
from hsm.model.types import UNITS, Boolean, Enumeration, Integer, Type, si_value
from hsm.model.unparse import expression_text, trigger_text, value_text
from hsm.model.values import dataclass
from hsm.testing.scenarios.driver import Driver

MOST_DATA = 64
"""How many values of what an event carries are tried at most."""
ARITHMETIC = ("+", "-", "*", "/")
NEAR = 0.1
"""The distance of a value that is tried beside a number, as a share of it."""


@dataclass(frozen=True, slots=True)
class Prospect:
    """A transition of an active state and what becomes of it next.

    Attributes:
        transition: the transition.
        enabled: whether it fires when ``line`` is done.
        line: the line of a scenario that was tried; empty where only a signal or a variable can change it.
        reason: why it does not fire; where it does, what it waits for.
    """

    transition: Transition
    enabled: bool
    line: str
    reason: str

    def __str__(self) -> str:
        trigger = trigger_text(self.transition.trigger, self.transition.guard)
        where = f"line {self.transition.place.line}: " if self.transition.place else ""
        told = f"fires at `{self.line}`" if self.enabled else self.reason
        return f"{where}{trigger}: {told}"


@dataclass(frozen=True, slots=True)
class _Trial:
    """A line that may be done next, and what it would do."""

    line: str
    considered: Mapping[int, Considered]


def prospects(driver: Driver) -> list[Prospect]:
    """What may happen next, state by state, the innermost first.

    Raises:
        SnapshotError: the run cannot be copied.
    """
    if driver.outcome is not None:
        return []
    model, indices = driver.machine.model, driver.machine.indices
    active = sorted((indices[name] for name in driver.configuration), reverse=True)
    trials: dict[str, _Trial] = {}
    found: list[Prospect] = []
    for state in (*active, 0):
        for index in model.states[state].transitions:
            transition = model.transitions[index]
            if not isinstance(transition.trigger, Defer):
                found.append(_prospect(driver, transition, trials))
    return found


def _prospect(driver: Driver, transition: Transition, trials: dict[str, _Trial]) -> Prospect:
    """What becomes of one transition: the first of its lines that makes it fire, else why the last one does not."""
    last, line = next((one for one in reversed(driver.last.considered) if one.transition is transition), None), ""
    for line, events, reports, wait in _lines(driver, transition, last):
        if line not in trials:
            trials[line] = _tried(driver, line, events, reports, wait)
        tried = trials[line].considered.get(transition.index)
        if tried is not None:
            if tried.verdict is Verdict.TAKEN:
                return Prospect(transition, enabled=True, line=line, reason="")
            last = tried
    reason = last.reason if last is not None else _idle(transition)
    return Prospect(transition, enabled=False, line=line, reason=reason)


def _idle(transition: Transition) -> str:
    """Why nobody looked at a transition."""
    match transition.trigger:
        case Held(condition):
            return f"`{expression_text(condition)}` does not hold"
        case _:
            return "no active state can make it fire"


_Line = tuple[str, Sequence[str], Mapping[str, str], float]


def _lines(driver: Driver, transition: Transition, last: Considered | None) -> Iterator[_Line]:
    """What may make a transition fire: lines, with their events, outcomes of activities and waits in seconds."""
    model, trigger = driver.machine.model, transition.trigger
    if isinstance(trigger, Timed):
        if last is not None and last.remaining is not None:
            yield f"after {last.remaining:.6g} s", (), {}, last.remaining
        return
    if not isinstance(trigger, On):
        yield f"after {driver.tick:.6g} s", (), {}, driver.tick
        return
    for name in trigger.names:
        for event in _events(driver, transition, name):
            yield f"when event {event}", (event,), {}, driver.tick
        for state, performed in driver.doing.items():
            index = driver.machine.indices[state]
            call = model.states[index].activity
            heard = index in model.states[transition.source].subtree
            if heard and call is not None and name in call.activity.outcomes:
                yield f"when {performed.name} reports {name}", (), {state: name}, driver.tick


def _events(driver: Driver, transition: Transition, name: str) -> Iterator[str]:
    """The declared events of a name, or of a pattern such as ``door.*``, with data that may make a guard hold."""
    model = driver.machine.model
    declared = model.events or frozenset()
    names = sorted(one for one in declared if name.endswith("*") and one.startswith(name[:-1]))
    for one in names or ([name] if name in declared else []):
        data = model.data_of(one)
        if data is None:
            yield one
            continue
        compared = [list(_numbers(driver.variables, transition.guard, data.variable(part))) for part in data.fields]
        tried = product(*map(_values, data.fields, compared))
        for values in islice(tried, MOST_DATA):
            carried = {part.name: value for part, value in zip(data.fields, values, strict=True)}
            yield event_text(model, Occurrence(one, carried))


def _numbers(variables: Mapping[str, Any], guard: Expression | None, name: str) -> Iterator[float]:
    """The numbers that a guard compares a part of an event with, as far as no signal decides them."""
    for comparison in () if guard is None else parts_of(guard):
        match comparison:
            case Binary("==" | "!=" | "<" | "<=" | ">" | ">="):
                parts = list(parts_of(comparison))
                if any(isinstance(one, EventValue) and one.name == name for one in parts):
                    found = (_number(variables, one) for one in parts)
                    yield from (one for one in found if one is not None)


def _number(variables: Mapping[str, Any], part: Expression) -> float | None:
    value: Any = None
    match part:
        case EventValue():
            pass
        case VariableValue(name):
            value = variables.get(name)
        case Literal(value):
            pass
        case Unary("-", operand):
            number = _number(variables, operand)
            value = None if number is None else -number
        case Binary(sign, left, right) if sign in ARITHMETIC:
            first, second = _number(variables, left), _number(variables, right)
            if first is not None and second is not None and not (sign == "/" and second == 0):
                value = BINARY[sign](first, second)
    return value if isinstance(value, int | float) and not isinstance(value, bool) else None


def _values(field: EventField, numbers: Sequence[float]) -> list[Any]:
    """The values to try for a part of an event, the simplest first: each number, and one on either side of it."""
    match field.type:
        case Boolean():
            return [False, True]
        case Enumeration(members=members):
            return [one if field.enumeration is None else field.enumeration(one) for one in members]
        case Integer():
            whole = [round(one) + step for one in numbers for step in (0, 1, -1)]
            return list(dict.fromkeys([0, *whole]))
        case kind:
            near = [float(f"{one + side:.6g}") for one in numbers for side in _margins(one)]
            return list(dict.fromkeys([0.0, *(_written(one, kind) for one in (*numbers, *near))]))


def _margins(number: float) -> tuple[float, float]:
    margin = NEAR * abs(number) or 1.0
    return margin, -margin


def _written(value: float, kind: Type) -> float:
    """The value after it was written to a line and read again."""
    number, _, unit = value_text(value, kind).partition(" ")
    return si_value(number, UNITS.get(unit))


def _tried(driver: Driver, line: str, events: Sequence[str], reports: Mapping[str, str], wait: float) -> _Trial:
    """Do a line on a copy of the run."""
    fork = driver.machine.restore(driver.supervisor.snapshot())
    script = driver.stimulated(reports)
    fork.act(script)
    try:
        step = fork.step(fork.time + wait, events, script)
    except (MachineFault, SnapshotError):
        return _Trial(line, {})
    return _Trial(line, by_transition(step.considered))
