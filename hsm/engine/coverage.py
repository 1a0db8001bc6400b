"""What a run has exercised of its machine: the engine collects it at every step, runs are merged, reports read it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import field
from typing import Any, TypeVar

from hsm.engine.configuration import Leaf, Plan
from hsm.model.values import dataclass

FORGOTTEN_AFTER = 4096
"""After this many different microsteps, what they have exercised is added up."""

Guards = Mapping[int, frozenset[int]]


def _no_counts() -> Mapping[Any, int]:
    return {}


@dataclass(frozen=True, slots=True)
class Coverage:
    """Counts by the indices of a model; an item that was never exercised has no entry.

    Attributes:
        states: how often each state was entered.
        transitions: how often each transition was taken; for one with a time-out, how often that time-out acted.
        guards: for each transition, the paths through its guard that were seen (``hsm.engine.decisions``); the
            outcomes of the guard and of each condition, and MC/DC, follow from them.
        outcomes: how often the activity of a state ended with an outcome, by state and outcome.
        history: how often a history state was entered, by state and whether it remembered something.
    """

    states: Mapping[int, int] = field(default_factory=_no_counts)
    transitions: Mapping[int, int] = field(default_factory=_no_counts)
    guards: Guards = field(default_factory=dict)
    outcomes: Mapping[tuple[int, str], int] = field(default_factory=_no_counts)
    history: Mapping[tuple[int, bool], int] = field(default_factory=_no_counts)

    def merge(self, other: Coverage) -> Coverage:
        """What both have exercised together, of the same model."""
        guards = {
            index: self.guards.get(index, frozenset()) | other.guards.get(index, frozenset())
            for index in sorted(self.guards.keys() | other.guards.keys())
        }
        return Coverage(
            states=_sum(self.states, other.states),
            transitions=_sum(self.transitions, other.transitions),
            guards=guards,
            outcomes=_sum(self.outcomes, other.outcomes),
            history=_sum(self.history, other.history),
        )

    def to_json(self) -> dict[str, Any]:
        """The same as JSON values."""
        return {
            "states": [[state, count] for state, count in sorted(self.states.items())],
            "transitions": [[index, count] for index, count in sorted(self.transitions.items())],
            "guards": [[index, sorted(paths)] for index, paths in sorted(self.guards.items())],
            "outcomes": [[state, name, count] for (state, name), count in sorted(self.outcomes.items())],
            "history": [[state, known, count] for (state, known), count in sorted(self.history.items())],
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Coverage:
        """What ``to_json`` wrote."""
        return cls(
            states=dict(data["states"]),
            transitions=dict(data["transitions"]),
            guards={index: frozenset(paths) for index, paths in data["guards"]},
            outcomes={(state, name): count for state, name, count in data["outcomes"]},
            history={(state, known): count for state, known, count in data["history"]},
        )


_K = TypeVar("_K")


def _sum(one: Mapping[_K, int], other: Mapping[_K, int]) -> dict[_K, int]:
    return {key: one.get(key, 0) + other.get(key, 0) for key in sorted(one.keys() | other.keys())}  # type: ignore[type-var]


class Collector:
    """Collects what one run exercises, at almost no cost per step, with memory only for exercised items.

    Attributes:
        hits: the paths through guards that steps in full have seen, with their transitions.
        leaves: how often a step that only moved ended at a leaf, since the last time they were added up.
        outcomes: how often the activity of a state ended with an outcome.
    """

    def __init__(self) -> None:
        self._states: Counter[int] = Counter()
        self._transitions: Counter[int] = Counter()
        self._history: Counter[tuple[int, bool]] = Counter()
        self._taken: dict[Plan, int] = {}
        self.hits: set[tuple[int, int]] = set()
        self.leaves: dict[Leaf, int] = {}
        self.outcomes: Counter[tuple[int, str]] = Counter()

    def first(self, leaf: Leaf) -> None:
        """Count a leaf that is not among the counted ones."""
        if len(self.leaves) >= FORGOTTEN_AFTER:
            self._add_up()
        self.leaves[leaf] = 1

    def count(self, plans: Iterable[Plan | None]) -> None:
        """Count the microsteps of a step in full."""
        taken = self._taken
        for plan in plans:
            if plan in taken:
                taken[plan] += 1
            elif plan is not None:
                if len(taken) >= FORGOTTEN_AFTER:
                    self._add_up()
                taken[plan] = 1

    def _add_up(self) -> None:
        for leaf, count in self.leaves.items():
            self.hits.update(leaf.known.marks)
            for plan in leaf.plans:
                self._taken[plan] = self._taken.get(plan, 0) + count
        self.leaves.clear()
        for plan, count in self._taken.items():
            for state in plan.entered:
                self._states[state] += count
            for index in plan.transitions:
                self._transitions[index] += count
            for entered in plan.restored:
                self._history[entered] += count
        self._taken.clear()

    def coverage(self) -> Coverage:
        """What was exercised so far."""
        self._add_up()
        return Coverage(
            states=dict(sorted(self._states.items())),
            transitions=dict(sorted(self._transitions.items())),
            guards=guards_of(self.hits),
            outcomes=dict(sorted(self.outcomes.items())),
            history=dict(sorted(self._history.items())),
        )


def guards_of(hits: Iterable[tuple[int, int]]) -> Guards:
    """The paths through guards that were seen, by transition."""
    found: dict[int, set[int]] = {}
    for index, path in hits:
        found.setdefault(index, set()).add(path)
    return {index: frozenset(found[index]) for index in sorted(found)}
