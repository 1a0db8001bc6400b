"""The abstraction of variables between steps: exact values while they are few, otherwise regions.

A region of a variable is an interval between the thresholds that it is compared with anywhere. Whole numbers around the
thresholds, and the first floats that occur, are kept exactly. The abstraction only adds runs, so a proof for it is a
proof for the machine.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Collection, Iterable, Iterator, Sequence
from typing import Any

from hsm.model.expressions import Binary, Expression, VariableValue
from hsm.model.rewriting import parts_of
from hsm.model.types import Boolean, Enumeration, Integer, Type
from hsm.model.values import dataclass
from hsm.testing.proofs.conditions import COMPARISONS, Evaluator
from hsm.testing.proofs.diagrams import FALSE, TRUE, Diagram
from hsm.testing.proofs.ordinals import held, ordinal, value_at
from hsm.testing.proofs.values import DEAD, NOTHING, Derived, Exact, OneOf, Region, Symbols, Truth, Undecided, Value

MARGIN = 1
"""The distance from the outermost thresholds within which whole numbers are kept exactly."""

MOST_OPERATIONS = 3
"""At most this many operations on a symbol are tracked within one step."""

MOST_CHOICES = 2
"""At most this many conditions determine a variable within one step; beyond that it becomes a region."""

MOST_THRESHOLDS = 40
"""At most this many thresholds of one variable are distinguished."""

_FALSE, _TRUE = map(Exact.of, (False, True))

Kept = Exact | Region


@dataclass(frozen=True, slots=True)
class Precision:
    """How many exact values are kept.

    Attributes:
        whole: between the outermost thresholds of a variable, that many whole numbers at most.
        floats: that many floats of one variable.
        counted: that many whole numbers of one variable beyond its thresholds.
    """

    whole: int
    floats: int
    counted: int


FINE, MIDDLE, COARSE = Precision(80, 40, 30), Precision(12, 12, 0), Precision(0, 1, 0)


class Regions:
    """The regions of all variables of a machine.

    Args:
        symbols: represent variables in regions.
        types: of the variables and parameters, by slot.
        names: theirs.
        relevant: names of the variables that matter; the others are dropped.
        changing: names of those that are ever assigned.
        precision: how many exact values are kept.
    """

    def __init__(
        self,
        symbols: Symbols,
        types: Sequence[Type],
        names: Sequence[str],
        *,
        relevant: Collection[str],
        changing: Collection[str],
        precision: Precision,
    ) -> None:
        self._symbols = symbols
        self._types = types
        self._slots = {
            symbols.number("variable", name, kind): at for at, (name, kind) in enumerate(zip(names, types, strict=True))
        }
        self._numbers = {slot: number for number, slot in self._slots.items()}
        self._thresholds: list[set[int]] = [set() for _ in types]
        self._seen: list[set[int]] = [set() for _ in types]
        self._cuts: list[list[int] | None] = [None for _ in types]
        self._precision = precision
        self._relevant = [name in relevant for name in names]
        self._changing = [name in changing for name in names]
        self._growing: dict[tuple[Value, ...], list[int]] = {}
        self._closed: dict[tuple[Value, ...], list[list[tuple[Kept, Diagram]]]] = {}

    def compared(self, left: Derived, right: Exact) -> None:
        """Record a threshold where a variable is compared with a known value."""
        slot = self._slots.get(left.symbol)
        if slot is None or len(self._thresholds[slot]) >= MOST_THRESHOLDS:
            return
        for operator in ("<", "<="):
            truth = self._symbols.compared(operator, left, right)
            new = self._symbols.diagrams.bounds(truth.true) - self._thresholds[slot]
            if new:
                self._thresholds[slot] |= new
                self._cuts[slot] = None

    def look_ahead(
        self,
        evaluator: Evaluator,
        expressions: Sequence[Expression],
        constants: Iterable[tuple[str, Any]],
        known: Sequence[Value],
    ) -> None:
        """Record all thresholds of variables in some expressions.

        Args:
            evaluator: evaluates expressions.
            expressions: all in which variables may be compared.
            constants: that are assigned, each with the variable's name.
            known: the values of parameters.
        """
        comparisons = [
            part
            for one in expressions
            for part in parts_of(one)
            if isinstance(part, Binary) and part.operator in COMPARISONS and not isinstance(part.left.type, Boolean)
        ]
        for name, given in constants:
            if isinstance(self._types[evaluator.slots[name]], Integer) and isinstance(given, int):
                self._thresholds[evaluator.slots[name]].update((given, given + 1))
        for part in comparisons:
            for name in {one.name for one in parts_of(part) if isinstance(one, VariableValue)}:
                slot = evaluator.slots[name]
                if slot not in self._numbers:
                    continue  # what an event carries
                values = [*known, *(NOTHING for _ in range(len(evaluator.slots) - len(known)))]
                values[slot] = Derived(self._numbers[slot])
                try:
                    evaluator.at(values, frozenset()).value(part)
                except (Undecided, TypeError):
                    continue

    def opened(self, kept: Sequence[Kept]) -> tuple[tuple[Value, ...], Diagram]:
        """The values at the beginning of a step, and where the symbols in them are."""
        values: list[Value] = []
        among = TRUE
        for slot, one in enumerate(kept):
            if isinstance(one, Exact):
                values.append(one)
            else:
                number = self._numbers[slot]
                values.append(Derived(number))
                among = self._symbols.diagrams.both(among, self._symbols.between(number, one.least, one.most))
        return tuple(values), among

    def closed(self, values: tuple[Value, ...], among: Diagram) -> Iterator[tuple[tuple[Kept, ...], Diagram]]:
        """The abstract values at the end of a step: each combination of regions, with the signals that lead to it."""
        both = self._symbols.diagrams.both
        ways: list[tuple[tuple[Kept, ...], Diagram]] = [((), among)]
        known = self._closed.get(values)
        if known is None:
            known = self._closed[values] = [self._options(slot, value) for slot, value in enumerate(values)]
        for options in known:
            ways = [
                ((*kept, one), further)
                for kept, condition in ways
                for one, added in options
                if (further := both(condition, added)) != FALSE
            ]
        return iter(ways)

    def settled(
        self, values: tuple[Value, ...], among: Diagram, others: tuple[Value, ...]
    ) -> list[tuple[tuple[Value, ...], Diagram]]:
        """Values within a step, with those that would grow without bound replaced by symbols for their regions.

        Args:
            values: the variables, perhaps followed by the data of an event.
            among: the signals.
            others: what else is in use.
        """
        growing = self._growing.get(values)
        if growing is None:
            growing = [slot for slot, value in enumerate(values[: len(self._types)]) if self._grows(slot, value)]
            self._growing[values] = growing
        if not growing:
            return [(values, among)]
        both, diagrams = self._symbols.diagrams.both, self._symbols.diagrams
        ways: list[tuple[list[Value], Diagram]] = [(list(values), among)]
        for slot in growing:
            parted: list[tuple[list[Value], Diagram]] = []
            for chosen, condition in ways:
                number = self._spare(slot, (*chosen, *others))
                for kept, added in self._options(slot, values[slot]):
                    further = both(condition, added)
                    stale = frozenset(one for one in diagrams.symbols(further) if number in self._symbols.within(one))
                    further = diagrams.without_symbols(further, stale)
                    if isinstance(kept, Region):
                        further = both(further, self._symbols.between(number, kept.least, kept.most))
                    if further != FALSE:
                        value: Value = kept if isinstance(kept, Exact) else Derived(number)
                        parted.append(([*chosen[:slot], value, *chosen[slot + 1 :]], further))
            ways = parted
        return [(tuple(chosen), condition) for chosen, condition in ways]

    def _grows(self, slot: int, value: Value) -> bool:
        match value:
            case Derived(symbol, steps):
                return len(steps) + self._symbols.nested(symbol) > MOST_OPERATIONS
            case OneOf(_, then, otherwise):
                return value.depth > MOST_CHOICES or self._grows(slot, then) or self._grows(slot, otherwise)
        return isinstance(value, Exact) and not isinstance(self._options(slot, value)[0][0], Exact)

    def _spare(self, slot: int, values: Sequence[Value]) -> int:
        """The number of a symbol for a variable that none of the values depends on."""
        used = self._symbols.used(values)
        name = self._symbols[self._numbers[slot]].key
        spares = (
            self._symbols.number("variable", (name, count), self._types[slot]) for count in range(len(values) + 1)
        )
        return next(one for one in spares if one not in used)

    def _options(self, slot: int, value: Value) -> list[tuple[Kept, Diagram]]:
        kind = self._types[slot]
        if value in (DEAD, NOTHING):
            return [(value, TRUE)]
        if not self._relevant[slot]:
            return [(self._single(Region(*held(kind)), kind), TRUE)]
        match value:
            case Exact(content):
                return [(self._kept(slot, content), TRUE)]
            case Truth(true, false):
                return [(_TRUE, true), (_FALSE, false)]
            case OneOf(condition, then, otherwise):
                both = self._symbols.diagrams.both
                ways = ((condition.true, then), (condition.false, otherwise))
                return [
                    (kept, further)
                    for holds, one in ways
                    for kept, among in self._options(slot, one)
                    if (further := both(holds, among)) != FALSE
                ]
            case Derived():
                if isinstance(kind, Boolean):
                    truth = self._symbols.truth_of(value)
                    return [(_TRUE, truth.true), (_FALSE, truth.false)]
                if isinstance(kind, Enumeration):
                    members = [Exact.of(one) for one in kind.members]
                    return [(one, self._symbols.compared("==", value, one).true) for one in members]
                return [
                    (self._single(Region(least, most), kind), self._inside(value, least, most, kind))
                    for least, most in self._cells(slot)
                ]

    def _single(self, region: Region, kind: Type) -> Kept:
        plain = isinstance(kind, Boolean | Enumeration)  # one of them represents all if nothing depends on it
        return Exact.of(value_at(region.least, kind)) if plain or region.least == region.most else region

    def _inside(self, value: Derived, least: int, most: int, kind: Type) -> Diagram:
        """Where a derived value is between two ordinals of a variable's type."""
        compared, diagrams = self._symbols.compared, self._symbols.diagrams
        first, last = held(kind)
        found = TRUE
        if least > first:
            found = diagrams.both(found, compared(">=", value, Exact.of(value_at(least, kind))).true)
        if most < last:
            found = diagrams.both(found, compared("<=", value, Exact.of(value_at(most, kind))).true)
        return found

    def _kept(self, slot: int, content: Any) -> Kept:
        kind = self._types[slot]
        if content is None or isinstance(kind, Boolean | Enumeration) or not self._changing[slot]:
            return Exact.of(content)
        number = ordinal(content, kind)
        if isinstance(kind, Integer):
            cuts = self._limits(slot)
            at = bisect_right(cuts, number)
            if 0 < at < len(cuts) and cuts[at] == cuts[at - 1] + 1:
                return Exact.of(content)
        seen = self._seen[slot]
        most = self._precision.counted if isinstance(kind, Integer) else self._precision.floats
        if number in seen or len(seen) < most:
            seen.add(number)
            return Exact.of(content)
        return self._single(next(Region(*one) for one in self._cells(slot) if one[0] <= number <= one[1]), kind)

    def _cells(self, slot: int) -> Iterator[tuple[int, int]]:
        first, last = held(self._types[slot])
        least = first
        for cut in self._limits(slot):
            if least < cut <= last:
                yield least, cut - 1
                least = cut
        yield least, last

    def _limits(self, slot: int) -> list[int]:
        """Where the regions of a variable begin, except for the first."""
        found = self._cuts[slot]
        if found is None:
            cuts = set(self._thresholds[slot])
            if isinstance(self._types[slot], Integer):
                low, high = min(cuts, default=0) - MARGIN, max(cuts, default=0) + MARGIN
                if high - low <= self._precision.whole:
                    cuts.update(range(low, high + 1))
                elif self._precision.whole:
                    cuts.update(one + step for one in tuple(cuts) for step in range(-MARGIN, MARGIN + 1))
            found = self._cuts[slot] = sorted(cuts)
        return found
