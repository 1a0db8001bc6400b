"""Signal values that lead a step along a path, chosen to be simple and to change little."""

from __future__ import annotations

import random
from collections.abc import Iterable, Iterator, Mapping
from itertools import islice
from typing import Any

from hsm.engine.evaluation import BINARY, UNARY
from hsm.model.types import Boolean, Enumeration, Integer, Type
from hsm.testing.exploration.domains import written
from hsm.testing.proofs.diagrams import Diagram, Interval
from hsm.testing.proofs.ordinals import NOT_A_NUMBER, domain, ordinal, value_at, within
from hsm.testing.proofs.values import Derived, Exact, Symbols, Value
from hsm.testing.scenarios.script import SignalKey

MOST_BOXES = 60
MOST_DRAWS = 40

Assigned = dict[int, Any]
"""The value of each symbol, by its number."""


class Valuations:
    """Chooses values of the symbols of one graph.

    Args:
        symbols: of the graph.
        seed: for random choices, if choosing in order finds nothing.
    """

    def __init__(self, symbols: Symbols, seed: int = 0) -> None:
        self._symbols = symbols
        self._random = random.Random(seed)

    def choose(self, among: Diagram, variables: Mapping[str, Any], known: Mapping[SignalKey, Any]) -> Assigned | None:
        """Values of all relevant symbols; None if none were found.

        Args:
            among: what they are to be in.
            variables: the values of variables before the step.
            known: the last values of signals.
        """
        for box in islice(self._symbols.diagrams.boxes(among), MOST_BOXES):
            for draw in range(MOST_DRAWS if self._arithmetic(box) else 1):
                found = self._assigned(box, variables, known, at_random=draw > 0)
                if found is not None:
                    return found
        return None

    def varied(self, parameters: Mapping[str, Any], free: Mapping[str, Type]) -> dict[str, Any]:
        """Other values for the parameters that may have any."""
        changed = {}
        for name, kind in free.items():
            if isinstance(kind, Boolean | Enumeration):
                changed[name] = value_at(self._random.randint(*domain(kind)), kind)
            else:
                value = parameters[name] + self._random.choice((-1, 1)) * self._random.choice((1, 2, 5, 20, 100, 1000))
                changed[name] = value if isinstance(kind, Integer) else float(value)
        return {**parameters, **changed}

    def signals(self, assigned: Assigned) -> dict[SignalKey, Any]:
        """The signals among the symbols, as a scenario names them."""
        found = {}
        for number, value in assigned.items():
            key = self._key(number, assigned)
            if key is not None:
                found[key] = value
        return found

    def carried(self, assigned: Assigned, numbers: Iterable[int]) -> Assigned:
        """What an event carries that is represented by some symbols."""
        return {
            number: assigned[number] if number in assigned else self._drawn(number, *self._limits(number, {}), {}, {})
            for number in numbers
        }

    def cube(self, assigned: Assigned) -> Diagram:
        """The one element of a set that has these values."""
        found = 1
        for number, value in assigned.items():
            at = ordinal(value, self._symbols[number].type)
            found = self._symbols.diagrams.both(found, self._symbols.between(number, at, at))
        return found

    def _arithmetic(self, box: Mapping[int, Interval]) -> bool:
        return any(self._symbols[number].what == "arithmetic" for number in box)

    def _assigned(
        self,
        box: Mapping[int, Interval],
        variables: Mapping[str, Any],
        known: Mapping[SignalKey, Any],
        *,
        at_random: bool,
    ) -> Assigned | None:
        found: Assigned = {}
        for number in sorted(self._needed(box), key=lambda one: self._symbols[one].what in ("signal", "event")):
            symbol = self._symbols[number]
            least, most = self._limits(number, box)
            if symbol.what == "variable" and not isinstance(symbol.key, str):
                continue  # a region that a variable was in within the step
            if symbol.what == "variable":
                value = variables.get(str(symbol.key))
                if value is None:
                    return None
            elif symbol.what in ("signal", "event"):
                value = self._drawn(number, least, most, variables, known, at_random=at_random)
            else:
                continue
            if not least <= ordinal(value, symbol.type) <= most:
                return None
            found[number] = value
        for number in box:
            if self._symbols[number].what == "arithmetic":
                least, most = self._limits(number, box)
                try:
                    value = self._computed(number, found)
                except (KeyError, TypeError, ArithmeticError):
                    return None
                if not least <= ordinal(value, self._symbols[number].type) <= most:
                    return None
                found[number] = value
        return found

    def _needed(self, box: Mapping[int, Interval]) -> set[int]:
        """The symbols that matter, those within arithmetic as well."""
        found: set[int] = set()
        pending: list[int] = list(box)
        while pending:
            number = pending.pop()
            if number not in found:
                found.add(number)
                pending += _inner(self._symbols[number].key)
        return found

    def _limits(self, number: int, box: Mapping[int, Interval]) -> tuple[int, int]:
        first, last = self._symbols.domain(number)
        least, below = box.get(number, (None, None))
        return first if least is None else max(first, least), last if below is None else min(last, below - 1)

    def _drawn(
        self,
        number: int,
        least: int,
        most: int,
        variables: Mapping[str, Any],
        known: Mapping[SignalKey, Any],
        *,
        at_random: bool = False,
    ) -> Any:
        symbol = self._symbols[number]
        kind = symbol.type
        if at_random:
            return self._any(least, most, kind, variables, known)
        last = known.get(self._key(number, {}) or ("", ()))
        if last is not None and least <= ordinal(last, kind) <= most:
            return last
        return readable(least, most, kind)

    def _any(
        self, least: int, most: int, kind: Type, variables: Mapping[str, Any], known: Mapping[SignalKey, Any]
    ) -> Any:
        """A value near those that are around, or anywhere."""
        if isinstance(kind, Boolean | Enumeration):
            return value_at(self._random.randint(least, most), kind)
        around = [0.0, *(one for one in (*variables.values(), *known.values()) if type(one) in (int, float))]
        value = self._random.choice(around) + self._random.choice((0, 0, 1, -1, 0.1, -0.1, 10, -10, 100, -100))
        at = ordinal(int(value) if isinstance(kind, Integer) else float(value), kind)
        if least <= at <= most:
            return value_at(at, kind)
        return readable(least, most, kind)

    def _key(self, number: int, assigned: Assigned) -> SignalKey | None:
        symbol = self._symbols[number]
        if symbol.what != "signal":
            return None
        assert isinstance(symbol.key, tuple), "a signal is known by its name and arguments"
        name, arguments = symbol.key
        try:
            return str(name), tuple(self._value(one, assigned) for one in arguments)
        except KeyError:
            return None

    def _value(self, value: Value, assigned: Assigned) -> Any:
        match value:
            case Exact(content):
                return content
            case Derived(symbol):
                inner = assigned[symbol] if symbol in assigned else self._computed(symbol, assigned)
                return value.apply(inner)
            case _:
                raise KeyError(value)

    def _computed(self, number: int, assigned: Assigned) -> Any:
        symbol = self._symbols[number]
        if symbol.what != "arithmetic" or not isinstance(symbol.key, tuple):
            raise KeyError(number)
        operator, *rest = symbol.key
        operands = rest[0] if len(rest) == 1 else rest
        values = [self._value(one, assigned) for one in operands]
        return UNARY[operator](*values) if len(values) == 1 else BINARY[operator](*values)


def readable(least: int, most: int, kind: Type) -> Any:
    """A value of an interval that is still in it after it was written to a scenario and read again."""
    value = within(least, most, kind)
    if isinstance(value, float) and least <= most < NOT_A_NUMBER:
        again = written(value, kind)
        if least <= ordinal(again, kind) <= most:
            return again
        for step in range(1, 17):
            near = written(float(f"{value:.{step}g}"), kind)
            if least <= ordinal(near, kind) <= most:
                return near
    return value


def _inner(key: object) -> Iterator[int]:
    """The symbols within the key of another."""
    match key:
        case Derived(symbol):
            yield symbol
        case tuple():
            for one in key:
                yield from _inner(one)
