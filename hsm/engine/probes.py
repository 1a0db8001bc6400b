"""Where the generated code marks which paths through guards were seen: one list a run, with a place for each path."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from hsm.engine.decisions import Decision

FEW_PATHS = 16
"""Up to so many paths, each has a place of its own; a guard with more has one place with a set of its paths."""


class Probes:
    """The places of all guards of a machine."""

    def __init__(self, decisions: Sequence[Decision]) -> None:
        self._decisions = decisions
        self._first: list[int] = []
        size = 0
        for decision in decisions:
            self._first.append(size)
            size += self._width(decision)
        self._size = size

    def new(self) -> list[Any]:
        """The list of a new run, without marks."""
        hits: list[Any] = [0] * self._size
        for index, decision in enumerate(self._decisions):
            if decision.conditions and not self.single(index):
                hits[self._first[index]] = set()
        return hits

    def single(self, transition: int) -> bool:
        """Whether each path of a guard has a place of its own."""
        return self._decisions[transition].count <= FEW_PATHS

    def first(self, transition: int) -> int:
        """The first place of a guard."""
        return self._first[transition]

    def place(self, transition: int, path: int) -> int:
        """The place of a path."""
        return self._first[transition] + self._decisions[transition].paths.index(path)

    def mark(self, hits: list[Any], transition: int, path: int) -> None:
        """Mark a path as seen, as the generated code does."""
        if not self._decisions[transition].conditions:
            return
        if self.single(transition):
            hits[self.place(transition, path)] = 1
        else:
            hits[self._first[transition]].add(path)

    def seen(self, hits: Sequence[Any]) -> Iterator[tuple[int, frozenset[int]]]:
        """The paths that were seen, for each guard of which any was."""
        for index, decision in enumerate(self._decisions):
            first = self._first[index]
            if not decision.conditions:
                continue
            if self.single(index):
                found = frozenset(path for at, path in enumerate(decision.paths, first) if hits[at])
            else:
                found = frozenset(hits[first])
            if found:
                yield index, found

    def _width(self, decision: Decision) -> int:
        if not decision.conditions:
            return 0
        return decision.count if decision.count <= FEW_PATHS else 1
