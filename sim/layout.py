"""The plan of a generated maze: which cells are joined, where doors are, where the robot starts and gets out."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import TypeVar

import numpy as np

from sim.formats.grid import SIDES, GridCell
from transport.arithmetic import distance_between

Passage = frozenset[GridCell]
"""The two cells that a passage joins."""
T = TypeVar("T")


class NoRoomError(Exception):
    """The recipe does not fit into the plan."""


class Layout:
    """Cells in rows and columns and the passages between them; it grows by the methods, in this order of calls.

    `add_islands`, `carve`, `choose_ends`, `add_doors`, then `add_rooms`, `add_loops` and `open_dead_ends` in any order.
    """

    def __init__(self, columns: int, rows: int, generator: np.random.Generator) -> None:
        self.columns, self.rows = columns, rows
        self.passages: set[Passage] = set()
        self.doors: list[tuple[GridCell, GridCell, GridCell]] = []
        """A dead end, the cell behind its door, and the step from either to the side where the open door goes."""
        self.start: GridCell = (0, 0)
        self.exit: tuple[GridCell, str] = ((0, 0), "south")
        self._solid: set[GridCell] = set()
        self._kept_cells: set[GridCell] = set()
        self._kept_walls: set[Passage] = set()
        self._generator = generator

    def cells(self) -> list[GridCell]:
        """All cells that are not solid, row by row."""
        every = [(column, row) for row in range(self.rows) for column in range(self.columns)]
        return [cell for cell in every if cell not in self._solid]

    def inside(self, cell: GridCell) -> bool:
        """Whether there is such a cell and it is not solid."""
        return self._within(cell) and cell not in self._solid

    def _within(self, cell: GridCell) -> bool:
        return 0 <= cell[0] < self.columns and 0 <= cell[1] < self.rows

    def beside(self, cell: GridCell) -> list[GridCell]:
        """The cells at the four sides of one, as far as there are."""
        return [other for step in SIDES.values() if self.inside(other := (cell[0] + step[0], cell[1] + step[1]))]

    def joined(self, cell: GridCell) -> list[GridCell]:
        """The cells that passages without doors lead to."""
        return [other for other in self.beside(cell) if frozenset((cell, other)) in self.passages]

    def open_sides(self, cell: GridCell) -> list[str]:
        """The sides of a cell with passages."""
        joined = self.joined(cell)
        return [side for side, step in SIDES.items() if (cell[0] + step[0], cell[1] + step[1]) in joined]

    def steps_from(self, cell: GridCell) -> dict[GridCell, int]:
        """How many passages lie between a cell and each that can be reached from it."""
        steps = {cell: 0}
        queue = deque([cell])
        while queue:
            here = queue.popleft()
            for other in self.joined(here):
                if other not in steps:
                    steps[other] = steps[here] + 1
                    queue.append(other)
        return steps

    def choice(self, of: Sequence[T], lack: str) -> T:
        """One of several, drawn at random.

        Raises:
            NoRoomError: there is none; the reason is that there is no ``lack``.
        """
        if not of:
            raise NoRoomError(f"there is no {lack}")
        return of[int(self._generator.integers(len(of)))]

    def add_islands(self, count: int) -> None:
        """Make cells solid, each with a ring of eight cells around it."""
        for _ in range(count):
            free = [
                (column, row)
                for row in range(1, self.rows - 1)
                for column in range(1, self.columns - 1)
                if all(max(abs(column - x), abs(row - y)) >= 3 for x, y in self._solid)
            ]
            self._solid.add(self.choice(free, "room for an island"))

    def carve(self) -> None:
        """Join all cells by a random tree, grown in depth first; rings about islands are closed ways."""
        rings = {cell: ring for solid in sorted(self._solid) for ring in [_ring(solid)] for cell in ring}
        stack = [self.choice(self.cells(), "cell")]
        seen = set(stack)
        while stack:
            here = stack[-1]
            if here in rings:
                ring = rings[here]
                self.passages |= {frozenset(pair) for pair in zip(ring, [*ring[1:], ring[0]], strict=True)}
                stack += [cell for cell in ring if cell not in seen]
                seen.update(ring)
                for cell in ring:
                    del rings[cell]
                continue
            ahead = [other for other in self.beside(here) if other not in seen]
            if not ahead:
                stack.pop()
                continue
            other = self.choice(ahead, "cell")
            self.passages.add(frozenset((here, other)))
            seen.add(other)
            stack.append(other)

    def choose_ends(self) -> None:
        """Choose the start and, among the boundary cells far from it, the exit."""
        self.start = self.choice(self.cells(), "cell")
        steps = self.steps_from(self.start)
        boundary = []
        for cell in self.cells():
            outer = [side for side, step in SIDES.items() if not self._within(_plus(cell, step))]
            # A corner has two outer sides, and cell formats cannot show which of them is open.
            if len(outer) == 1 and cell != self.start:
                boundary.append((steps[cell], cell, outer[0]))
        far = sorted(boundary, reverse=True)[: max(len(boundary) // 4, 1)]
        _, cell, side = self.choice(far, "cell for the exit")
        self.exit = cell, side

    def add_doors(self, count: int, apart: float) -> None:
        """Close bridges of the way out by doors, each at the end of a dead end with a wall beside it to slide along.

        Args:
            count: how many.
            apart: smallest distance from the start to a door, in cells.
        """
        for _ in range(count):
            chosen = self.choice(self._door_places(apart), "dead end for a door on the way out")
            dead_end, behind, side = chosen
            self.doors.append(chosen)
            self.passages.remove(frozenset((dead_end, behind)))
            self._kept_cells.add(dead_end)
            self._kept_walls.add(frozenset((_plus(dead_end, side), _plus(behind, side))))

    def _door_places(self, apart: float) -> list[tuple[GridCell, GridCell, GridCell]]:
        used = {cell for door in self.doors for cell in door[:2]}
        # A leaf needs a wall to slide along: neither a way nor another door, which it would shut permanently.
        open_sides = self.passages.union(frozenset(door[:2]) for door in self.doors)
        places: list[tuple[GridCell, GridCell, GridCell]] = []
        for dead_end in self.steps_from(self.start):
            if dead_end in used or dead_end in (self.start, self.exit[0]):
                continue
            ways = self.joined(dead_end)
            # In line, so that the door ends the way and has the walls of the way at both of its sides.
            if len(ways) != 2 or (ways[0][0] != ways[1][0] and ways[0][1] != ways[1][1]):
                continue
            for behind in ways:
                if behind in used:
                    continue
                middle = ((dead_end[0] + behind[0]) / 2, (dead_end[1] + behind[1]) / 2)
                if distance_between(middle, self.start) < apart or not self._parts(dead_end, behind):
                    continue
                along = (behind[1] - dead_end[1], behind[0] - dead_end[0])
                for side in (along, (-along[0], -along[1])):
                    if frozenset((_plus(dead_end, side), _plus(behind, side))) not in open_sides:
                        places.append((dead_end, behind, side))
        return places

    def _parts(self, dead_end: GridCell, behind: GridCell) -> bool:
        """Whether a door between the two would part the start, on the dead end's side, from the exit."""
        passage = frozenset((dead_end, behind))
        doors = [frozenset(door[:2]) for door in self.doors]
        self.passages.remove(passage)
        self.passages.update(doors)
        reached = self.steps_from(self.start)
        self.passages.difference_update(doors)
        self.passages.add(passage)
        return self.exit[0] not in reached and dead_end in reached

    def _compartments(self) -> dict[GridCell, int]:
        number: dict[GridCell, int] = {}
        for cell in self.cells():
            if cell not in number:
                number.update(dict.fromkeys(self.steps_from(cell), len(number)))
        return number

    def _removable(self) -> list[Passage]:
        """Walls that may go: between cells of one compartment, and no door depends on them."""
        compartment = self._compartments()
        return [
            passage
            for cell in self.cells()
            for other in self.beside(cell)
            if cell < other and compartment[cell] == compartment[other]
            for passage in [frozenset((cell, other))]
            if passage not in self.passages and passage not in self._kept_walls and not passage & self._kept_cells
        ]

    def add_rooms(self, count: int) -> None:
        """Remove the walls inside blocks of 2x2 to 3x3 cells that do not overlap."""
        taken: set[GridCell] = set()
        for _ in range(count):
            removable = set(self._removable()) | self.passages
            rooms = []
            for width, height in ((2, 2), (3, 2), (2, 3), (3, 3)):
                for column in range(self.columns - width + 1):
                    for row in range(self.rows - height + 1):
                        room = [(column + i, row + j) for i in range(width) for j in range(height)]
                        inner = {
                            frozenset((cell, other)) for cell in room for other in self.beside(cell) if other in room
                        }
                        if not taken & set(room) and all(map(self.inside, room)) and inner <= removable:
                            rooms.append((room, inner))
            room, inner = self.choice(rooms, "room for an open space")
            taken |= set(room)
            self.passages |= inner

    def add_loops(self, count: int) -> None:
        """Take single walls out."""
        for _ in range(count):
            self.passages.add(self.choice(self._removable(), "wall to leave out for a loop"))

    def open_dead_ends(self, share_kept: float) -> None:
        """Give some of the dead ends a second way, as far as there is one."""
        for cell in self.cells():
            if len(self.joined(cell)) == 1 and self._generator.random() >= share_kept:
                walls = [wall for wall in self._removable() if cell in wall]
                if walls:
                    self.passages.add(self.choice(walls, "wall"))


def _plus(cell: GridCell, step: GridCell) -> GridCell:
    return cell[0] + step[0], cell[1] + step[1]


def _ring(cell: GridCell) -> list[GridCell]:
    around = ((-1, -1), (0, -1), (1, -1), (1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0))
    return [_plus(cell, step) for step in around]
