"""What is not read again makes no difference: verdicts are the same with and without it, and places are fewer."""

import pytest

from hsm.dsl import load_model
from hsm.testing.proofs.graph import Budget, Graph, events_of
from hsm.testing.proofs.liveness import Liveness
from hsm.testing.proofs.proving import check
from hsm.testing.proofs.regions import MIDDLE
from hsm.testing.scenarios.script import scripted_machine
from tests.trust.library import make_library
from tests.trust.random_machines import drawn_machine

FLAG = """
machine flagged

event go, back, lose

var steps_made : int = 0
var lost       : bool = false

property few : always steps_made <= 3

state near
    on go if steps_made < 3 -> near / steps_made += 1
    on lose                 -> far  / lost = true
    on go                   -> far

state far
    on back if lost -> near / lost = false, steps_made = 0
"""


def places(text, tmp_path):
    path = tmp_path / "flagged.maze-machine"
    path.write_text(text)
    machine = scripted_machine(load_model(path, make_library()))
    graph = Graph(machine, [], (), events_of(machine.model), precision=MIDDLE)
    graph.build(Budget(20.0, 400))
    return graph


def test_a_variable_is_dead_where_the_way_back_sets_it(tmp_path):
    graph = places(FLAG, tmp_path)
    far = [one for one in graph.locations if one.leaves == (graph.machine.indices["far"],)]
    assert len(far) == 2  # with and without the flag, whatever was counted


def test_a_flag_that_keeps_its_value_excludes_the_way_back(tmp_path):
    text = FLAG.replace(", steps_made = 0", "")
    graph = places(text, tmp_path)
    counts = graph.machine.generator.variables["steps_made"]
    flag = graph.machine.generator.variables["lost"]
    far = [one for one in graph.locations if one.leaves == (graph.machine.indices["far"],)]
    assert len({one.values[counts] for one in far if one.values[flag].value}) == 4
    assert len({one.values[counts] for one in far if not one.values[flag].value}) == 1


def test_what_a_property_reads_is_never_dead(tmp_path):
    path = tmp_path / "flagged.maze-machine"
    path.write_text(FLAG.replace("<= 3\n", "<= 2\n"))
    verdicts = {one.name: one for one in check(load_model(path, make_library()))}
    assert verdicts["few"].violated


@pytest.mark.parametrize("seed", [2, 4, 7, 9])
def test_verdicts_are_the_same_where_all_is_kept(seed, monkeypatch):
    machine = drawn_machine(seed)
    with monkeypatch.context() as patched:
        patched.setattr(Liveness, "buried", lambda _self, _active, values, history: (values, history))
        kept = check(machine, seconds=8)
    for before, now in zip(kept, check(machine, seconds=8), strict=True):
        if before.proved or before.violated:
            assert now.status is before.status, now
