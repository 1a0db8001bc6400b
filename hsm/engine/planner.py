"""The effect of a microstep, computed once for each combination of configuration, transitions and history.

SCXML's procedures ``removeConflictingTransitions``, ``computeExitSet``, ``computeEntrySet``, ``exitStates`` and
``enterStates``, as a value.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Iterable, Iterator
from dataclasses import field
from enum import Enum

from hsm.engine.codegen import Generator
from hsm.engine.configuration import CACHE, Configuration, Picked, Plan
from hsm.engine.generated import Block, Occasion
from hsm.model.chart import Defer, Every, Held, StateKind, Timed, Transition
from hsm.model.events import StateEvent
from hsm.model.topology import HISTORY, Remembered, Topology
from hsm.model.values import dataclass

_DONE = ("done",)


class _EntrySet:
    """The states to enter: SCXML's ``addDescendantStatesToEnter`` and ``addAncestorStatesToEnter`` on a stack.

    Attributes:
        states: the states to enter, sorted.
        default: compound states of which the initial state is entered.
        history: for a state around it, the history state whose default is entered.
        restored: the history states entered, each with whether it remembered something.
    """

    def __init__(self, topology: Topology, remembered: Remembered) -> None:
        self._topology = topology
        self._remembered = remembered
        self._tasks: list[tuple[_Task, int, int]] = []
        self.states: list[int] = []
        self.default: set[int] = set()
        self.history: dict[int, int] = {}
        self.restored: dict[int, bool] = {}

    def add_targets(self, targets: Iterable[int], domain: int) -> None:
        """Enter targets, with all that lies between them and their domain and all that is entered along with them."""
        effective = self._topology.effective_targets(targets, self._remembered)
        tasks = [(_Task.DOWN, target, -1) for target in targets]
        tasks.extend((_Task.UP, target, domain) for target in effective)
        if self._topology.states[domain].kind is StateKind.PARALLEL:
            tasks.extend((_Task.REGION, child.index, -1) for child in self._topology.real_children(domain))
        self._do(tasks)

    def add_default(self, state: int) -> None:
        """Enter the initial state of a state that is entered or, at the start, of the root."""
        self._do(self._default(state))

    def _do(self, tasks: Iterable[tuple[_Task, int, int]]) -> None:
        pending = list(reversed(list(tasks)))
        while pending:
            task, state, around = pending.pop()
            match task:
                case _Task.DOWN:
                    pending.extend(reversed(self._down(state)))
                case _Task.UP:
                    pending.extend(reversed(self._up(state, around)))
                case _Task.ADD:
                    self._add(state)
                case _Task.REGION:
                    if not self._holds_within(state):
                        pending.append((_Task.DOWN, state, -1))

    def _down(self, state: int) -> list[tuple[_Task, int, int]]:
        declared = self._topology.states[state]
        if declared.kind in HISTORY:
            targets = self._remembered.get(state)
            self.restored[state] = bool(targets)
            if not targets:
                self.history[declared.parent] = state
                targets = declared.initial
            return _both(targets, declared.parent)
        self._add(state)
        if declared.kind is StateKind.COMPOUND:
            return self._default(state)
        if declared.kind is StateKind.PARALLEL:
            return self._regions(state)
        return []

    def _up(self, state: int, around: int) -> list[tuple[_Task, int, int]]:
        tasks: list[tuple[_Task, int, int]] = []
        for ancestor in self._topology.ancestors(state):
            if not self._topology.inside(ancestor, around):
                break
            tasks.append((_Task.ADD, ancestor, -1))
            if self._topology.states[ancestor].kind is StateKind.PARALLEL:
                tasks.extend(self._regions(ancestor))
        return tasks

    def _default(self, state: int) -> list[tuple[_Task, int, int]]:
        self.default.add(state)
        return _both(self._topology.states[state].initial, state)

    def _regions(self, state: int) -> list[tuple[_Task, int, int]]:
        return [(_Task.REGION, child.index, -1) for child in self._topology.real_children(state)]

    def _add(self, state: int) -> None:
        at = bisect_left(self.states, state)
        if at == len(self.states) or self.states[at] != state:
            self.states.insert(at, state)

    def _holds_within(self, region: int) -> bool:
        at = bisect_left(self.states, region + 1)
        return at < len(self.states) and self.states[at] <= self._topology.states[region].last


class _Task(Enum):
    """What is left to do for the entry set."""

    DOWN = "add a state and what is entered along with it"
    UP = "add the states around a state"
    ADD = "add a state alone"
    REGION = "add a region unless something in it is entered already"


def _both(targets: tuple[int, ...], around: int) -> list[tuple[_Task, int, int]]:
    return [*((_Task.DOWN, one, -1) for one in targets), *((_Task.UP, one, around) for one in targets)]


class Planner:
    """Computes plans for one model."""

    def __init__(
        self,
        topology: Topology,
        generator: Generator,
        configuration: Callable[[tuple[int, ...]], Configuration],
    ) -> None:
        self._topology = topology
        self._configuration = configuration
        self._states = topology.states
        self._transitions = topology.model.transitions
        self._generator = generator
        self._entries: dict[int, Block | None] = {}
        self._blocks: dict[tuple[Occasion, int], Block | None] = {}

    def start(self) -> Plan:
        """The plan that enters the initial configuration; the root is entered first."""
        entry = _EntrySet(self._topology, {})
        entry.add_default(0)
        entry.states.insert(0, 0)
        return self._plan(None, entry)

    def plan(self, source: Configuration, picked: Picked, remembered: Remembered) -> Plan:
        """The plan for the transitions of a selector, given the values of the history states."""
        plan = source.plans.get(picked)
        if plan is not None:
            return plan
        key = (picked, tuple(sorted(remembered.items())))
        plan = source.plans.get(key)
        if plan is None:
            if len(source.plans) >= CACHE:
                source.forget()
            enabled = (picked,) if isinstance(picked, int) else picked
            plan = self._work_out(source, enabled, remembered)
            source.plans[key if plan.restored else picked] = plan
            if plan.plain and not plan.restored:
                source.moves[picked] = plan
        return plan

    def _work_out(self, source: Configuration, enabled: tuple[int, ...], remembered: Remembered) -> Plan:
        """The plan for transitions that are enabled, in the order in which they were selected."""
        active = source.active
        taken, preempted, exits = self._without_conflicts(active, enabled)
        # States that are left are remembered before targets are resolved, as SCXML leaves before it enters.
        remembers = self._remembers(exits, active)
        entry = _EntrySet(self._topology, {**remembered, **dict(remembers)})
        for index in taken:
            transition = self._transitions[index]
            if transition.targets:
                entry.add_targets(transition.targets, self._domain(transition, active))
        exited = tuple(sorted(exits, reverse=True))
        return self._plan(source, entry, taken=taken, preempted=preempted, exited=exited, remembered=remembers)

    def completed(self, leaves: Iterable[int]) -> tuple[int, ...]:
        """The atomic states that are active when these are, regions without one of them in their initial states."""
        entry = _EntrySet(self._topology, {})
        entry.add_targets(leaves, 0)
        return tuple(state for state in entry.states if self._topology.atomic(state))

    def _without_conflicts(
        self, active: frozenset[int], enabled: tuple[int, ...]
    ) -> tuple[tuple[int, ...], tuple[int, ...], frozenset[int]]:
        """The transitions that are taken, those that they preempt, and all states left."""
        exits = {index: self._exit_set(index, active) for index in enabled}
        kept: list[int] = []
        for index in enabled:
            rivals = [other for other in kept if exits[index] & exits[other]]
            source = self._transitions[index].source
            # An inner transition wins over an outer one; otherwise the one that comes first in the document.
            if all(self._topology.inside(source, self._transitions[other].source) for other in rivals):
                kept = [other for other in kept if other not in rivals]
                kept.append(index)
        preempted = tuple(index for index in enabled if index not in kept)
        return tuple(kept), preempted, frozenset().union(*(exits[index] for index in kept))

    def _exit_set(self, index: int, active: frozenset[int]) -> frozenset[int]:
        transition = self._transitions[index]
        if not transition.targets:
            return frozenset()
        domain = self._domain(transition, active)
        return frozenset(state for state in active if self._topology.inside(state, domain))

    def _domain(self, transition: Transition, active: frozenset[int]) -> int:
        """The active state within which a transition takes place; a source that could not be entered is not active."""
        domain = self._topology.domain(transition)
        if domain in active:
            return domain
        around = (one for one in self._topology.ancestors(domain) if one in active)
        return next(one for one in around if one == 0 or self._states[one].kind is StateKind.COMPOUND)

    def _remembers(self, exits: Iterable[int], active: frozenset[int]) -> tuple[tuple[int, tuple[int, ...]], ...]:
        found: list[tuple[int, tuple[int, ...]]] = []
        for state in sorted(exits):
            for child in self._states[state].children:
                kind = self._states[child].kind
                if kind is StateKind.SHALLOW_HISTORY:
                    found.append((child, tuple(one for one in self._states[state].children if one in active)))
                elif kind is StateKind.DEEP_HISTORY:
                    within = (one for one in active if self._topology.inside(one, state) and self._topology.atomic(one))
                    found.append((child, tuple(sorted(within))))
        return tuple(found)

    def _plan(
        self,
        source: Configuration | None,
        entry: _EntrySet,
        *,
        taken: tuple[int, ...] = (),
        preempted: tuple[int, ...] = (),
        exited: tuple[int, ...] = (),
        remembered: tuple[tuple[int, tuple[int, ...]], ...] = (),
    ) -> Plan:
        work = _Work(set(source.active) if source else set())
        for state in exited:
            work.run(self._block(Occasion.EXIT, state))
            work.active.discard(state)
        staying = [index for index in taken if self._transitions[index].source not in exited]
        repeated = [index for index in staying if isinstance(self._transitions[index].trigger, Every)]
        for index in taken:
            work.run(self._block(Occasion.TRANSITION, index))
        for index in repeated:
            work.run(self._block(Occasion.REPEAT, index))
        outcome = None
        for state in entry.states:
            work.active.add(state)
            work.run(self._block(Occasion.ENTRY, state))
            if state in entry.default:
                work.run(self._block(Occasion.INITIAL, state))
            if state in entry.history:
                work.run(self._block(Occasion.INITIAL, entry.history[state]))
            if self._states[state].kind is StateKind.FINAL:
                if self._states[state].parent == 0:
                    outcome = outcome or self._states[state].own_name
                else:
                    work.done.extend(self._completions(state, work.active))
        leaves = tuple(sorted(state for state in work.active if self._topology.atomic(state)))
        target = self._configuration(leaves)
        ending = [*taken, *(index for state in exited for index in self._states[state].transitions)]
        disarmed = tuple(index for index in dict.fromkeys(ending) if self._timed(index) and index not in repeated)
        arming = any(self._timed(index) for state in entry.states for index in self._states[state].transitions)
        stopped = tuple(state for state in exited if self._states[state].activity is not None)
        kept = bool(taken) and all(isinstance(self._transitions[index].trigger, Defer) for index in taken)
        return Plan(
            transitions=taken,
            preempted=preempted,
            exited=exited,
            entered=tuple(entry.states),
            source=source,
            target=target,
            work=tuple(work.done),
            remembered=remembered,
            disarmed=disarmed,
            acted=tuple(index for index in staying if isinstance(self._transitions[index].trigger, Held)),
            timed=bool(disarmed) or arming,
            stopped=stopped,
            restored=tuple(entry.restored.items()),
            outcome=outcome,
            kept=kept,
            plain=not (kept or work.done or remembered or disarmed or arming or outcome or stopped or target.always),
        )

    def _timed(self, index: int) -> bool:
        return isinstance(self._transitions[index].trigger, Timed)

    def _completions(self, final: int, active: set[int]) -> Iterator[StateEvent]:
        """What a final state completes: the state around it, and every parallel state around that is complete now."""
        around = self._states[final].parent
        yield StateEvent((self._states[final].own_name,), around, f"done.state.{self._states[around].name}", _DONE)
        outer = self._states[around].parent
        while self._states[outer].kind is StateKind.PARALLEL and self._complete(outer, active):
            yield StateEvent((), outer, f"done.state.{self._states[outer].name}", _DONE)
            outer = self._states[outer].parent

    def _complete(self, parallel: int, active: set[int]) -> bool:
        """Whether all regions of a parallel state, and of those among them that are parallel, are in a final state."""
        regions = list(self._topology.real_children(parallel))
        while regions:
            region = regions.pop()
            if region.kind is StateKind.PARALLEL:
                regions.extend(self._topology.real_children(region.index))
            elif not any(self._states[one].kind is StateKind.FINAL and one in active for one in region.children):
                return False
        return True

    def _block(self, role: Occasion, index: int) -> Block | None:
        key = (role, index)
        if key not in self._blocks:
            self._blocks[key] = self._make_block(role, index)
        return self._blocks[key]

    def _make_block(self, role: Occasion, index: int) -> Block | None:
        if role is Occasion.REPEAT:
            return self._generator.repeat(index)
        if role is Occasion.TRANSITION:
            return self._generator.actions(self._transitions[index].source, role, self._transitions[index].actions)
        state = self._states[index]
        if role is Occasion.ENTRY:
            return self._generator.entry(state)
        return self._generator.actions(index, role, state.exit if role is Occasion.EXIT else state.initial_actions)


@dataclass(slots=True)
class _Work:
    """The actions of a step while they are collected, and the states active at that moment."""

    active: set[int]
    done: list[tuple[Block, frozenset[int]] | StateEvent] = field(default_factory=list)

    def run(self, block: Block | None) -> None:
        if block is not None:
            self.done.append((block, frozenset(self.active) if block.watches else frozenset()))
