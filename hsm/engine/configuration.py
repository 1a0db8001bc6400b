"""A configuration: the states that are active together, with tables that do not depend on a step.

Plans lead from one configuration to the next, and so do the leaves where the selections of a step end.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple, Protocol

from hsm.engine.codegen import Generator
from hsm.engine.generated import NONE, Block, CandidateChain
from hsm.engine.looks import WARM, Found, Known, Look, SlowPath
from hsm.model.chart import Action, Always, Held, On, Timed, Transition, When
from hsm.model.events import Event, StateEvent, matches
from hsm.model.messages import Occurrence, OutsideInput
from hsm.model.topology import Topology
from hsm.model.values import dataclass

CACHE = 4096
"""How many plans, or selectors of events, a configuration caches before it clears them all."""

Picked = int | tuple[int, ...]
"""The result of a selector: a transition, several in order, or ``NONE``."""


@dataclass(frozen=True, slots=True, eq=False)
class Selector:
    """All transitions that a configuration offers to one kind of trigger.

    Attributes:
        chains: one for each atomic state that offers any, in document order.
        pick: gives what fires.
    """

    chains: tuple[CandidateChain, ...]
    pick: Callable[..., Picked]


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """One microstep.

    Attributes:
        transitions: the transitions taken, in order.
        preempted: transitions that were enabled but conflict with one taken.
        exited: the states left, in order.
        entered: the states entered, in order.
        source: the configuration before, None for the start.
        target: the configuration afterwards.
        work: blocks of actions to run, each with the states active at that moment, and completions to announce.
        remembered: the new values of the history states within the states left.
        disarmed: time-outs that no longer run.
        acted: conditions that have held long enough, and count again only after they were false.
        timed: whether time-outs start or end.
        stopped: states whose activity ends.
        restored: history states that were entered, each with whether it remembered something.
        outcome: the name of the top-level final state that is entered.
        kept: whether the event is deferred until another state is active.
        plain: whether the microstep only moves to the target and nothing follows at once.
    """

    transitions: tuple[int, ...]
    preempted: tuple[int, ...]
    exited: tuple[int, ...]
    entered: tuple[int, ...]
    source: Configuration | None
    target: Configuration
    work: tuple[tuple[Block, frozenset[int]] | StateEvent, ...]
    remembered: tuple[tuple[int, tuple[int, ...]], ...]
    disarmed: tuple[int, ...]
    acted: tuple[int, ...]
    timed: bool
    stopped: tuple[int, ...]
    restored: tuple[tuple[int, bool], ...]
    outcome: str | None
    kept: bool
    plain: bool

    @property
    def actions(self) -> tuple[Action, ...]:
        """The actions that are run, in order."""
        return tuple(action for one in self.work if not isinstance(one, StateEvent) for action in one[0].actions)


class Looked(NamedTuple):
    """One look that is over.

    Attributes:
        event: what was searched for; None for conditions.
        configuration: where.
        plan: what was taken; None where nothing was.
    """

    event: str | None
    configuration: Configuration
    plan: Plan | None


class Grower(Protocol):
    """Makes the trees of a machine, and knows its signals."""

    def grow(self, leaf: Leaf, event: OutsideInput | None) -> Look | Leaf:
        """The next look after a leaf: for an event, for conditions, or the rest of one that was cut.

        For an event, it may be the leaf instead at which the look always ends.

        Raises:
            SlowPath: events are not looked for in this way.
        """

    def keys(self, slots: Sequence[int], values: Sequence[Any]) -> Iterator[Any]:
        """Where the values of signals are kept within a step, given the variables."""


class Leaf:
    """Where a look ended, or was cut because its function is large enough.

    Attributes:
        grower: makes the trees.
        known: what is known here.
        looked: the looks that are over.
        after: the configuration now.
        grown: how many trees grow from the same root as this leaf; one list for all of its leaves.
        move: the event, or None for conditions, and what was picked for it, before steps continue from here.
        rest: makes the rest of a look that was cut.
        go: the rest of a look that was cut, or else the next look for conditions; None where the step is over.
        found: the leaf as what is found, where it carries no values.
        events: the next look for each event that has one.
        sure: where the next look ends for each event that needs none, as no guard has to be decided.
    """

    __slots__ = (
        *("_visits", "after", "events", "found", "go", "grower", "grown"),
        *("known", "looked", "move", "rest", "sure"),
    )

    def __init__(
        self,
        grower: Grower,
        after: Configuration,
        known: Known | None = None,
        looked: tuple[Looked, ...] = (),
        grown: list[int] | None = None,
        *,
        move: tuple[str | None, Picked] | None = None,
        rest: Callable[[Leaf], Look] | None = None,
    ) -> None:
        self.grower = grower
        self._visits = 0
        self.after = after
        self.known = known or Known()
        self.looked = looked
        self.grown = [0] if grown is None else grown
        self.move = move
        self.rest = rest
        self.found: Found = (self,)
        self.go: Look | None = None if self._is_over() else self.advance
        self.events: dict[OutsideInput, Look] = {}
        self.sure: dict[OutsideInput, Leaf] = {}

    @property
    def plans(self) -> Iterator[Plan]:
        """The microsteps taken, in order."""
        return (one.plan for one in self.looked if one.plan is not None)

    def advance(self, facts: Any, values: Sequence[Any], found: Found) -> Found:
        """Make the continuation from here, and continue."""
        go = self.grow(None)
        if go is self:
            self.go = None
            return found
        assert not isinstance(go, Leaf), "only a leaf of an event is sure"
        self.go = go
        return go(facts, values, found)

    def event(self, event: OutsideInput) -> Look:
        """The next look for an event that ``events`` has none for.

        Raises:
            SlowPath: there is none yet.
        """
        look = self.grow(event)
        if isinstance(look, Leaf):
            self.sure[event] = end = look
            return lambda _facts, _values, _found: end.found
        self.events[event] = look
        return look

    def _is_over(self) -> bool:
        """Whether nothing is left to look for but events: the active states have no conditions."""
        return self.after.when is None and self.move is None and self.rest is None

    def grow(self, event: OutsideInput | None) -> Look | Leaf:
        """The next look, once the leaf is warm; a leaf where it always ends there, which may be this one.

        Raises:
            SlowPath: it is not, or what was picked does more than move.
        """
        self._visits += 1
        if self._visits <= WARM:
            raise SlowPath
        if self.move is not None:
            trigger, picked = self.move
            plan = self.after.moves.get(picked)
            if plan is None:
                raise SlowPath
            self.looked = (*self.looked, Looked(trigger, self.after, plan))
            self.after = plan.target
            self.move = None
        return self if event is None and self._is_over() else self.grower.grow(self, event)

    def memo(self, found: Found, values: Sequence[Any]) -> dict[Any, Any]:
        """The signals evaluated on the way, by key.

        Args:
            found: this leaf with the values that it carries.
            values: the variables.
        """
        seen = {**self.known.flags, **dict(zip(self.known.carried, found[1:], strict=True))}
        return dict(zip(self.grower.keys(tuple(seen), values), seen.values(), strict=True))

    def interrupted(self, found: Found, values: Sequence[Any], names: Mapping[str, Any]) -> dict[Any, Any]:
        """The signals evaluated until the look after this leaf was interrupted, by key.

        Args:
            found: this leaf with the values that it carries.
            values: the variables.
            names: the local variables of the look, in which `s3` is the signal with slot 3.
        """
        fetched = {int(name[1:]): value for name, value in names.items() if name[0] == "s"}
        keys = self.grower.keys(tuple(fetched), values)
        return {**self.memo(found, values), **dict(zip(keys, fetched.values(), strict=True))}


class Configuration:
    """The active states of a machine; made once for each combination that occurs, shared by all runs.

    Attributes:
        topology: how the states lie in one another.
        generator: makes what picks transitions.
        leaves: the active atomic states, by index, in document order.
        active: all active states, the root included.
        when: what conditions can fire.
        always: what fires without a trigger.
        after: what time-outs can fire.
        held: the transitions whose condition must hold for some time.
        events: what an event can fire, for the events so far; events with data by their names in brackets.
        plans: what is done for the transitions that a selector picked.
        moves: the plans that only move, independent of history.
        root: where a step that only moves begins.
    """

    __slots__ = (
        "_activities",
        "_names",
        "active",
        "after",
        "always",
        "events",
        "generator",
        "held",
        "leaves",
        "moves",
        "plans",
        "root",
        "topology",
        "when",
    )

    def __init__(self, topology: Topology, generator: Generator, grower: Grower, leaves: tuple[int, ...]) -> None:
        self.topology = topology
        self.generator = generator
        self.leaves = leaves
        self.active = topology.closure(leaves)
        self.when = self._selector(lambda transition: isinstance(transition.trigger, When))
        self.always = self._selector(lambda transition: isinstance(transition.trigger, Always))
        self.after = self._selector(lambda transition: isinstance(transition.trigger, Timed))
        model = topology.model
        own = (index for state in sorted(self.active) for index in model.states[state].transitions)
        self.held = tuple(index for index in own if isinstance(model.transitions[index].trigger, Held))
        self._names: frozenset[str] | None = None
        self._activities: tuple[int, ...] | None = None
        self.events: dict[Event | tuple[str], Selector | None] = {}
        self.plans: dict[Any, Plan] = {}
        self.moves: dict[Picked, Plan] = {}
        self.root = Leaf(grower, self)

    @property
    def states(self) -> tuple[int, ...]:
        """All active states but the root, in document order."""
        return tuple(sorted(self.active)[1:])

    @property
    def names(self) -> frozenset[str]:
        """The full names of all active states but the root."""
        if self._names is None:
            self._names = frozenset(self.topology.states[state].name for state in self.states)
        return self._names

    @property
    def activities(self) -> tuple[int, ...]:
        """The active states that do something, in document order."""
        if self._activities is None:
            states = self.topology.states
            self._activities = tuple(state for state in sorted(self.active) if states[state].activity is not None)
        return self._activities

    def on(self, event: Event) -> Selector | None:
        """What an event can fire."""
        key = (event.name,) if isinstance(event, Occurrence) else event
        if key not in self.events:
            if len(self.events) >= CACHE:
                self.events.clear()
            self.events[key] = self._selector(lambda transition: self._listens(transition, event))
        return self.events[key]

    def forget(self) -> None:
        """Drop the plans and the trees, which keep other configurations alive."""
        self.plans.clear()
        self.moves.clear()
        self.root = Leaf(self.root.grower, self)

    def _listens(self, transition: Transition, event: Event) -> bool:
        source = self.topology.states[transition.source]
        return isinstance(transition.trigger, On) and matches(transition.trigger, event, source.index, source.last)

    def _selector(self, belongs: Callable[[Transition], bool]) -> Selector | None:
        offered: dict[int, tuple[int, ...]] = {}
        for leaf in self.leaves:
            for state in self.topology.up(leaf):
                if state not in offered:
                    offered[state] = self._own(state, belongs)
        # States with the same candidates have the same result, so only one of them is evaluated.
        lists = dict.fromkeys(self._candidates(leaf, offered) for leaf in self.leaves)
        chains = tuple(self.generator.chain(candidates) for candidates in lists if candidates)
        if not chains:
            return None
        return Selector(chains, chains[0].pick if len(chains) == 1 else _together(chain.pick for chain in chains))

    def _own(self, state: int, belongs: Callable[[Transition], bool]) -> tuple[int, ...]:
        model = self.topology.model
        return tuple(index for index in model.states[state].transitions if belongs(model.transitions[index]))

    def _candidates(self, leaf: int, offered: dict[int, tuple[int, ...]]) -> tuple[int, ...]:
        return tuple(index for state in self.topology.up(leaf) for index in offered[state])


def _together(picks: Iterable[Callable[..., int]]) -> Callable[..., Picked]:
    """One selector for several atomic states: each contributes the first of its transitions that fires."""
    functions = tuple(picks)

    def pick(*arguments: Any) -> Picked:
        found: list[int] = []
        for function in functions:
            index = function(*arguments)
            if index != NONE and index not in found:
                found.append(index)
        return (tuple(found) if len(found) > 1 else found[0]) if found else NONE

    return pick
