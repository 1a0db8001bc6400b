"""From the lines that state properties to typed claims."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import reduce

from hsm.dsl.reporting.report import Report
from hsm.dsl.semantics.names import Names
from hsm.dsl.semantics.typing import Scope
from hsm.dsl.syntax import ast
from hsm.dsl.syntax.ast import first_token, last_token, place_of
from hsm.dsl.syntax.tokens import Token
from hsm.model.chart import State
from hsm.model.expressions import Active, Binary, Expression, Literal
from hsm.model.properties import AlwaysHolds, Claim, Never, Paced, Precedence, Property, Recurrence, Response
from hsm.model.types import BOOLEAN


def compile_properties(
    lines: Iterable[ast.PropertyLine],
    source: Sequence[str],
    scope: Scope,
    states: Sequence[State],
    further: Names,
) -> tuple[Property, ...]:
    """Analyse the properties of a file.

    Args:
        lines: their syntax.
        source: the text of the file, line by line.
        scope: what the expressions of the file may name.
        states: all states, with those of instances.
        further: activities and resources that states may have besides those that are known.
    """
    inner = _Scope(scope.library, scope.report, scope.variables, scope.states)
    inner.doubtful, inner.possible, inner.used = scope.doubtful, scope.possible, scope.used
    inner.definitions, inner.enumerations = scope.definitions, scope.enumerations
    inner.carried, inner.outcomes = scope.carried, scope.outcomes
    inner.machine, inner.further = states, further
    found = [_property(line, source, inner, scope.report) for line in lines]
    return tuple(one for one in found if one is not None)


class _Scope(Scope):
    """Properties may also refer to activities: ``doing(ring)``, ``holding(base)``."""

    machine: Sequence[State] = ()
    further: Names = Names()

    def _call(self, node: ast.CallSyntax) -> Expression | None:
        match node.name.value:
            case "doing":
                return self._some(node, "activity", lambda state: (_activity(state),))
            case "holding":
                return self._some(node, "thing to hold", _holds)
        return super()._call(node)

    def _some(self, node: ast.CallSyntax, what: str, has: Callable[[State], tuple[str, ...]]) -> Expression | None:
        """The condition that a state is active whose activity has a name, or uses a resource."""
        match node.arguments:
            case (Token(type="NAME") as name,):
                pass
            case _:
                place = place_of(self.report.file, node.name, node.closing)
                self.report.add("E0213", place, f"`{node.name}` takes one name")
                return None
        place = place_of(self.report.file, node.name, node.closing)
        active: list[Expression] = [Active(one.name, place) for one in self.machine if str(name) in has(one)]
        if not active and str(name) in self.further:
            return None
        if not active:
            known = dict.fromkeys(one for state in self.machine for one in has(state) if one)
            hint = self.report.guess(name, known).text
            self.report.add_once("E0204", place_of(self.report.file, name), f"no state has the {what} `{name}`", hint)
            return None
        return reduce(lambda left, right: Binary("or", left, right, BOOLEAN, place), active)


def _activity(state: State) -> str:
    return state.activity.activity.name if state.activity is not None else ""


def _holds(state: State) -> tuple[str, ...]:
    return state.activity.activity.holds if state.activity is not None else ()


TICK = "tick"
"""In an assumption ``always tick <= DURATION``: the time between two steps."""

NO_PACE = "the longest tick cannot be 0 s"
NO_PACE_HINT = "write the longest time between two steps that you expect, such as `0.25 s`"


def _property(line: ast.PropertyLine, source: Sequence[str], scope: Scope, report: Report) -> Property | None:
    pace = _pace(line, scope)
    conditions = [] if pace is not None else [scope.condition(one) for one in line.conditions]
    within = None
    limit = line.within if pace is None else pace
    if limit is not None:
        value = scope.duration(limit)
        if isinstance(value, Literal) and pace is not None and value.value == 0:
            report.add("E0307", place_of(report.file, first_token(limit), last_token(limit)), NO_PACE, NO_PACE_HINT)
        elif isinstance(value, Literal):
            within = float(value.value)
        elif value is not None:
            place = place_of(report.file, first_token(limit), last_token(limit))
            report.add("E0303", place, "the time in a property must be constant")
    given = [one for one in conditions if one is not None]
    if len(given) < len(conditions) or (limit is not None and within is None):
        return None
    last = last_token(line.within if line.within is not None else line.conditions[-1])
    place = place_of(report.file, line.name, last)
    # The last token may be followed by brackets that close; a comment belongs to no claim.
    text = source[place.line - 1][line.keyword.column - 1 :].partition("#")[0].rstrip()
    claim = Paced(within or 0.0) if pace is not None else _claim(line.kind, given, within or 0.0)
    return Property(str(line.name), claim, text, place)


def _pace(line: ast.PropertyLine, scope: Scope) -> ast.Expression | None:
    """The time that an assumption about the longest tick states; None where a line states something else."""
    if not isinstance(line, ast.AssumptionLine) or line.kind != "always":
        return None
    match line.conditions[0]:
        case ast.BinarySyntax(operator, Token(type="NAME") as left, limit) if (operator, left) == ("<=", TICK):
            known = {*scope.variables, *scope.definitions, *scope.library.signals}
            return None if TICK in known else limit
    return None


def _claim(kind: str, conditions: Sequence[Expression], within: float) -> Claim:
    match kind:
        case "never":
            return Never(*conditions)
        case "always":
            return AlwaysHolds(*conditions)
        case "recurrence":
            return Recurrence(conditions[0], within)
        case "response":
            return Response(conditions[0], conditions[1], within)
        case _:
            return Precedence(*conditions)
