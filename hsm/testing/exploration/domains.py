"""Which values of a signal can make a difference: false and true, all members, both sides of each threshold."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from itertools import pairwise
from typing import Any

from hsm.model.expressions import Binary, EventValue, Expression, SignalValue, VariableValue
from hsm.model.registry import EventField, SignalDeclaration
from hsm.model.rewriting import parts_of
from hsm.model.types import UNITS, Boolean, Enumeration, Integer, Type, si_value
from hsm.model.unparse import value_text
from hsm.testing.scenarios.script import default_of, member_of

_BINARY: dict[str, Callable[[float, float], bool]] = {
    "<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge, "==": operator.eq, "!=": operator.ne,
}  # fmt: skip
NEAR = 0.05
"""The distance from a threshold of the values tried beside it, as a share of the threshold."""

_SAMPLES = (0.0, *(sign * 10.0**power for power in range(-3, 4) for sign in (-1.0, 1.0)))

Residue = Callable[[Binary, float], float | None]
"""Left side minus right side of a comparison for a value of a signal; None if another value is still unknown."""


class Domains:
    """The values worth trying for each signal of a machine.

    Args:
        expressions: all conditions that may depend on a signal.
    """

    def __init__(self, expressions: Iterable[Expression]) -> None:
        self._comparisons: dict[str, dict[Binary, None]] = {}
        self._depends: dict[str, tuple[frozenset[str], frozenset[str]]] = {}
        for expression in expressions:
            for part in parts_of(expression):
                if isinstance(part, Binary) and part.operator in _BINARY:
                    for name in dict.fromkeys(_free(part)):
                        self._comparisons.setdefault(name, {})[part] = None

    def depends(self, signal: SignalDeclaration) -> tuple[frozenset[str], frozenset[str]]:
        """The names of variables and other signals that influence the values worth trying."""
        found = self._depends.get(signal.name)
        if found is None:
            parts = [part for one in self._comparisons.get(signal.name, ()) for part in parts_of(one)]
            variables = frozenset(one.name for one in parts if isinstance(one, VariableValue))
            signals = frozenset(one.signal.name for one in parts if isinstance(one, SignalValue))
            found = self._depends[signal.name] = (variables, signals)
        return found

    def values(self, signal: SignalDeclaration, residue: Residue) -> list[Any]:
        """The values to try for a signal, the simplest first.

        Args:
            signal: the signal.
            residue: evaluates a comparison for a value of the signal, everything else unchanged.
        """
        if isinstance(signal.type, Enumeration):
            return [member_of(signal, one) for one in signal.type.members]
        return self.of_type(signal.name, signal.type, residue) or [default_of(signal)]

    def carried(self, name: str, field: EventField, residue: Residue) -> list[Any]:
        """The values to try for a field of an event, the simplest first.

        Args:
            name: how expressions name it.
            field: its type.
            residue: evaluates a comparison for a value of it, everything else unchanged.
        """
        if isinstance(field.type, Enumeration):
            return [one if field.enumeration is None else field.enumeration(one) for one in field.type.members]
        return self.of_type(name, field.type, residue) or [0 if isinstance(field.type, Integer) else 0.0]

    def of_type(self, name: str, kind: Type, residue: Residue) -> list[Any]:
        """Both values of a condition, numbers on both sides of each threshold; none where there is no threshold."""
        if isinstance(kind, Boolean):
            return [False, True]
        found = self._comparisons.get(name, {})
        roots = sorted({root for one in found for root in _roots(partial(residue, one))})
        tried: list[Any] = [written(one, kind) for one in _around(roots)]
        if isinstance(kind, Integer):
            around = {math.floor(root) + step for root in roots for step in (-1, 0, 1)}
            tried = sorted(around, key=lambda one: (abs(one), one))
        distinct: dict[tuple[bool | None, ...], Any] = {}
        for one in tried:
            distinct.setdefault(tuple(_truth(comparison, residue(comparison, one)) for comparison in found), one)
        return list(distinct.values())


def _free(comparison: Binary) -> Iterator[str]:
    """The free parts of a comparison: signals, and the data of events."""
    for one in parts_of(comparison):
        match one:
            case SignalValue(signal):
                yield signal.name
            case EventValue(name):
                yield name


def written(value: float, kind: Type) -> float:
    """The value after it was written to a scenario and read again."""
    number, _, unit = value_text(value, kind).partition(" ")
    return si_value(number, UNITS.get(unit))


def _truth(comparison: Binary, residue: float | None) -> bool | None:
    if residue is None:
        return None
    compared: bool = _BINARY[comparison.operator](residue, 0.0)
    return compared


def _around(roots: list[float]) -> list[float]:
    """The thresholds themselves, and something close to each on both sides."""
    margins = [NEAR * abs(root) or 0.5 for root in roots]
    if len(roots) > 1:
        gap = min(high - low for low, high in pairwise(roots))
        margins = [min(margin, gap / 2) for margin in margins]
    sides = [side for root, margin in zip(roots, margins, strict=True) for side in (root - margin, root + margin)]
    return [*roots, *sides]


def _roots(residue: Callable[[float], float | None]) -> list[float]:
    """Where a residue changes its sign: computed if it is linear, searched otherwise."""
    first, second, third = residue(0.0), residue(1.0), residue(2.0)
    if first is None or second is None or third is None:
        return []
    slope = second - first
    if math.isclose(third - second, slope, rel_tol=1e-9, abs_tol=1e-12) and _same(residue(-1.0), first - slope):
        return [_tidy(-first / slope, residue)] if slope else []
    samples = sorted(_SAMPLES)
    values = [residue(one) for one in samples]
    found = []
    for index, (left, right) in enumerate(pairwise(values)):
        if left is not None and right is not None and (left < 0) != (right < 0):
            found.append(_tidy(_bisect(residue, samples[index], samples[index + 1]), residue))
    return found


def _same(one: float | None, other: float) -> bool:
    return one is not None and math.isclose(one, other, rel_tol=1e-9, abs_tol=1e-9)


def _bisect(residue: Callable[[float], float | None], low: float, high: float) -> float:
    negative = (residue(low) or 0.0) < 0
    for _ in range(80):
        middle = (low + high) / 2
        if ((residue(middle) or 0.0) < 0) == negative:
            low = middle
        else:
            high = middle
    return high


def _tidy(root: float, residue: Callable[[float], float | None]) -> float:
    """The root rounded to the fewest digits that are still exact; unchanged if none are."""
    for digits in (1, 2, 3, 4, 6, 9, 12):
        rounded = float(f"{root:.{digits}g}")
        if residue(rounded) == 0:
            return rounded
    return root
