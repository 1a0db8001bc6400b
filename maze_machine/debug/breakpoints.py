"""Breakpoints: at lines, at states and conditions by name, at changes of a value, at faults."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

from hsm.engine.evaluation import UNSET
from hsm.model.diagnostics import MachineError
from hsm.testing.scenarios.reading import parse_expectation
from hsm.testing.scenarios.scenarios import ConditionHolds, Expectation, InState, Performs
from maze_machine.debug.chart import Chart, Spot
from maze_machine.debug.steps import Step

FAULT, VIOLATION = "fault", "violation"
_HITS = re.compile(r"\s*(>=|>|==|=|%)?\s*(\d{1,9})\s*")


class BreakConditionError(Exception):
    """A condition that cannot be read; the message says why."""


@dataclass(frozen=True, slots=True)
class BreakCondition:
    """A condition on a point of a run.

    Attributes:
        text: as it was written.
        expected: the claim.
    """

    text: str
    expected: Expectation

    def holds(self, step: Step, point: int) -> bool:
        """Whether all of it is so."""
        return all(_met(one.content, step, point) for one in self.expected.claims)


def read_condition(text: str, chart: Chart) -> BreakCondition:
    """A condition in the syntax of an ``expect`` line: ``in_door``, ``turns == 2 and not space.left``.

    Raises:
        ConditionError: it cannot be read, or cannot be evaluated at a point of a run.
    """
    try:
        expected = parse_expectation(text, chart.model, chart.library, "condition")
    except MachineError as error:
        found = error.diagnostics[0]
        raise BreakConditionError(found.message + (f"; {found.suggestion}" if found.suggestion else "")) from None
    if expected.within is not None:
        raise BreakConditionError("remove `within`: a condition holds at one point")
    for claim in expected.claims:
        if not claim.lasts:
            raise BreakConditionError(f"`{claim.text}` is known only at the end of a step; use `expect` in the console")
    return BreakCondition(text, expected)


def _met(content: object, step: Step, point: int) -> bool:
    match content:
        case InState(state, negated):
            return (state in step.states(point)) != negated
        case ConditionHolds(condition):
            return step.value(point, condition) is True
        case Performs(negated=negated):
            return any(map(content.matches, step.performed(point))) != negated
    return False


@dataclass(slots=True)
class LineBreakpoint:
    """A line at which to stop: where a state of it is entered, or a transition of it is about to be taken.

    Attributes:
        number: its own number.
        spot: the line.
        condition: only where this holds, or None.
        hits: the hit condition as written; empty for every hit.
        message: what to say instead of stopping; empty to stop.
        met: how often it was met.
    """

    number: int
    spot: Spot
    condition: BreakCondition | None = None
    hits: str = ""
    message: str = ""
    met: int = 0


@dataclass(slots=True)
class NamedBreakpoint:
    """A state to stop in as it is entered, or a condition to stop at as it becomes true."""

    number: int
    state: str | None
    condition: BreakCondition


@dataclass(frozen=True, slots=True)
class ValueBreakpoint:
    """A variable or a signal to stop at as it changes."""

    number: int
    name: str


@dataclass(frozen=True, slots=True)
class Hit:
    """A breakpoint that was hit.

    Attributes:
        kind: what kind it is, in the words of the protocol.
        text: a description.
        numbers: which breakpoints.
        stops: whether the run stops; otherwise the text is only logged.
    """

    kind: str
    text: str
    numbers: tuple[int, ...] = ()
    stops: bool = True


@dataclass(slots=True)
class Breakpoints:
    """All breakpoints of a run.

    Attributes:
        lines: by file.
        named: states and conditions.
        values: variables and signals.
        faults: whether to stop at faults of the machine.
        violations: whether to stop where a property does not hold.
    """

    lines: dict[str, list[LineBreakpoint]] = field(default_factory=dict)
    named: list[NamedBreakpoint] = field(default_factory=list)
    values: list[ValueBreakpoint] = field(default_factory=list)
    faults: bool = True
    violations: bool = True

    def met(self, here: tuple[Step, int], before: tuple[Step, int] | None) -> Iterator[Hit]:
        """The breakpoints that are hit at a point.

        Args:
            here: the point.
            before: the point that the run comes from; None at the start.
        """
        step, point = here
        if point == step.count and self.violations and step.violations:
            yield Hit("exception", "; ".join(step.violations))
        entered, taken = frozenset(step.entered(point)), frozenset(step.transitions(point))
        for one in (one for found in self.lines.values() for one in found):
            if one.spot.states & entered or one.spot.transitions & taken:
                yield from _line_met(one, step, point)
        for named in self.named:
            if named.state is not None:
                if named.state in entered:
                    yield Hit("function breakpoint", f"{named.state} was entered", (named.number,))
            elif named.condition.holds(step, point) and not (before and named.condition.holds(*before)):
                yield Hit("function breakpoint", f"`{named.condition.text}` holds", (named.number,))
        if before is None:
            return
        for value in self.values:
            was, now = _named_value(value.name, before), _named_value(value.name, here)
            if UNSET not in (was, now) and was != now:
                yield Hit("data breakpoint", f"`{value.name}` has changed", (value.number,))


def _line_met(one: LineBreakpoint, step: Step, point: int) -> Iterator[Hit]:
    if one.condition is not None and not one.condition.holds(step, point):
        return
    one.met += 1
    if not _counts(one.hits, one.met):
        return
    if one.message:
        yield Hit("breakpoint", _filled_in(one.message, step, point), (one.number,), stops=False)
    else:
        yield Hit("breakpoint", f"line {one.spot.line}", (one.number,))


def _counts(hits: str, met: int) -> bool:
    """Whether a breakpoint stops at this hit count: ``3`` from the third time on, ``% 3`` every third time."""
    found = _HITS.fullmatch(hits)
    if found is None:
        return True
    number = int(found[2])
    comparisons: Mapping[str | None, Callable[[], bool]] = {
        None: lambda: met >= number,
        ">=": lambda: met >= number,
        ">": lambda: met > number,
        "=": lambda: met == number,
        "==": lambda: met == number,
        "%": lambda: number > 0 and met % number == 0,
    }
    return comparisons[found[1]]()


def _filled_in(message: str, step: Step, point: int) -> str:
    """A message with the values of the names in braces."""

    def value(found: re.Match[str]) -> str:
        known = _named_value(found[1].strip(), (step, point))
        return found[0] if known is UNSET else str(known)

    return re.sub(r"\{([^{}]+)\}", value, message)


def _named_value(name: str, at: tuple[Step, int]) -> object:
    """The value of a variable or a signal; ``UNSET`` where it has none."""
    step, point = at
    variables = step.variables(point)
    return variables[name] if name in variables else step.signals().get(name, UNSET)
