"""Places taken together: what holds of the smaller graph holds of the graph, and the other way round."""

import pytest

from hsm.model.properties import Recurrence, Response
from hsm.testing.proofs.automata import Automaton
from hsm.testing.proofs.graph import Budget, Graph, events_of
from hsm.testing.proofs.quotient import quotient
from hsm.testing.proofs.regions import MIDDLE
from hsm.testing.proofs.search import Search
from hsm.testing.scenarios.script import scripted_machine
from tests.trust.random_machines import drawn_machine

LONGEST = 100_000_000


def built(machine):
    model = machine.model
    defaults = [one.default for one in model.parameters]
    graph = Graph(machine, defaults, model.properties, events_of(model), precision=MIDDLE)
    graph.build(Budget(20.0, 400))
    return graph


def violated(graph, stated, *, timed):
    search = Search(graph, stated, timed=timed, longest_tick=LONGEST, budget=Budget(5.0, 20_000))
    found = next(search.violations(), None) is not None
    return found or (None if not search.complete else False)


@pytest.mark.parametrize("seed", [0, 1, 2, 4, 9, 10, 13, 17, 21, 24])
def test_properties_hold_of_the_smaller_graph_where_they_hold_of_the_graph(seed):
    machine = scripted_machine(drawn_machine(seed))
    graph = built(machine)
    if not graph.complete:
        pytest.skip("not all of it was built")
    for stated in machine.model.properties:
        smaller = quotient(graph, [Automaton(stated, machine, graph.evaluator)])
        assert len(smaller.locations) <= len(graph.locations)
        for timed in (True,) if isinstance(stated.claim, Recurrence | Response) else (False, True):
            assert violated(smaller, stated, timed=timed) is violated(graph, stated, timed=timed)
