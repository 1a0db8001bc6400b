"""What a run has exercised of its machine: collected by the engine at every step, merged over runs, read by reports."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

Guards = Mapping[int, frozenset[int]]


def _no_counts() -> Mapping[Any, int]:
    return {}


@dataclass(frozen=True, slots=True)
class Coverage:
    """Counts by the indices of a model; what was never exercised has no entry.

    Attributes:
        states: how often each state was entered.
        transitions: how often each transition was taken; for one with a time-out, how often that time-out acted.
        guards: for each transition, the paths through its guard that were seen (``hsm.decisions``), from which the
            outcomes of the guard and of each condition, and MC/DC, follow.
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
            states=Counter(self.states) + Counter(other.states),
            transitions=Counter(self.transitions) + Counter(other.transitions),
            guards=guards,
            outcomes=Counter(self.outcomes) + Counter(other.outcomes),
            history=Counter(self.history) + Counter(other.history),
        )

    def to_json(self) -> dict[str, Any]:
        """A form that JSON can carry."""
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
