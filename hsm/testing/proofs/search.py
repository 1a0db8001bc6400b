"""The search for a violation of one property in the graph of a machine, near the start first.

Without time, any time-out may come due at any step. With time, each place has a zone of its clocks; between two steps
at most the longest tick passes. Steps in which nothing changes are not taken one by one: any time that they can take
passes at once.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from hsm.engine.machine import Machine
from hsm.model.expressions import Expression
from hsm.model.properties import Property
from hsm.testing.proofs.automata import Automaton, Branch, Memory
from hsm.testing.proofs.diagrams import FALSE
from hsm.testing.proofs.graph import Budget, Edge, Graph
from hsm.testing.proofs.points import Timer
from hsm.testing.proofs.values import Truth, Value
from hsm.testing.proofs.zones import PROMISE, Clock, Zone, at_most, less

ROUNDING = 2
"""In nanoseconds: the engine takes a deadline as reached one nanosecond early, and times are rounded to one."""


@dataclass(frozen=True, slots=True)
class Visit:
    """A place that the search has come to.

    Attributes:
        location: number of the location.
        memory: what is remembered of the property.
        zone: what the clocks can be; None without time.
        before: number of the visit before; -1 for none.
        edge: the step that led here.
        branch: how the property went on in it.
        idle: a step in which nothing changes, for the time that passes here; None where there is none.
        repeated: whether the step was taken any number of times, one after the other.
    """

    location: int
    memory: Memory
    zone: Zone | None
    before: int
    edge: Edge
    branch: Branch
    idle: tuple[Edge, Branch] | None = None
    repeated: bool = False


@dataclass(slots=True)
class Search:
    """Looks for violations of one property.

    Attributes:
        graph: of the machine.
        stated: the property.
        timed: whether time counts.
        longest_tick: in nanoseconds.
        rounding: in nanoseconds: so far around a deadline it is left open on which side of it a time falls.
        visits: all places, in the order in which they were found.
        depth: after that many steps no violation was found.
        complete: whether all places were looked at.
    """

    graph: Graph
    stated: Property
    timed: bool
    longest_tick: int
    budget: Budget
    rounding: int = ROUNDING
    visits: list[Visit] = field(default_factory=list)
    depth: int = 0
    complete: bool = False
    _known: dict[tuple[int, Memory], list[Zone | None]] = field(default_factory=dict)
    _truths: dict[tuple[Expression, tuple[int, ...], tuple[Value, ...]], Truth] = field(default_factory=dict)

    def violations(self) -> Iterator[Visit]:
        """Places at which the property is violated, near ones first."""
        machine = self.graph.machine
        scope = None if self.stated.scope is None else machine.indices[self.stated.scope]
        automaton = Automaton(self.stated, scope, self.graph.symbols.diagrams, self._truth)
        for edge in self.graph.initial:
            for branch in self._branches(automaton, automaton.begin(), edge, scope):
                zone = Zone.origin(self._clocks(edge.target, branch.memory)) if self.timed else None
                visit = Visit(edge.target, branch.memory, zone, -1, edge, branch)
                if branch.violated or (branch.least or 0) > 0:
                    if branch.least is None:
                        yield visit
                    continue
                self._add(automaton, scope, visit)
        done = 0
        while done < len(self.visits):
            end = len(self.visits)
            for number in range(done, end):
                if self.budget.spent or self.visits[number].location >= len(self.graph.edges):
                    return
                yield from self._onward(automaton, scope, number)
            done = end
            self.depth += 1
        self.complete = self.graph.complete

    def path(self, visit: Visit) -> list[Visit]:
        """The places on the way to one, the first step's first."""
        way = [visit]
        while way[-1].before >= 0:
            way.append(self.visits[way[-1].before])
        return way[::-1]

    def _onward(self, automaton: Automaton, scope: int | None, number: int) -> Iterator[Visit]:
        visit = self.visits[number]
        later = None
        limits: dict[frozenset[int], Zone | None] = {}
        if visit.zone is not None:
            later = visit.zone.later_by(self.longest_tick)
        for edge in self.graph.edges[visit.location]:
            zone = None
            if later is not None:
                if edge.due not in limits:
                    limits[edge.due] = self._at(later, visit.location, edge.due)
                zone = limits[edge.due]
                if zone is None:
                    continue
            for branch in self._branches(automaton, visit.memory, edge, scope):
                found = self._taken(visit, number, edge, branch, zone)
                if found is None:
                    continue
                if branch.violated:
                    yield found
                self._add(automaton, scope, found)
                if edge.idle and branch.restarts and not branch.violated and visit.memory is branch.memory:
                    self._add(automaton, scope, self._again(visit, number, edge, branch))

    def _taken(self, visit: Visit, number: int, edge: Edge, branch: Branch, zone: Zone | None) -> Visit | None:
        if zone is not None:
            if PROMISE in zone.clocks and (branch.least is not None or branch.most is not None):
                least = None if branch.least is None else at_most(self.rounding - branch.least)
                most = None if branch.most is None else at_most(branch.most + self.rounding)
                limited = zone.limited(PROMISE, least, most)
                if limited is None:
                    return None
                zone = limited
            zone = zone.reset(self._reset(edge, branch), self._clocks(edge.target, branch.memory))
        return Visit(edge.target, branch.memory, zone, number, edge, branch)

    def _again(self, visit: Visit, number: int, edge: Edge, branch: Branch) -> Visit:
        """A step in which only the time of the property begins again, any number of times."""
        assert visit.zone is not None, "only what is timed begins again"
        later = self._at(visit.zone.later(), visit.location, frozenset())
        assert later is not None, "no time at all is some time"
        zone = later.reset({PROMISE}, self._clocks(edge.target, branch.memory))
        return Visit(edge.target, branch.memory, zone, number, edge, branch, repeated=True)

    def _reset(self, edge: Edge, branch: Branch) -> set[Clock]:
        return {*edge.fresh, *((PROMISE,) if branch.restarts else ())}

    def _add(self, automaton: Automaton, scope: int | None, visit: Visit) -> None:
        if visit.zone is not None:
            visit = self._with_idling(automaton, scope, visit)
        known = self._known.setdefault((visit.location, visit.memory), [])
        if visit.zone is None:
            if known:
                return
        elif any(one is not None and one.includes(visit.zone) for one in known):
            return
        else:
            known[:] = [one for one in known if one is not None and not visit.zone.includes(one)]
        known.append(visit.zone)
        self.visits.append(visit)

    def _with_idling(self, automaton: Automaton, scope: int | None, visit: Visit) -> Visit:
        """The place with all the time that may pass in it while nothing changes."""
        assert visit.zone is not None
        if visit.location >= len(self.graph.edges):
            return visit
        for edge in self.graph.edges[visit.location]:
            if not edge.idle:
                continue
            for branch in self._branches(automaton, visit.memory, edge, scope):
                if branch.memory is visit.memory and not (branch.restarts or branch.violated):
                    later = self._at(visit.zone.later(), visit.location, frozenset())
                    if later is not None and PROMISE in later.clocks and branch.most is not None:
                        later = later.limited(PROMISE, None, at_most(branch.most + self.rounding))
                    if later is not None:
                        return Visit(
                            visit.location, visit.memory, later, visit.before, visit.edge, visit.branch,
                            (edge, branch), visit.repeated,
                        )  # fmt: skip
        return visit

    def _at(self, zone: Zone, location: int, due: frozenset[int]) -> Zone | None:
        """Where some time-outs come due at a step, and others do not."""
        found: Zone | None = zone
        for timer in self._running(location):
            clock = self._clock(timer)
            if found is None:
                return None
            if timer.transition in due:
                found = found.limited(clock, at_most(self.rounding - timer.least), None)
            else:
                found = found.limited(clock, None, less(timer.most))
        return found

    def _running(self, location: int) -> Iterator[Timer]:
        return (one for one in self.graph.locations[location].timers if not one.due)

    def _clock(self, timer: Timer) -> Clock:
        return self.graph.machine.model.transitions[timer.transition].source

    def _clocks(self, location: int, memory: Memory) -> tuple[Clock, ...]:
        clocks = {self._clock(one) for one in self._running(location)}
        if memory is Memory.WAITING:
            clocks.add(PROMISE)
        return tuple(sorted(clocks))

    def _branches(self, automaton: Automaton, memory: Memory, edge: Edge, scope: int | None) -> list[Branch]:
        active = scope is None or scope in self._configuration(edge.point.leaves)
        return [one for one in automaton.branches(memory, edge, active=active) if one.among != FALSE]

    def _truth(self, condition: Expression, edge: Edge) -> Truth:
        key = (condition, edge.point.leaves, edge.point.values)
        found = self._truths.get(key)
        if found is None:
            evaluator = self.graph.evaluator.at(edge.point.values, self._configuration(edge.point.leaves))
            found = self._truths[key] = evaluator.truth(condition)
        return found

    def _configuration(self, leaves: tuple[int, ...]) -> frozenset[int]:
        machine: Machine = self.graph.machine
        return machine.configuration(leaves).active
