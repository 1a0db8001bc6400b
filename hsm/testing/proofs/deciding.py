"""Decides the properties of a machine on one graph: proved, violated by a run on the engine, or undecided."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import field
from itertools import islice
from typing import Any

from hsm.model.expressions import Literal
from hsm.model.properties import Never, Property, Recurrence, Response
from hsm.model.types import BOOLEAN
from hsm.model.values import dataclass
from hsm.testing.proofs.automata import Automaton
from hsm.testing.proofs.graph import Budget, Graph
from hsm.testing.proofs.quotient import Quotient, only_about_places, quotient
from hsm.testing.proofs.search import Search
from hsm.testing.proofs.values import Undecided
from hsm.testing.proofs.verdicts import NO_FAULT, Method, PropertyVerdict, Status
from hsm.testing.proofs.witness import Replayer
from hsm.testing.scenarios.scenarios import Scenario

CANDIDATES = 12
"""At most this many paths to a violation are tried on the engine, the shortest first."""

NO_FAULT_TEXT = "no guard, assignment or duration fails, no endless sequence of transitions"


@dataclass(frozen=True, slots=True)
class Decider:
    """Decides properties on a graph.

    Attributes:
        graph: of the machine.
        replayer: makes runs from paths through it.
        longest_tick: in nanoseconds.
        budget: for all properties together.
        stated: all properties of the machine.
        asked: whether the graph was limited to a depth on request.
        ending: the locations from which no run that satisfies the assumptions lasts.
        quotients: smaller graphs, each by the names of the properties that it is for.
    """

    graph: Graph
    replayer: Replayer
    longest_tick: int
    budget: Budget
    stated: Sequence[Property]
    asked: bool
    ending: frozenset[int] = frozenset()
    quotients: dict[tuple[str, ...], Quotient] = field(default_factory=dict)

    def decided(self, stated: Property) -> PropertyVerdict:
        """Search without time, then with time, then for runs that meet deadlines exactly.

        What holds is found on a smaller graph; what does not is shown by a way through the whole one.
        """
        found = self._proved(stated)
        if found is not None:
            return found
        if not isinstance(stated.claim, Recurrence | Response):
            found = self._searched(stated, self._search(stated, timed=False))
        if found is None or found.status is Status.UNDECIDED:
            found = self._searched(stated, self._search(stated, timed=True))
        if found.status is Status.UNDECIDED:
            exact = self._search(stated, timed=True)
            exact.rounding = 0
            shown = self._searched(stated, exact)
            return shown if shown.violated else found
        return found

    def without_fault(self) -> PropertyVerdict:
        """Whether a step fails anywhere."""
        graph, states = self.graph, len(self.graph.locations)
        if graph.faults:
            example = next(self._faults(), None)
            if example is not None:
                return PropertyVerdict(NO_FAULT, NO_FAULT_TEXT, Status.VIOLATED, counterexample=example, states=states)
            reason = "a step may fail" + self._inexact()
            return PropertyVerdict(NO_FAULT, NO_FAULT_TEXT, Status.UNDECIDED, reason=reason, states=states)
        if graph.complete and not graph.failures:
            return PropertyVerdict(NO_FAULT, NO_FAULT_TEXT, Status.PROVED, Method.REACHABILITY, states=states)
        return self._bounded(NO_FAULT, NO_FAULT_TEXT, graph.depth, states)

    def _search(self, stated: Property, *, timed: bool, among: Graph | Quotient | None = None) -> Search:
        return Search(among or self.graph, stated, timed=timed, longest_tick=self.longest_tick, budget=self.budget)

    def _proved(self, stated: Property) -> PropertyVerdict | None:
        """The verdict on a property that holds; None where it does not, or that is not found out."""
        if not self.graph.complete or self.graph.failures:
            return None
        try:
            smaller = self._smaller(stated)
            untimed = () if isinstance(stated.claim, Recurrence | Response) else (False,)
            for timed in (*untimed, True):
                search = self._search(stated, timed=timed, among=smaller)
                if next(search.violations(), None) is None and search.complete and not self.graph.failures:
                    method = Method.ZONES if timed else Method.REACHABILITY
                    states = len(search.visits if timed else self.graph.locations)
                    reason = self._ending()
                    return PropertyVerdict(stated.name, stated.text, Status.PROVED, method, reason, states=states)
        except Undecided as error:
            return PropertyVerdict(stated.name, stated.text, Status.UNDECIDED, reason=str(error))
        return None

    def _smaller(self, stated: Property) -> Quotient:
        """The graph with places taken together for a property; properties that are about states alone share one."""
        together = [one for one in self.stated if only_about_places(one)] if only_about_places(stated) else [stated]
        key = tuple(one.name for one in together)
        found = self.quotients.get(key)
        if found is None:
            automata = [Automaton(one, self.graph.machine, self.graph.evaluator) for one in together]
            found = self.quotients[key] = quotient(self.graph, automata)
        return found

    def _searched(self, stated: Property, search: Search) -> PropertyVerdict:
        clear: int | None = None
        name, text = stated.name, stated.text
        try:
            for visit in islice(search.violations(), CANDIDATES):
                clear = search.depth if clear is None else clear
                example = self.replayer.violation(search.path(visit), name)
                if example is not None:
                    states = len(search.visits)
                    return PropertyVerdict(
                        name, text, Status.VIOLATED, counterexample=example, depth=clear, states=states
                    )
        except Undecided as error:
            return PropertyVerdict(name, text, Status.UNDECIDED, reason=str(error))
        states = len(search.visits)
        if clear is not None:
            reason = "a violation of the abstraction does not happen on the engine" + self._inexact()
            return PropertyVerdict(name, text, Status.UNDECIDED, reason=reason, depth=clear, states=states)
        if search.complete and not self.graph.failures:
            method = Method.ZONES if search.timed else Method.REACHABILITY
            return PropertyVerdict(name, text, Status.PROVED, method, self._ending(), states=states)
        depth = self.graph.depth if search.complete else min(search.depth, self.graph.depth)
        return self._bounded(name, text, depth, states)

    def _bounded(self, name: str, text: str, depth: int, states: int) -> PropertyVerdict:
        if self.graph.failures:
            reason = ", ".join(self.graph.failures)
            return PropertyVerdict(name, text, Status.UNDECIDED, reason=reason, depth=depth, states=states)
        reason = "as asked" if self.asked else f"{states} states, and there are more"
        return PropertyVerdict(name, text, Status.BOUNDED, reason=reason, depth=depth, states=states)

    def _faults(self) -> Iterator[Scenario]:
        """Runs on the engine that end in a fault."""
        nothing: Any = Never(Literal(value=False, type=BOOLEAN))
        search = self._search(Property("", nothing, ""), timed=True)
        next(search.violations(), None)
        shown = (one for one in self.graph.faults if one[0] >= 0)  # a scenario begins after the first step
        for number, due, failure in islice(shown, CANDIDATES):
            visits = (one for one in search.visits if one.location == number)
            for visit in islice(visits, CANDIDATES):
                example = self.replayer.fault(search.path(visit), due, failure, NO_FAULT)
                if example is not None:
                    yield example

    def _ending(self) -> str:
        """Where assumptions leave no run that lasts; empty if there is no such place."""
        if not self.ending:
            return ""
        states = self.graph.machine.model.states
        leaves = self.graph.locations[min(self.ending)].leaves
        return f"the assumptions allow no complete run after {', '.join(states[one].name for one in leaves)} on"

    def _inexact(self) -> str:
        """The parts of the machine that are abstracted."""
        what = self.graph.symbols.followed_roughly()
        return f"; abstracted: {', '.join(what[:3])}" if what else ""
