"""A configuration: the states that are active together, with what can be known about them before a step."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from hsm.engine.codegen import NONE, Block, CandidateChain, Generator
from hsm.model.chart import Action, Always, Held, On, Timed, Transition, When
from hsm.model.events import Event, StateEvent, matches
from hsm.model.messages import Occurrence
from hsm.model.topology import Topology

CACHE = 4096
"""How many plans, or selectors of events, a configuration keeps before it forgets them all."""

Picked = int | tuple[int, ...]
"""What a selector gives: a transition, several of them in order, or ``NONE``."""


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
        remembered: what the history states within the states left now remember.
        disarmed: time-outs that no longer run.
        acted: conditions that have held long enough, and are not waited for again before they are false.
        timed: whether time-outs start or end.
        stopped: states whose activity ends.
        restored: history states that were entered, each with whether it remembered something.
        outcome: the name of the top-level final state that is entered.
        plain: whether nothing has to be done but to move to the target, and nothing follows at once.
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
    plain: bool

    @property
    def actions(self) -> tuple[Action, ...]:
        """The actions that are run, in order."""
        return tuple(action for one in self.work if not isinstance(one, StateEvent) for action in one[0].actions)


class SlowPath(Exception):  # noqa: N818 - not an error
    """There is more to do than to move."""


class Moves(dict[Picked, Plan]):
    """Plans that do nothing but move; asked for any other, it raises ``SlowPath``."""

    __slots__ = ()

    def __missing__(self, picked: Picked) -> Plan:
        raise SlowPath


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
        pick_when: the selector's function, or one that gives ``NONE``.
        pick_first: the same, for a step in which no signal was evaluated yet.
        events: what an event can fire, for the events that were asked for; those that carry something, by their names
            in brackets.
        plans: what is done for the transitions that a selector picked.
        moves: those of the plans that do nothing but move, whatever history states remember; ``SlowPath`` is raised for
            all others.
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
        "pick_first",
        "pick_when",
        "plans",
        "topology",
        "when",
    )

    def __init__(self, topology: Topology, generator: Generator, leaves: tuple[int, ...]) -> None:
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
        self.pick_when = self.when.pick if self.when else _nothing
        single = self.when is not None and len(self.when.chains) == 1
        self.pick_first = self.when.chains[0].first if self.when and single else self.pick_when
        self._names: frozenset[str] | None = None
        self._activities: tuple[int, ...] | None = None
        self.events: dict[Event | tuple[str], Selector | None] = {}
        self.plans: dict[Any, Plan] = {}
        self.moves: dict[Picked, Plan] = Moves()

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
        """Drop the plans, which keep other configurations alive."""
        self.plans.clear()
        self.moves.clear()

    def _listens(self, transition: Transition, event: Event) -> bool:
        source = self.topology.states[transition.source]
        return isinstance(transition.trigger, On) and matches(transition.trigger, event, source.index, source.last)

    def _selector(self, belongs: Callable[[Transition], bool]) -> Selector | None:
        offered: dict[int, tuple[int, ...]] = {}
        for leaf in self.leaves:
            for state in self.topology.up(leaf):
                if state not in offered:
                    offered[state] = self._own(state, belongs)
        # States that share all their candidates give the same answer: one of them is asked.
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


def _nothing(*_: Any) -> int:
    return NONE


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
