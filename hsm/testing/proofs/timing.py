"""The earliest times of the steps on a path that satisfy all bounds between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field

from hsm.model.values import dataclass

MARGIN = 10
"""In nanoseconds: the least distance of a time from a deadline that it must not meet."""


@dataclass(slots=True)
class Schedule:
    """Moments, with bounds on the times between them, in nanoseconds.

    Attributes:
        count: how many moments there are; the first one is at zero.
        bounds: ``(early, late, least)``: from one moment to another it is at least that long; negative for "at most".
    """

    count: int = 1
    bounds: list[tuple[int, int, int]] = field(default_factory=list)

    def moment(self) -> int:
        """One more moment."""
        self.count += 1
        return self.count - 1

    def at_least(self, early: int, late: int, least: int) -> None:
        """From one moment to another it is at least this long."""
        self.bounds.append((early, late, least))

    def at_most(self, early: int, late: int, most: int) -> None:
        """From one moment to another it is at most this long."""
        self.bounds.append((late, early, -most))

    def solved(self, grid: int) -> list[int] | None:
        """The earliest times that are multiples of ``grid``; None where there are none.

        Source: Bellman-Ford shortest paths, on a system of difference constraints.
        """
        bounds = [(early, late, -(-least // grid)) for early, late, least in self.bounds]
        times = [0] * self.count
        for _ in range(self.count + 1):
            changed = False
            for early, late, least in bounds:
                if times[early] + least > times[late]:
                    times[late], changed = times[early] + least, True
            if times[0] > 0:
                return None
            if not changed:
                return [time * grid for time in times]
        return None


def first_solved(schedules: Sequence[Schedule], grids: Sequence[int]) -> list[int] | None:
    """The times of the first schedule that has any, on the coarsest grid."""
    for schedule in schedules:
        for grid in grids:
            times = schedule.solved(grid)
            if times is not None:
                return times
    return None
