"""The tree of the states of a model: by index, without recursion, at any depth."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from hsm.model.chart import Model, State, StateKind, Transition, TransitionKind

HISTORY = (StateKind.SHALLOW_HISTORY, StateKind.DEEP_HISTORY)
_INNER = (StateKind.COMPOUND, StateKind.PARALLEL)

Remembered = dict[int, tuple[int, ...]]
"""For each history state, by index: the states that were active when the state around it was left last."""


class Topology:
    """The tree of states, with SCXML's relations between them."""

    def __init__(self, model: Model) -> None:
        self.model = model
        self.states = model.states

    @property
    def depth(self) -> int:
        """How deep the states are nested; 1 for top-level states."""
        depths = [0]
        for state in self.states[1:]:
            depths.append(depths[state.parent] + 1)
        return max(depths)

    def inside(self, state: int, around: int) -> bool:
        """Whether a state is a proper descendant of another."""
        return around < state <= self.states[around].last

    def ancestors(self, state: int) -> Iterator[int]:
        """The states around a state, from the nearest out; the root is the last."""
        while (state := self.states[state].parent) >= 0:
            yield state

    def up(self, state: int) -> Iterator[int]:
        """A state and its ancestors."""
        yield state
        yield from self.ancestors(state)

    def atomic(self, state: int) -> bool:
        """Whether nothing can be active within a state."""
        return self.states[state].kind in (StateKind.ATOMIC, StateKind.FINAL)

    def real_children(self, state: int) -> Iterator[State]:
        """The children of a state that can be active: not its history states."""
        return (self.states[child] for child in self.states[state].children if self.states[child].kind not in HISTORY)

    def closure(self, leaves: Iterable[int]) -> frozenset[int]:
        """The states with all states around them, the root included, which is always active."""
        found = {0}
        for leaf in leaves:
            for state in self.up(leaf):
                if state in found:
                    break
                found.add(state)
        return frozenset(found)

    def rivals(self, leaves: Iterable[int]) -> tuple[int, int] | None:
        """Two of the given states, or of the states around them, that cannot be active together; None if all can."""
        chosen: dict[int, int] = {}
        for state in self.closure(leaves) - {0}:
            parent = self.states[state].parent
            if self.states[parent].kind is not StateKind.PARALLEL and chosen.setdefault(parent, state) != state:
                return min(chosen[parent], state), max(chosen[parent], state)
        return None

    def recalls(self, history: int, remembered: Iterable[int]) -> bool:
        """Whether a history state may remember some states: together, they are what can be active inside its parent."""
        states, parent = list(remembered), self.states[history].parent
        if self.states[history].kind is StateKind.SHALLOW_HISTORY:
            fits = all(self.states[one].parent == parent and self.states[one].kind not in HISTORY for one in states)
        else:
            fits = all(self.inside(one, parent) and self.atomic(one) for one in states)
        return fits and self.rivals(states) is None

    def effective_targets(self, targets: Iterable[int], remembered: Remembered) -> list[int]:
        """The targets, history states replaced by what they remember or, failing that, by their default."""
        found: list[int] = []
        resolved: set[int] = set()
        pending = list(reversed(tuple(targets)))
        while pending:
            target = pending.pop()
            if self.states[target].kind not in HISTORY:
                if target not in found:
                    found.append(target)
            elif target not in resolved:
                resolved.add(target)
                pending.extend(reversed(remembered.get(target) or self.states[target].initial))
        return found

    def domain(self, transition: Transition) -> int:
        """The state within which a transition with targets takes place: it is neither left nor entered.

        A local transition whose targets lie within its source takes place in the source. Any other takes place in the
        least common compound ancestor of source and targets. A history state counts with its own place, not with what
        it remembers: so what is entered has been left before, which SCXML's ``getTransitionDomain`` does not ensure.
        """
        targets = transition.targets
        source = transition.source
        within = self.states[source].kind in _INNER or source == 0
        if within and transition.kind is TransitionKind.LOCAL and all(self.inside(one, source) for one in targets):
            return source
        for state in self.ancestors(source):
            proper = state == 0 or self.states[state].kind is StateKind.COMPOUND
            if proper and all(self.inside(one, state) for one in targets):
                return state
        return 0
