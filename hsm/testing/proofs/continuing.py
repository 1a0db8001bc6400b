"""Whether runs go on: assumptions may leave no run that lasts, although each step alone is possible.

A run lasts if it ends in a final state, or takes steps for ever while time passes. In the latter case it stays in one
strongly connected part of the graph from some step on, and no time-out or deadline runs for ever within that part: each
one comes due, begins again, or is given up. Where no such part can be reached, no run lasts. Parts that fulfil this may
still have no run with matching times; so the answer that some run lasts is not a proof.

Source: Tarjan, "Depth-first search and linear graph algorithms" (1972).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from hsm.testing.proofs.graph import Edge, Graph, Location
from hsm.testing.proofs.points import NEVER, Timer
from hsm.testing.proofs.values import NoRun


def ending(graph: Graph) -> frozenset[int]:
    """The locations from which no run that satisfies the assumptions lasts, where all locations are known.

    Raises:
        NoRun: it is so from the start.
    """
    if not graph.complete or not graph.machine.model.assumptions:
        return frozenset()
    found = _ending(graph.locations, graph.edges)
    if all(one.target in found for one in graph.initial):
        raise NoRun("no complete run satisfies the assumptions")
    return found


def _ending(locations: Sequence[Location], edges: Sequence[Sequence[Edge]]) -> frozenset[int]:
    lasting = {number for number, one in enumerate(locations) if one.outcome is not None}
    for part in _parts(edges):
        if not lasting.isdisjoint(part) or _lasts(part, locations, edges):
            lasting |= part
    before: dict[int, list[int]] = {}
    for some in edges:
        for edge in some:
            before.setdefault(edge.target, []).append(edge.source)
    pending = list(lasting)
    while pending:
        for number in before.get(pending.pop(), ()):
            if number not in lasting:
                lasting.add(number)
                pending.append(number)
    return frozenset(range(len(locations))) - lasting


def _lasts(part: set[int], locations: Sequence[Location], edges: Sequence[Sequence[Edge]]) -> bool:
    """Whether a run may stay in a strongly connected part."""
    inside = [edge for number in part for edge in edges[number] if edge.target in part]
    if not inside:
        return False
    some = next(iter(part))
    return not any(_runs_for_ever(timer, part, inside, locations) for timer in locations[some].timers)


def _runs_for_ever(timer: Timer, part: set[int], inside: Sequence[Edge], locations: Sequence[Location]) -> bool:
    """Whether a time-out of one location runs on in every location and through every step of a part."""
    if timer.due or timer.most >= NEVER:
        return False
    same = all(
        any(one.transition == timer.transition and not one.due for one in locations[number].timers) for number in part
    )
    return same and not any(
        timer.transition in edge.due or timer.clock in edge.fresh or any(one.clock == timer.clock for one in edge.beats)
        for edge in inside
    )


def _parts(edges: Sequence[Sequence[Edge]]) -> Iterator[set[int]]:
    """The strongly connected parts, each after those that it leads to."""
    order: dict[int, int] = {}
    lowest: dict[int, int] = {}
    stack: list[int] = []
    done: set[int] = set()
    for root in range(len(edges)):
        way = [] if root in order else [root]
        targets: dict[int, Iterator[int]] = {}
        while way:
            number = way[-1]
            if number not in order:
                order[number] = lowest[number] = len(order)
                stack.append(number)
                targets[number] = iter([one.target for one in edges[number]])
            target = next((one for one in targets[number] if one not in done), None)
            if target is None:
                way.pop()
                if way:
                    lowest[way[-1]] = min(lowest[way[-1]], lowest[number])
                if lowest[number] == order[number]:
                    begin = stack.index(number)
                    yield set(stack[begin:])
                    done.update(stack[begin:])
                    del stack[begin:]
            elif target in order:
                lowest[number] = min(lowest[number], order[target])
            else:
                way.append(target)
