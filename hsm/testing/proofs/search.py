"""A breadth-first search for a violation of one property in the graph of a machine.

Without time, any time-out may come due at any step. With time, each place has a zone of its clocks; between two steps
at most the longest tick passes. Steps in which nothing changes are accelerated: any time that they can take passes at
once.
"""

from __future__ import annotations

from collections.abc import Generator, Hashable, Iterable, Iterator
from dataclasses import field, replace

from hsm.model.properties import Property
from hsm.model.values import dataclass
from hsm.testing.proofs.automata import Automaton, Branch, Memory
from hsm.testing.proofs.graph import Budget, Edge, Graph
from hsm.testing.proofs.points import Timer
from hsm.testing.proofs.quotient import Quotient
from hsm.testing.proofs.zones import PROMISE, ROUNDING, Clock, Zone, at_most, less


@dataclass(frozen=True, slots=True)
class Visit:
    """A visited place of the search.

    Attributes:
        location: number of the location.
        memory: the memory of the property.
        zone: the possible clock values; None without time.
        before: number of the previous visit; -1 for none.
        edge: the step that led here.
        branch: how the property continued in it.
        idle: a step in which nothing changes, for the time that passes here; None if there is none.
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


@dataclass(frozen=True, slots=True)
class _Move:
    """A step with a way for the property to continue.

    Attributes:
        edge: the step.
        branch: how the property continues.
        reset: the clocks that begin again.
        clocks: those that run afterwards.
    """

    edge: Edge
    branch: Branch
    reset: frozenset[Clock]
    clocks: tuple[Clock, ...]


@dataclass(frozen=True, slots=True)
class _Moves:
    """What can happen at a place.

    Attributes:
        all: the moves.
        idle: those in which neither the machine nor what is remembered of the property changes.
    """

    all: list[_Move]
    idle: list[_Move]


@dataclass(slots=True)
class Search:
    """Looks for violations of one property.

    Attributes:
        graph: of the machine.
        stated: the property.
        timed: whether time counts.
        longest_tick: in nanoseconds.
        rounding: in nanoseconds: within this distance of a deadline, both sides are considered.
        visits: all places, in the order in which they were found.
        depth: after that many steps no violation was found.
        complete: whether all places were examined.
    """

    graph: Graph | Quotient
    stated: Property
    timed: bool
    longest_tick: int
    budget: Budget
    rounding: int = ROUNDING
    visits: list[Visit] = field(default_factory=list)
    depth: int = 0
    complete: bool = False
    _known: dict[tuple[int, Memory], list[Zone | None]] = field(default_factory=dict)
    _known_moves: dict[tuple[int, Memory], _Moves] = field(default_factory=dict)
    _clocks_of: dict[tuple[int, Memory], tuple[Clock, ...]] = field(default_factory=dict)
    _automaton: Automaton = field(init=False)

    def violations(self) -> Iterator[Visit]:
        """Places at which the property is violated, near ones first.

        Runs whose first step receives an event come last, because no scenario can show them; most of their places are
        known by then.
        """
        self._automaton = Automaton(self.stated, self.graph.machine, self.graph.evaluator)
        depths = []
        for heard in (False, True):
            done = len(self.visits)
            yield from self._begun([one for one in self.graph.initial if one.heard is heard])
            depths.append((yield from self._followed(done)))
        self.complete = self.graph.complete and depths == [None, None]
        self.depth = min((one for one in depths if one is not None), default=self.depth)

    def _begun(self, edges: Iterable[Edge]) -> Iterator[Visit]:
        """The first steps."""
        begun = self._automaton.begin()
        for edge in edges:
            for branch in self._automaton.branches(begun, edge.point, edge.among):
                zone = Zone.origin(self._clocks(edge.target, branch.memory)) if self.timed else None
                visit = Visit(edge.target, branch.memory, zone, -1, edge, branch)
                if branch.violated or (branch.least or 0) > 0:
                    if branch.least is None:
                        yield visit
                    continue
                self._add(visit)

    def _followed(self, done: int) -> Generator[Visit, None, int | None]:
        """Continue from all places from one on; returns the depth that was reached, None where nothing is left."""
        depth = 0
        while done < len(self.visits):
            end = len(self.visits)
            for number in range(done, end):
                if self.budget.spent or self.visits[number].location >= len(self.graph.edges):
                    return depth
                yield from self._onward(number)
            done = end
            depth += 1
            self.depth = max(self.depth, depth)
        return None

    def path(self, visit: Visit) -> list[Visit]:
        """The places on the way to one, the first step's first."""
        way = [visit]
        while way[-1].before >= 0:
            way.append(self.visits[way[-1].before])
        return way[::-1]

    def _onward(self, number: int) -> Iterator[Visit]:
        visit = self.visits[number]
        later = None
        limits: dict[frozenset[int], Zone | None] = {}
        if visit.zone is not None:
            later = visit.zone.later_by(self.longest_tick + self.rounding)
        for move in self._moves(visit.location, visit.memory).all:
            zone = None
            if later is not None:
                due = move.edge.due
                if due not in limits:
                    limits[due] = self._at(later, visit.location, due)
                zone = limits[due]
                if zone is None:
                    continue
            found = self._taken(number, move, zone)
            if found is None:
                continue
            if move.branch.violated:
                yield found
            self._add(found)
            if move.edge.idle and move.branch.restarts and not move.branch.violated and visit.memory is found.memory:
                self._add(self._again(visit, number, move))

    def _moves(self, location: int, memory: Memory) -> _Moves:
        """The steps from a location, each with a way for the property to continue; of those to the same effect one."""
        key = (location, memory)
        found = self._known_moves.get(key)
        if found is None:
            distinct: dict[Hashable, _Move] = {}
            for edge in self.graph.edges[location]:
                for branch in self._automaton.branches(memory, edge.point, edge.among):
                    reset = frozenset((*edge.fresh, *((PROMISE,) if branch.restarts else ())))
                    move = _Move(edge, branch, reset, self._clocks(edge.target, branch.memory))
                    effect = (branch.memory, branch.least, branch.most, branch.restarts)
                    same = (edge.target, edge.due, edge.fresh, edge.beats, edge.idle, effect)
                    distinct.setdefault((edge.among, branch.among, len(distinct)) if branch.violated else same, move)
            moves = list(distinct.values())
            idle = [
                one
                for one in moves
                if one.edge.idle and one.branch.memory is memory and not (one.branch.restarts or one.branch.violated)
            ]
            found = self._known_moves[key] = _Moves(moves, idle)
        return found

    def _taken(self, number: int, move: _Move, zone: Zone | None) -> Visit | None:
        edge, branch = move.edge, move.branch
        if zone is not None:
            if PROMISE in zone.clocks and (branch.least is not None or branch.most is not None):
                least = None if branch.least is None else at_most(self.rounding - branch.least)
                most = None if branch.most is None else at_most(branch.most + self.rounding)
                limited = zone.limited(PROMISE, least, most)
                if limited is None:
                    return None
                zone = limited
            zone = self._beaten(zone, edge).reset(move.reset, move.clocks)
        return Visit(edge.target, branch.memory, zone, number, edge, branch)

    def _beaten(self, zone: Zone, edge: Edge) -> Zone:
        """Where what is repeated continues: its clock counts from the time that has come, not from the step."""
        before = {one.transition: one for one in self.graph.locations[edge.source].timers} if edge.beats else {}
        for timer in edge.beats:
            due = before[timer.transition]
            known = due.least == due.most and timer.least == timer.most
            if known and timer.transition in edge.due and self.longest_tick + 2 * self.rounding < timer.least:
                zone = zone.back(timer.clock, due.least)
            else:
                zone = zone.anywhere(timer.clock, -self.rounding, timer.most)
        return zone

    def _again(self, visit: Visit, number: int, move: _Move) -> Visit:
        """A step in which only the time of the property begins again, any number of times."""
        assert visit.zone is not None, "only what is timed begins again"
        later = self._at(visit.zone.later(), visit.location, frozenset())
        assert later is not None, "zero is a possible time"
        zone = later.reset({PROMISE}, move.clocks)
        return Visit(move.edge.target, move.branch.memory, zone, number, move.edge, move.branch, repeated=True)

    def _add(self, visit: Visit) -> None:
        known = self._known.setdefault((visit.location, visit.memory), [])
        if visit.zone is None:
            if known:
                return
        elif any(one is not None and one.includes(visit.zone) for one in known):
            return  # what is known has all the time that may pass in it, so it includes that of this one, too
        else:
            visit = self._with_idling(visit)
            assert visit.zone is not None, "time passes where there are clocks"
            known[:] = [one for one in known if one is not None and not visit.zone.includes(one)]
        known.append(visit.zone)
        self.visits.append(visit)

    def _with_idling(self, visit: Visit) -> Visit:
        """The place with all the time that may pass in it while nothing changes."""
        assert visit.zone is not None
        if visit.location >= len(self.graph.edges):
            return visit
        for move in self._moves(visit.location, visit.memory).idle:
            edge, branch = move.edge, move.branch
            later = self._at(visit.zone.later(), visit.location, frozenset())
            if later is not None and PROMISE in later.clocks and branch.most is not None:
                later = later.limited(PROMISE, None, at_most(branch.most + self.rounding))
            if later is not None and later.includes(visit.zone):
                return replace(visit, zone=later, idle=(edge, branch))
        return visit

    def _at(self, zone: Zone, location: int, due: frozenset[int]) -> Zone | None:
        """Where some time-outs come due at a step, and others do not."""
        found: Zone | None = zone
        for timer in self._running(location):
            clock = timer.clock
            if found is None:
                return None
            if timer.transition in due:
                found = found.limited(clock, at_most(self.rounding - timer.least), None)
            else:
                found = found.limited(clock, None, less(timer.most))
        return found

    def _running(self, location: int) -> Iterator[Timer]:
        return (one for one in self.graph.locations[location].timers if not one.due)

    def _clocks(self, location: int, memory: Memory) -> tuple[Clock, ...]:
        found = self._clocks_of.get((location, memory))
        if found is None:
            clocks = {one.clock for one in self._running(location)}
            if memory is Memory.WAITING:
                clocks.add(PROMISE)
            found = self._clocks_of[location, memory] = tuple(sorted(clocks))
        return found
