"""Sets of clock values: all bounds on clocks and on their differences, as difference bound matrices.

Times are whole nanoseconds. A bound is one number: twice the value, and one more where the value itself is included; so
bounds are compared as numbers.

Source: Dill, "Timing assumptions and verification of finite-state concurrent systems" (1989); Bengtsson and Yi, "Timed
automata: semantics, algorithms and tools" (2004).
"""

from __future__ import annotations

from operator import ge

from hsm.model.values import dataclass

Clock = int
"""The state whose entry a clock counts from, ``PROMISE``, or that of one time-out alone (``own_clock``)."""

PROMISE = -1
"""The clock of a property."""

ROUNDING = 1_200
"""In nanoseconds: within this distance of a deadline, both sides are possible.

The engine takes a deadline as reached up to two spacings of floats early (``hsm.engine.clock``), and the deadline of a
property is rounded to one: with stamps below 2^32 seconds, which are 477 ns apart, that comes to 1,193 ns.
"""

_FREE = 1 << 80
"""No bound."""

_AT_MOST_ZERO = 1


def own_clock(transition: int) -> Clock:
    """The clock of one time-out alone, or of one event on its way."""
    return -3 - 2 * transition if transition >= 0 else -4 + 2 * (transition + 1)


def at_most(value: int) -> int:
    """The bound that includes a value."""
    return 2 * value + 1


def less(value: int) -> int:
    """The bound that does not."""
    return 2 * value


def _sum(one: int, other: int) -> int:
    if one >= _FREE or other >= _FREE:
        return _FREE
    return (one & ~1) + (other & ~1) + (one & other & 1)


@dataclass(frozen=True, slots=True)
class Zone:
    """A set of values of some clocks, never empty.

    Attributes:
        clocks: which, sorted.
        bounds: for each pair of clocks, zero being the first of them, the bound on their difference, row by row.
    """

    clocks: tuple[Clock, ...]
    bounds: tuple[int, ...]

    @staticmethod
    def origin(clocks: tuple[Clock, ...]) -> Zone:
        """All clocks at zero."""
        size = len(clocks) + 1
        return Zone(clocks, (_AT_MOST_ZERO,) * (size * size))

    def includes(self, other: Zone) -> bool:
        """Whether another set of the same clocks lies in this one."""
        return all(map(ge, self.bounds, other.bounds))

    def later(self) -> Zone:
        """After any time."""
        size = len(self.clocks) + 1
        return Zone(
            self.clocks,
            tuple(_FREE if at and at % size == 0 else bound for at, bound in enumerate(self.bounds)),
        )

    def later_by(self, most: int) -> Zone:
        """After some time, at most this many nanoseconds."""
        size = len(self.clocks) + 1
        bounds = list(self.bounds)
        for row in range(size, size * size, size):
            if bounds[row] < _FREE:
                bounds[row] += 2 * most
        return Zone(self.clocks, tuple(bounds))

    def limited(self, clock: Clock, least: int | None, most: int | None) -> Zone | None:
        """Where a clock is at least this much (as a bound on its negative), and at most; None where it never is."""
        at = self.clocks.index(clock) + 1
        found: Zone | None = self
        if most is not None:
            found = found._tightened(at, 0, most) if found is not None else None
        if least is not None and found is not None:
            found = found._tightened(0, at, least)
        return found

    def reset(self, clocks: frozenset[Clock] | set[Clock], kept: tuple[Clock, ...]) -> Zone:
        """Some clocks set to zero, and only some kept; those that were not there are new."""
        if not clocks and kept == self.clocks:
            return self
        size = len(self.clocks) + 1
        places = {clock: at for at, clock in enumerate(self.clocks, start=1) if clock not in clocks}
        # A clock at zero is bounded as zero itself, the first row and column, and so are two of them.
        rows = [0, *(places.get(clock, 0) for clock in kept)]
        bounds = self.bounds
        return Zone(kept, tuple([bounds[row * size + column] for row in rows for column in rows]))

    def back(self, clock: Clock, by: int) -> Zone:
        """One clock put back by a number of nanoseconds."""
        size, at = len(self.clocks) + 1, self.clocks.index(clock) + 1
        bounds = list(self.bounds)
        for other in range(size):
            if other != at:
                if bounds[at * size + other] < _FREE:
                    bounds[at * size + other] -= 2 * by
                if bounds[other * size + at] < _FREE:
                    bounds[other * size + at] += 2 * by
        return Zone(self.clocks, tuple(bounds))

    def anywhere(self, clock: Clock, least: int, below: int) -> Zone:
        """One clock set to any time from a number of nanoseconds on and below another; the first is not above zero."""
        zone = self.only(tuple(one for one in self.clocks if one != clock))._with(clock)
        size = len(zone.clocks) + 1
        at, bounds = size - 1, list(zone.bounds)
        for other in range(size - 1):
            bounds[at * size + other] = _sum(less(below), bounds[other])
            bounds[other * size + at] = _sum(at_most(-least), bounds[other * size])
        return Zone(zone.clocks, tuple(bounds)).only(tuple(sorted(zone.clocks)))

    def only(self, clocks: tuple[Clock, ...]) -> Zone:
        """Without all clocks but these, in this order."""
        if clocks == self.clocks:
            return self
        size = len(self.clocks) + 1
        rows = [0, *(self.clocks.index(one) + 1 for one in clocks)]
        bounds = self.bounds
        return Zone(clocks, tuple([bounds[row * size + column] for row in rows for column in rows]))

    def _with(self, clock: Clock) -> Zone:
        """With one more clock, at zero."""
        size = len(self.clocks) + 1
        rows = [list(self.bounds[row * size : (row + 1) * size]) for row in range(size)]
        for row in rows:
            row.append(row[0])
        rows.append([*rows[0][:size], _AT_MOST_ZERO])
        return Zone((*self.clocks, clock), tuple(bound for row in rows for bound in row))

    def _tightened(self, row: int, column: int, bound: int) -> Zone | None:
        size = len(self.clocks) + 1
        bounds = self.bounds
        if bounds[row * size + column] <= bound:
            return self
        if _sum(bound, bounds[column * size + row]) < _AT_MOST_ZERO:
            return None
        found = list(bounds)
        found[row * size + column] = bound
        for first in range(size):
            to_row = bounds[first * size + row]
            if to_row >= _FREE:
                continue
            begun = _sum(to_row, bound)
            for second in range(size):
                way = _sum(begun, bounds[column * size + second])
                found[first * size + second] = min(found[first * size + second], way)
        return Zone(self.clocks, tuple(found))
