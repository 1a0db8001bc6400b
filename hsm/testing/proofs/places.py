"""All places within the steps of a machine, where a proof can list them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from hsm.engine.machine import Machine
from hsm.model.values import dataclass
from hsm.testing.proofs.diagrams import Diagram, TooMany
from hsm.testing.proofs.graph import Budget, Graph, events_of, unsupported
from hsm.testing.proofs.points import Place
from hsm.testing.proofs.regions import MIDDLE
from hsm.testing.proofs.values import NoRun, Undecided

SECONDS = 30.0
"""The limit of processor time for the places of a machine."""

LOCATIONS = 20_000


@dataclass(frozen=True, slots=True)
class ReachedPlaces:
    """All places that a machine can come to, each with the signals that lead there."""

    graph: Graph
    reached: dict[Place, Diagram]

    @property
    def resting(self) -> frozenset[int]:
        """The states that are active between two steps."""
        configuration = self.graph.machine.configuration
        return frozenset(
            state for one in self.graph.locations if one.outcome is None for state in configuration(one.leaves).active
        )


def reached_places(machine: Machine, parameters: Sequence[Any]) -> ReachedPlaces | None:
    """The places of a machine; None where not all are known.

    Args:
        machine: the machine, scripted.
        parameters: their values, in order; ``FREE`` for one that may have any.
    """
    if unsupported(machine.model) is not None:
        return None
    reached: dict[Place, Diagram] = {}
    try:
        graph = Graph(machine, parameters, [], events_of(machine.model), precision=MIDDLE, forgetful=False)
        graph.stepper.reached = reached
        graph.build(Budget(SECONDS, LOCATIONS))
    except (NoRun, Undecided, TooMany):
        return None
    return ReachedPlaces(graph, reached) if graph.complete and not graph.failures else None
