"""The variables of a machine that matter for what it does and for what is asked of it; the others are dropped."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from hsm.model.chart import After, Assign, Emit, Every, Held, Model, Raise, Send, When
from hsm.model.expressions import Binary, Expression, Literal, VariableValue
from hsm.model.rewriting import actions_of, parts_of
from hsm.model.types import Boolean, Enumeration


def deciding(model: Model) -> Iterator[Expression]:
    """The expressions that influence what a machine does next."""
    for one in model.transitions:
        match one.trigger:
            case When(condition):
                yield condition
            case After(duration) | Every(duration):
                yield duration
            case Held(condition, duration):
                yield condition
                yield duration
        if one.guard is not None:
            yield one.guard


def relevant(model: Model, asked: Sequence[Expression]) -> frozenset[str]:
    """The variables and parameters that matter, by name, directly or indirectly.

    Some expressions depend on them, or they choose between values of which one may be beyond its limits: a number that
    may be anything covers each of its values, a flag or a name does not.
    """
    given: dict[str, list[Expression]] = {one.name: [one.initial] for one in model.variables}
    for action in actions_of(model):
        match action:
            case Assign(variable, value):
                given.setdefault(variable, []).append(value)
            case Raise(event, _, arguments) | Send(event, arguments=arguments):
                _give(given, model, [event], arguments)
            case Emit(event, _, arguments, receivers):
                _give(given, model, receivers, arguments)
    found: set[str] = set()
    pending = [*asked, *(part for one in given.values() for value in one for part in _choosing(value))]
    while pending:
        for part in parts_of(pending.pop()):
            if isinstance(part, VariableValue) and part.name not in found:
                found.add(part.name)
                pending += given.get(part.name, ())
    return frozenset(found)


def _give(
    given: dict[str, list[Expression]], model: Model, events: Iterable[str], arguments: Sequence[Expression]
) -> None:
    """Note what some events carry, by the names under which transitions read it."""
    for event in events:
        declared = model.data_of(event)
        for part, value in zip(() if declared is None else declared.fields, arguments, strict=False):
            given.setdefault(f"{event}.{part.name}", []).append(value)


def _choosing(value: Expression) -> Iterator[Expression]:
    """The flags and names in an expression that may fail."""
    parts = list(parts_of(value))
    plain = isinstance(value, Literal | VariableValue)
    if plain or (isinstance(value.type, Boolean | Enumeration) and not any(map(_is_quotient, parts))):
        return
    yield from (one for one in parts if isinstance(one, VariableValue) and isinstance(one.type, Boolean | Enumeration))


def _is_quotient(part: Expression) -> bool:
    return isinstance(part, Binary) and part.operator == "/"
