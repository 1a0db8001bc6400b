"""Properties of a machine proved for all runs, or violated by a run of the engine."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any

from hsm.engine.machine import Machine
from hsm.model.chart import Model
from hsm.model.expressions import Literal
from hsm.model.properties import Never, Property, Recurrence, Response, conditions_of
from hsm.model.types import BOOLEAN
from hsm.testing.proofs.graph import Budget, Graph, events_of, unsupported
from hsm.testing.proofs.regions import FINEST
from hsm.testing.proofs.search import Search
from hsm.testing.proofs.values import TooMany, Undecided
from hsm.testing.proofs.verdicts import NO_FAULT, Assumptions, Method, PropertyVerdict, Status
from hsm.testing.proofs.witness import Replayer
from hsm.testing.scenarios.scenarios import Scenario
from hsm.testing.scenarios.script import scripted_machine

SECONDS = 60.0
"""So much time of the processor a machine's graph may take, and as much again all its properties."""

LOCATIONS = 20_000
CANDIDATES = 12
"""So many ways to a violation are tried on the engine, the shortest first."""

_NO_FAULT_TEXT = "no guard, assignment or duration fails, no transitions follow one another without end"


def check(
    machine: Machine | Model,
    assumptions: Assumptions | None = None,
    *,
    depth: int | None = None,
    only: Collection[str] | None = None,
    seconds: float = SECONDS,
) -> list[PropertyVerdict]:
    """Decide the properties of a machine, its signals, outcomes, events and waiting times free.

    Args:
        machine: the machine.
        assumptions: what is taken for granted; by default as ``Assumptions`` has it.
        depth: look at runs of so many steps only; by default at all.
        only: names of properties, ``NO_FAULT`` among them; by default all.
        seconds: so much time of the processor for the graph, and again for the properties.
    """
    ready = scripted_machine(machine)
    assumed = assumptions or Assumptions()
    stated = [one for one in ready.model.properties if only is None or one.name in only]
    wanted = [(NO_FAULT, _NO_FAULT_TEXT)] if only is None or NO_FAULT in only else []
    obstacle = unsupported(ready.model)
    if obstacle is not None:
        return [
            PropertyVerdict(*one, Status.UNDECIDED, reason=obstacle)
            for one in (*wanted, *((p.name, p.text) for p in stated))
        ]
    return _Proof(ready, assumed, stated, depth, seconds).verdicts(fault=bool(wanted))


@dataclass(slots=True)
class _Built:
    """A graph, or what stood in its way."""

    graph: Graph | None
    obstacle: str = ""


class _Proof:
    def __init__(
        self, machine: Machine, assumed: Assumptions, stated: Sequence[Property], depth: int | None, seconds: float
    ) -> None:
        self._machine = machine
        self._assumed = assumed
        self._stated = stated
        self._depth = depth
        self._seconds = seconds
        self._longest = round(assumed.longest_tick * 1e9)
        self._parameters = assumed.values(machine.model)
        self._conditions = [one for stated in machine.model.properties for one in conditions_of(stated.claim)]

    def verdicts(self, *, fault: bool) -> list[PropertyVerdict]:
        """One for each property."""
        built = self._graph()
        if built.graph is None:
            names = [(NO_FAULT, _NO_FAULT_TEXT)] if fault else []
            names += [(one.name, one.text) for one in self._stated]
            return [PropertyVerdict(*one, Status.UNDECIDED, reason=built.obstacle) for one in names]
        budget = Budget(self._seconds, LOCATIONS)
        found = [self._no_fault(built.graph, budget)] if fault else []
        return [*found, *(self._decided(built.graph, one, budget) for one in self._stated)]

    def _graph(self) -> _Built:
        """The graph with the finest regions with which it can be had whole; else the one with the finest of all."""
        scopes = [self._machine.indices[one.scope] for one in self._stated if one.scope is not None]
        built, obstacle = None, ""
        for precision in FINEST:
            graph = Graph(
                self._machine,
                list(self._parameters.values()),
                self._conditions,
                scopes,
                events_of(self._machine.model),
                precision=precision,
                not_a_number=self._assumed.not_a_number,
            )
            try:
                graph.build(Budget(self._seconds / len(FINEST), LOCATIONS), self._depth)
            except Undecided as error:
                return _Built(None, str(error))
            except TooMany as error:
                obstacle = str(error)
                continue
            if graph.complete or self._depth is not None:
                return _Built(graph)
            built = built or graph
        return _Built(built, obstacle)

    def _decided(self, graph: Graph, stated: Property, budget: Budget) -> PropertyVerdict:
        """Search without time, then with time, then for runs that meet deadlines exactly."""
        found = None
        if not isinstance(stated.claim, Recurrence | Response):
            found = self._searched(Search(graph, stated, timed=False, longest_tick=self._longest, budget=budget))
        if found is None or found.status is Status.UNDECIDED:
            found = self._searched(Search(graph, stated, timed=True, longest_tick=self._longest, budget=budget))
        if found.status is Status.UNDECIDED:
            exact = Search(graph, stated, timed=True, longest_tick=self._longest, budget=budget, rounding=0)
            shown = self._searched(exact)
            return shown if shown.violated else found
        return found

    def _searched(self, search: Search) -> PropertyVerdict:
        graph, stated = search.graph, search.stated
        replayer = Replayer(graph, self._parameters, self._conditions, self._longest)
        clear: int | None = None
        try:
            for visit in islice(search.violations(), CANDIDATES):
                clear = search.depth if clear is None else clear
                example = replayer.violation(search.path(visit), stated.name)
                if example is not None:
                    return self._violated(stated.name, stated.text, example, search, clear)
        except Undecided as error:
            return PropertyVerdict(stated.name, stated.text, Status.UNDECIDED, reason=str(error))
        states = len(search.visits)
        if clear is not None:
            reason = "a violation that the abstraction shows does not happen on the engine" + self._inexact(graph)
            return PropertyVerdict(
                stated.name, stated.text, Status.UNDECIDED, reason=reason, depth=clear, states=states
            )
        if search.complete and not graph.stepper.failures:
            method = Method.ZONES if search.timed else Method.REACHABILITY
            return PropertyVerdict(stated.name, stated.text, Status.PROVED, method, states=states)
        depth = min(search.depth, graph.depth) if not search.complete else graph.depth
        return self._bounded(stated.name, stated.text, graph, depth, states)

    def _violated(self, name: str, text: str, example: Scenario, search: Search, clear: int) -> PropertyVerdict:
        return PropertyVerdict(
            name, text, Status.VIOLATED, counterexample=example, depth=clear, states=len(search.visits)
        )

    def _bounded(self, name: str, text: str, graph: Graph, depth: int, states: int) -> PropertyVerdict:
        if graph.stepper.failures:
            reason = ", ".join(graph.stepper.failures)
            return PropertyVerdict(name, text, Status.UNDECIDED, reason=reason, depth=depth, states=states)
        reason = "as asked" if self._depth is not None else f"{states} states, and there are more"
        return PropertyVerdict(name, text, Status.BOUNDED, reason=reason, depth=depth, states=states)

    def _no_fault(self, graph: Graph, budget: Budget) -> PropertyVerdict:
        """Whether a guard fails or transitions follow one another without end anywhere."""
        if graph.faults:
            example = next(self._faults(graph, budget), None)
            if example is not None:
                return PropertyVerdict(
                    NO_FAULT, _NO_FAULT_TEXT, Status.VIOLATED, counterexample=example, states=len(graph.locations)
                )
            reason = "a step may fail" + self._inexact(graph)
            return PropertyVerdict(
                NO_FAULT, _NO_FAULT_TEXT, Status.UNDECIDED, reason=reason, states=len(graph.locations)
            )
        if graph.complete and not graph.stepper.failures:
            return PropertyVerdict(
                NO_FAULT, _NO_FAULT_TEXT, Status.PROVED, Method.REACHABILITY, states=len(graph.locations)
            )
        return self._bounded(NO_FAULT, _NO_FAULT_TEXT, graph, graph.depth, len(graph.locations))

    def _faults(self, graph: Graph, budget: Budget) -> Iterator[Scenario]:
        """Runs on the engine that end in a fault."""
        nothing: Any = Never(Literal(value=False, type=BOOLEAN))
        search = Search(graph, Property("", nothing, ""), timed=True, longest_tick=self._longest, budget=budget)
        next(search.violations(), None)
        replayer = Replayer(graph, self._parameters, self._conditions, self._longest)
        for number, due, failure in graph.faults[:CANDIDATES]:
            visits = (one for one in search.visits if one.location == number)
            for visit in islice(visits, CANDIDATES):
                example = replayer.fault(search.path(visit), due, failure, NO_FAULT)
                if example is not None:
                    yield example

    def _inexact(self, graph: Graph) -> str:
        """What of the machine is only followed by and large."""
        what = graph.symbols.followed_roughly()
        return f"; not followed exactly: {', '.join(what[:3])}" if what else ""
