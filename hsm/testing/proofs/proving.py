"""Properties of a machine proved for all runs, or violated by a run of the engine."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

from hsm.engine.clock import nanoseconds
from hsm.engine.machine import Machine
from hsm.model.chart import Model, StateKind
from hsm.model.properties import Property, conditions_of
from hsm.model.values import dataclass
from hsm.testing.exploration.violations import search
from hsm.testing.proofs.continuing import ending
from hsm.testing.proofs.deciding import NO_FAULT_TEXT, Decider
from hsm.testing.proofs.diagrams import TooMany
from hsm.testing.proofs.graph import FREE, Budget, Graph, events_of, unsupported
from hsm.testing.proofs.localizing import MOST_KEPT, Localizer, applies
from hsm.testing.proofs.possible import Possible, united
from hsm.testing.proofs.regions import COARSE, FINE, MIDDLE, Precision
from hsm.testing.proofs.slices import Slice, slices
from hsm.testing.proofs.values import NoRun, Undecided
from hsm.testing.proofs.verdicts import NO_FAULT, Assumptions, PropertyVerdict, Status
from hsm.testing.proofs.witness import Replayer
from hsm.testing.scenarios.script import scripted_machine

SECONDS = 60.0
"""The limit of processor time for a machine's graph, and again for all its properties."""

LOCATIONS = 20_000

SHARE = 8
"""The part of that time, as its denominator, for each attempt with a few of the regions of a machine."""


@dataclass(frozen=True, slots=True)
class Examination:
    """The results for a machine.

    Attributes:
        verdicts: on its properties.
        possible: all that steps may exercise; None where not all steps are known.
        passing: states that steps only pass through: none ends in them.
    """

    verdicts: list[PropertyVerdict]
    possible: Possible | None
    passing: Sequence[str] = ()


def check(
    machine: Machine | Model,
    assumptions: Assumptions | None = None,
    *,
    depth: int | None = None,
    only: Collection[str] | None = None,
    seconds: float = SECONDS,
) -> list[PropertyVerdict]:
    """Decide the properties of a machine for all signals, outcomes, events and waiting times.

    Args:
        machine: the machine.
        assumptions: the assumptions; by default ``Assumptions()``.
        depth: check only runs of this many steps; by default all runs.
        only: names of properties, possibly ``NO_FAULT``; by default all.
        seconds: the limit of processor time for the graph, and the same again for the properties.
    """
    return examine(machine, assumptions, depth=depth, only=only, seconds=seconds).verdicts


def examine(
    machine: Machine | Model,
    assumptions: Assumptions | None = None,
    *,
    depth: int | None = None,
    only: Collection[str] | None = None,
    seconds: float = SECONDS,
) -> Examination:
    """The same as ``check``, and the reachable items of the machine; see there for the arguments."""
    ready = scripted_machine(machine)
    stated = [one for one in ready.model.properties if only is None or one.name in only]
    fault = only is None or NO_FAULT in only
    parts = slices(ready.model, stated)
    proofs = [_proof(ready, one, assumptions or Assumptions(), depth, seconds / len(parts)) for one in parts]
    found: dict[str, PropertyVerdict] = {}
    faults: list[PropertyVerdict] = []
    for part, proof in zip(parts, proofs, strict=True):
        for verdict in proof.verdicts(fault=fault and part.whole) if part.stated or fault else ():
            if verdict.name == NO_FAULT:
                faults.append(verdict)
            else:
                found[verdict.name] = verdict
    verdicts = [found[one.name] for one in stated]
    possible = [proof.possible for part, proof in zip(parts, proofs, strict=True) if part.whole]
    known = [one for one in possible if one is not None]
    every = united(known) if known and len(known) == len(possible) else None
    resting = frozenset[int]().union(*(proof.resting for proof in proofs))
    passing = [
        state.name
        for state in ready.model.states
        if every is not None and state.kind is StateKind.ATOMIC and state.index in every.states - resting
    ]
    return Examination([_together(faults), *verdicts] if faults else verdicts, every, passing)


def _together(faults: Sequence[PropertyVerdict]) -> PropertyVerdict:
    """The verdict on the steps of all slices of a machine."""
    worst = min(faults, key=lambda one: (not one.violated, one.proved, one.depth))
    return replace(worst, states=sum(one.states for one in faults)) if worst.proved else worst


class _Proof:
    """The decision task for one machine, or for a slice of it; runs are shown on the whole."""

    def __init__(self, machine: Machine, part: Slice, assumed: Assumptions, depth: int | None, seconds: float) -> None:
        self._whole = machine
        self._machine = machine if part.model is machine.model else Machine(part.model)
        self._assumed = assumed
        self._stated = part.stated
        self._depth = depth
        self.possible: Possible | None = None
        self.resting: frozenset[int] = frozenset()
        self._seconds = seconds
        self._longest = nanoseconds(assumed.pace(machine.model))
        self._parameters = assumed.values(machine.model)
        self._loose = part.loose
        self._conditions = [one for stated in machine.model.properties for one in conditions_of(stated.claim)]

    def verdicts(self, *, fault: bool) -> list[PropertyVerdict]:
        """One verdict for each property: first with medium regions, then with finer or coarser ones."""
        texts = {**({NO_FAULT: NO_FAULT_TEXT} if fault else {}), **{one.name: one.text for one in self._stated}}
        obstacle = unsupported(self._machine.model)
        found: dict[str, PropertyVerdict] = {}
        pending = [] if obstacle is not None else [MIDDLE]
        while pending:
            precision = pending.pop()
            graph = self._graph(precision)
            try:
                graph.build(Budget(self._seconds / 2, LOCATIONS), self._depth)
                dead = ending(graph)
            except NoRun as error:
                return [PropertyVerdict(*one, Status.UNDECIDED, reason=str(error)) for one in texts.items()]
            except Undecided as error:
                obstacle = str(error)
                break
            except TooMany as error:
                obstacle = str(error)
            else:
                if graph.complete and not graph.failures:
                    self.possible = graph.stepper.possible
                    self.resting = frozenset(state for one in graph.locations for state in one.leaves)
                self._decide(graph, dead, [one for one in texts if one not in found or _open(found[one])], found)
            if precision is MIDDLE and not (len(found) == len(texts) and not any(map(_open, found.values()))):
                pending.append(FINE if graph.complete else COARSE)
        left = {name: text for name, text in texts.items() if name not in found}
        if left:
            found |= self._explored(left, obstacle or "")
        return [found[name] for name in texts]

    def _explored(self, texts: Mapping[str, str], obstacle: str) -> dict[str, PropertyVerdict]:
        """Machines that proofs do not support are explored from the start instead."""
        values = {name: value for name, value in self._parameters.items() if value is not FREE}
        if len(values) < len(self._parameters):
            undecided = Status.UNDECIDED
            return {name: PropertyVerdict(name, text, undecided, reason=obstacle) for name, text in texts.items()}
        searched = search(self._whole, values, tick=self._assumed.pace(self._whole.model))
        shown = {**searched.violations, **({} if searched.fault is None else {NO_FAULT: searched.fault})}
        reason = f"{obstacle}; {searched.extent}"
        return {
            name: PropertyVerdict(name, text, Status.UNDECIDED, reason=reason, states=searched.states)
            if name not in shown
            else PropertyVerdict(name, text, Status.VIOLATED, counterexample=shown[name], states=searched.states)
            for name, text in texts.items()
        }

    def _decide(
        self, graph: Graph, dead: frozenset[int], names: Sequence[str], found: dict[str, PropertyVerdict]
    ) -> None:
        """Decide some properties; an earlier verdict stays if there is no better one."""
        replayer = Replayer(self._whole, graph, self._parameters, self._conditions, self._longest)
        budget = Budget(self._seconds / 2, LOCATIONS)
        decider = Decider(
            graph, replayer, self._longest, budget, self._stated, asked=self._depth is not None, ending=dead
        )
        stated = {one.name: one for one in self._stated}
        for name in names:
            verdict = decider.without_fault() if name == NO_FAULT else decider.decided(stated[name])
            if name not in found or not _open(verdict) or verdict.depth > found[name].depth:
                found[name] = verdict

    def _graph(self, precision: Precision) -> Graph:
        return Graph(
            self._machine,
            list(self._parameters.values()),
            self._stated,
            events_of(self._machine.model),
            precision=precision,
            not_a_number=self._assumed.not_a_number,
            loose=self._loose,
        )


class _NearbyProof(_Proof):
    """The decision task for coupled regions: a few of them at a time first, and all for what that does not prove."""

    def __init__(self, machine: Machine, part: Slice, assumed: Assumptions, depth: int | None, seconds: float) -> None:
        super().__init__(machine, part, assumed, depth, seconds)
        self._kept = part.kept
        self._localizer = Localizer(machine.model)

    def verdicts(self, *, fault: bool) -> list[PropertyVerdict]:
        """One verdict for each property."""
        budget = Budget(self._seconds / 2, LOCATIONS)
        none_fails = self._none_fails(budget) if fault else None
        found = {} if none_fails is None else {NO_FAULT: none_fails}
        found |= self._nearby({one.name: self._localizer.kept_for(one) for one in self._stated}, budget)
        left = [one for one in self._stated if one.name not in found]
        every = [*([NO_FAULT] if fault else []), *(one.name for one in self._stated)]
        if len(found) < len(every):
            self._stated = left
            found |= {one.name: one for one in super().verdicts(fault=fault and none_fails is None)}
        return [found[name] for name in every]

    def _nearby(self, kept: Mapping[str, frozenset[int]], budget: Budget) -> dict[str, PropertyVerdict]:
        """The verdicts on properties for which the regions that they name suffice, or those with their neighbours."""
        found: dict[str, PropertyVerdict] = {}
        for _ in range(MOST_KEPT):
            for regions in dict.fromkeys(kept[name] for name in kept if name not in found):
                stated = [one for one in self._stated if one.name not in found and kept[one.name] == regions]
                found |= {one.name: one for one in self._tried(regions, stated, budget) if not _open(one)}
            kept = {name: self._localizer.grown(regions) for name, regions in kept.items()}
        return found

    def _none_fails(self, budget: Budget) -> PropertyVerdict | None:
        """Whether no step fails in any region, whatever the others do; None where that is not proved."""
        shown: list[PropertyVerdict] = []
        possible: list[Possible] = []
        resting: set[int] = set()
        for regions in dict.fromkeys(self._localizer.kept(one) for one in sorted(self._kept)):
            proof = self._proof(regions, [], budget)
            verdict = None if proof is None else proof.verdicts(fault=True)[0]
            if proof is None or proof.possible is None or verdict is None or not verdict.proved:
                return None
            shown.append(verdict)
            possible.append(proof.possible)
            resting |= proof.resting
        self.possible, self.resting = united(possible), frozenset(resting)
        return _together(shown)

    def _tried(self, kept: frozenset[int], stated: Sequence[Property], budget: Budget) -> Sequence[PropertyVerdict]:
        proof = self._proof(kept, stated, budget)
        return () if proof is None else proof.verdicts(fault=False)

    def _proof(self, kept: frozenset[int], stated: Sequence[Property], budget: Budget) -> _Proof | None:
        part = None if budget.spent else self._localizer.slice(kept, stated)
        return None if part is None else _Proof(self._whole, part, self._assumed, self._depth, self._seconds / SHARE)


def _proof(machine: Machine, part: Slice, assumed: Assumptions, depth: int | None, seconds: float) -> _Proof:
    nearby = depth is None and applies(machine.model, part.kept)
    return (_NearbyProof if nearby else _Proof)(machine, part, assumed, depth, seconds)


def _open(verdict: PropertyVerdict) -> bool:
    """Whether a better verdict is possible."""
    return not (verdict.proved or verdict.violated)
