"""The graph of a machine with places taken together that no property of some can tell apart.

What leads from two such places is the same: time-outs that come due, clocks that begin, what the properties make of the
step, and places that are again the same. So a property holds of the smaller graph if and only if it holds of the graph.

Source: Kanellakis and Smolka, "CCS expressions, finite state processes, and three problems of equivalence" (1990).
"""

from __future__ import annotations

from collections.abc import Collection, Hashable, Sequence
from dataclasses import replace

from hsm.engine.machine import Machine
from hsm.model.expressions import SignalValue, VariableValue
from hsm.model.properties import Property, conditions_of
from hsm.model.rewriting import parts_of
from hsm.model.values import dataclass
from hsm.testing.proofs.automata import Automaton, Memory
from hsm.testing.proofs.conditions import Evaluator
from hsm.testing.proofs.graph import Edge, Graph, Location
from hsm.testing.proofs.values import Symbols


@dataclass(frozen=True, slots=True)
class Quotient:
    """A graph of classes of places; each has the number of its class, and the first of its places represents it.

    Attributes:
        machine: the machine.
        symbols: those of the graph.
        evaluator: that of the graph.
        locations: the first location of each class.
        edges: the steps from each class, of those to the same effect one.
        initial: the first steps.
        complete: whether all steps are there.
    """

    machine: Machine
    symbols: Symbols
    evaluator: Evaluator
    locations: Sequence[Location]
    edges: Sequence[Sequence[Edge]]
    initial: Sequence[Edge]
    complete: bool


def only_about_places(stated: Property) -> bool:
    """Whether a property is about active states alone, neither about signals nor about variables."""
    parts = (part for one in conditions_of(stated.claim) for part in parts_of(one))
    return not any(isinstance(part, SignalValue | VariableValue) for part in parts)


def quotient(graph: Graph, automata: Collection[Automaton]) -> Quotient:
    """Take places of a graph together.

    Args:
        graph: with all its steps.
        automata: of the properties that the result is for.
    """
    labels: dict[Hashable, int] = {}
    effects: dict[Hashable, Hashable] = {}
    about_places = all(only_about_places(one.stated) for one in automata)

    def label(edge: Edge) -> int:
        key: Hashable = (edge.point.leaves, edge.point.entered)
        if not about_places:
            key = edge.point, edge.among
        effect = effects.get(key)
        if effect is None:
            effect = effects[key] = tuple(_effect(one, edge) for one in automata)
        own = (edge.due, edge.fresh, edge.beats, edge.point.entered, effect)
        return labels.setdefault(own, len(labels))

    steps = [[(label(edge), edge) for edge in edges] for edges in graph.edges]
    classes = _refined(
        [(one.timers, one.outcome is None) for one in graph.locations],
        [list({(number, edge.target) for number, edge in edges}) for edges in steps],
    )
    firsts = dict(zip(reversed(classes), range(len(classes) - 1, -1, -1), strict=True))

    def lifted(source: int, edges: Sequence[tuple[int, Edge]]) -> list[Edge]:
        distinct = {(number, classes[edge.target], edge.heard): edge for number, edge in reversed(edges)}
        return [replace(edge, source=source, target=target) for (_, target, _), edge in distinct.items()]

    return Quotient(
        graph.machine,
        graph.symbols,
        graph.evaluator,
        [graph.locations[firsts[number]] for number in range(len(firsts))],
        [lifted(number, steps[firsts[number]]) for number in range(len(firsts))],
        lifted(-1, [(label(edge), edge) for edge in graph.initial]),
        graph.complete,
    )


def _effect(automaton: Automaton, edge: Edge) -> Hashable:
    """What a property makes of a step, whatever it remembers."""
    return tuple(
        frozenset((one.memory, one.violated, one.least, one.most, one.restarts) for one in branches)
        for branches in (automaton.branches(memory, edge.point, edge.among) for memory in Memory)
    )


def _refined(kinds: Sequence[Hashable], steps: Sequence[Sequence[tuple[int, int]]]) -> list[int]:
    """The coarsest classes of places of one kind whose steps have the same labels and lead to the same classes."""
    numbers: dict[Hashable, int] = {}
    classes = [numbers.setdefault(one, len(numbers)) for one in kinds]
    count = 0
    while count < len(numbers):
        count, numbers = len(numbers), {}
        classes = [
            numbers.setdefault((own, frozenset((number, classes[target]) for number, target in onward)), len(numbers))
            for own, onward in zip(classes, steps, strict=True)
        ]
    return classes
