"""Sets of values of several symbols at once, as decision diagrams: one node for each set, so that equal sets are one.

A symbol has values that are whole numbers (see ``ordinals``). A node tests whether a symbol is below a threshold and
leads to one of two diagrams. Symbols are tested in the order of their numbers, and each by rising thresholds. A symbol
that is below a threshold is not tested against greater ones, so the form of a diagram is unique.

Source: Strehl and Thiele, "Interval diagrams for efficient symbolic verification of process networks" (2000);
Bryant, "Graph-based algorithms for Boolean function manipulation" (1986).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

FALSE = 0
TRUE = 1

MOST_NODES = 250_000
"""Of the diagrams of one graph; those of the largest shipped machine have 40,000."""

_TERMINAL = 1 << 62
"""In place of the symbol of ``FALSE`` and ``TRUE``: after all others."""

Diagram = int
"""A set, by the number of its node, valid within one ``Diagrams``."""

Interval = tuple[int | None, int | None]
"""At least, and below; None where there is no such bound."""


class TooMany(Exception):  # noqa: N818 - how a proof ends early
    """More paths or sets than the limit; with coarser regions there may be fewer."""


class Diagrams:
    """Makes and combines diagrams; raises `TooMany` where their nodes are more than the limit."""

    def __init__(self) -> None:
        self._symbol = [_TERMINAL, _TERMINAL]
        self._bound = [0, 0]
        self._below = [0, 1]
        self._above = [0, 1]
        self._unique: dict[tuple[int, int, int, int], Diagram] = {}
        self._both: dict[tuple[Diagram, Diagram], Diagram] = {}
        self._left_out: dict[tuple[Diagram, frozenset[int]], Diagram] = {}
        self._complement: dict[Diagram, Diagram] = {FALSE: TRUE, TRUE: FALSE}

    def __len__(self) -> int:
        return len(self._symbol)

    def below(self, symbol: int, bound: int) -> Diagram:
        """Where a symbol is below a threshold."""
        return self._node(symbol, bound, TRUE, FALSE)

    def complement(self, one: Diagram) -> Diagram:
        """Everything else."""
        found = self._complement.get(one)
        if found is None:
            below, above = self.complement(self._below[one]), self.complement(self._above[one])
            found = self._node(self._symbol[one], self._bound[one], below, above)
            self._complement[one], self._complement[found] = found, one
        return found

    def both(self, one: Diagram, other: Diagram) -> Diagram:
        """What is in two sets."""
        if other in (one, TRUE):
            return one
        if one == TRUE:
            return other
        if FALSE in (one, other):
            return FALSE
        key = (one, other) if one < other else (other, one)
        found = self._both.get(key)
        if found is None:
            symbol, bound = min((self._symbol[one], self._bound[one]), (self._symbol[other], self._bound[other]))
            (first, second), (third, fourth) = (self._split(each, symbol, bound) for each in (one, other))
            found = self._both[key] = self._node(symbol, bound, self.both(first, third), self.both(second, fourth))
        return found

    def either(self, one: Diagram, other: Diagram) -> Diagram:
        """The union of two sets."""
        if other in (one, FALSE):
            return one
        if one == FALSE:
            return other
        return self.complement(self.both(self.complement(one), self.complement(other)))

    def without(self, one: Diagram, other: Diagram) -> Diagram:
        """The difference of two sets."""
        return self.both(one, self.complement(other))

    def without_symbols(self, one: Diagram, gone: frozenset[int]) -> Diagram:
        """The projection of a set without some symbols."""
        if one in (FALSE, TRUE):
            return one
        key = (one, gone)
        found = self._left_out.get(key)
        if found is None:
            below, above = (self.without_symbols(each, gone) for each in (self._below[one], self._above[one]))
            symbol = self._symbol[one]
            found = self.either(below, above) if symbol in gone else self._node(symbol, self._bound[one], below, above)
            self._left_out[key] = found
        return found

    def symbols(self, one: Diagram) -> frozenset[int]:
        """The symbols that a set depends on."""
        found: set[int] = set()
        seen = {FALSE, TRUE}
        pending = [one]
        while pending:
            node = pending.pop()
            if node not in seen:
                seen.add(node)
                found.add(self._symbol[node])
                pending += (self._below[node], self._above[node])
        return frozenset(found)

    def bounds(self, one: Diagram) -> frozenset[int]:
        """The thresholds of a set of values of one symbol."""
        found = set()
        pending = [one]
        while pending:
            node = pending.pop()
            if node not in (FALSE, TRUE):
                found.add(self._bound[node])
                pending += (self._below[node], self._above[node])
        return frozenset(found)

    def boxes(self, one: Diagram) -> Iterator[Mapping[int, Interval]]:
        """A partition of a set: for each part the interval of every relevant symbol."""
        pending: list[tuple[Diagram, dict[int, Interval]]] = [(one, {})]
        while pending:
            node, box = pending.pop()
            if node == TRUE:
                yield box
            elif node != FALSE:
                symbol, bound = self._symbol[node], self._bound[node]
                least, most = box.get(symbol, (None, None))
                pending.append((self._above[node], {**box, symbol: (bound, most)}))
                pending.append((self._below[node], {**box, symbol: (least, bound)}))

    def _split(self, one: Diagram, symbol: int, bound: int) -> tuple[Diagram, Diagram]:
        """What a set is below a threshold that comes no later than its own first one, and from there on."""
        if self._symbol[one] != symbol:
            return one, one
        return self._below[one], self._above[one] if self._bound[one] == bound else one

    def _node(self, symbol: int, bound: int, below: Diagram, above: Diagram) -> Diagram:
        if self._symbol[below] == symbol:
            below = self._below[below]
        if below == above:
            return below
        if self._symbol[above] == symbol and self._below[above] == below:
            return above
        key = (symbol, bound, below, above)
        found = self._unique.get(key)
        if found is None:
            if len(self._symbol) > MOST_NODES:
                raise TooMany(f"more than {MOST_NODES:,} distinctions of values")
            found = self._unique[key] = len(self._symbol)
            self._symbol.append(symbol)
            self._bound.append(bound)
            self._below.append(below)
            self._above.append(above)
        return found
