"""The coverage items that steps of a machine may exercise; the others are unreachable once all steps are known."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import field

from hsm.engine.configuration import Plan
from hsm.engine.coverage import Coverage
from hsm.model.chart import Model
from hsm.model.values import dataclass
from hsm.testing.coverage.items import points
from hsm.testing.proofs.diagrams import FALSE, Diagram

UNREACHABLE = "proved unreachable"


@dataclass(slots=True)
class Possible:
    """The items found to be possible so far.

    Attributes:
        states: that may be entered.
        transitions: that may be taken.
        guards: for each transition the paths through its guard.
        outcomes: the states with the outcomes that their activities may report.
        history: the history states, each with whether it remembers something.
        untold: transitions whose guard paths all count as possible, because there are many.
    """

    states: set[int] = field(default_factory=set)
    transitions: set[int] = field(default_factory=set)
    guards: dict[int, set[int]] = field(default_factory=dict)
    outcomes: set[tuple[int, str]] = field(default_factory=set)
    history: set[tuple[int, bool]] = field(default_factory=set)
    untold: set[int] = field(default_factory=set)
    _told: dict[int, Sequence[tuple[int, int, Diagram]]] = field(default_factory=dict)

    def take(self, plan: Plan) -> None:
        """A microstep is possible."""
        self.states.update(plan.entered)
        self.transitions.update(plan.transitions)
        self.history.update(plan.restored)

    def paths(
        self,
        paths: Sequence[tuple[int, int, Diagram]],
        among: Diagram,
        both: Callable[[Diagram, Diagram], Diagram],
    ) -> None:
        """Guards are evaluated with these signals."""
        if id(paths) in self._told:
            return
        left = 0
        for transition, path, condition in paths:
            known = self.guards.setdefault(transition, set())
            if path not in known:
                if both(among, condition) != FALSE:
                    known.add(path)
                else:
                    left += 1
        if not left:
            self._told[id(paths)] = paths

    def coverage(self) -> Coverage:
        """All items that tests could exercise."""
        return Coverage(
            dict.fromkeys(sorted(self.states), 1),
            dict.fromkeys(sorted(self.transitions), 1),
            {index: frozenset(paths) for index, paths in sorted(self.guards.items())},
            dict.fromkeys(sorted(self.outcomes), 1),
            dict.fromkeys(sorted(self.history), 1),
        )


def united(several: Sequence[Possible]) -> Possible:
    """What is possible in some slice of a machine."""
    found = Possible()
    for one in several:
        found.states |= one.states
        found.transitions |= one.transitions
        found.outcomes |= one.outcomes
        found.history |= one.history
        found.untold |= one.untold
        for transition, paths in one.guards.items():
            found.guards.setdefault(transition, set()).update(paths)
    return found


def unreachable(model: Model, possible: Possible) -> frozenset[tuple[object, ...]]:
    """The keys of the items of a machine that no test can cover.

    Args:
        model: the machine.
        possible: all that a step may exercise.
    """
    left = (one.key for one in points(model, possible.coverage()) if not one.covered)
    return frozenset(
        key for key in left if key[0] not in ("guard", "condition", "mcdc") or key[1] not in possible.untold
    )
