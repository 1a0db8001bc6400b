"""Regions that do not depend on one another are decided without the others, and those that do are not."""

import pytest

from hsm.dsl import load_model
from hsm.testing.proofs import proving
from hsm.testing.proofs.proving import check
from hsm.testing.proofs.slices import Slice, slices
from hsm.testing.proofs.verdicts import NO_FAULT
from tests.trust.library import make_library
from tests.trust.random_machines import drawn_machine
from tests.trust.regions import regions_text, replayed

SHARED = """machine m

event go

{stated}

{variables}
initial both

parallel both
{around}
    state one
        initial a
        state a
            do rotate(90 deg)
            {first}
        state b
            stay
    state two
        initial c
        state c
            {second}
        state d
            stay
state away
    stay
"""


def loaded(tmp_path, text):
    path = tmp_path / "m.maze-machine"
    path.write_text(text)
    return load_model(path, make_library())


def shared(tmp_path, stated, first, second, *, around="", variables=""):
    text = SHARED.format(stated=stated, first=first, second=second, around=around, variables=variables)
    return loaded(tmp_path, text)


def test_six_regions_are_decided_one_by_one(tmp_path):
    model = loaded(tmp_path, regions_text(6))
    found = check(model)
    assert all(one.proved for one in found)
    assert sum(one.states for one in found if one.name == NO_FAULT) == 24


def test_a_violation_in_one_region_is_shown_on_the_whole_machine(tmp_path):
    model = loaded(tmp_path, regions_text(6).replace("within 3 s", "within 1 s"))
    found = {one.name: one for one in check(model)}
    assert found["soon"].violated
    assert replayed(model, found["soon"])


@pytest.mark.parametrize(
    ("first", "second", "around", "variables"),
    [
        ("when door.near -> b", "when in(b) -> d", "", ""),
        ("when door.near -> b / n = 1", "when n > 0 -> d", "", "var n : int = 0\n"),
        ("when door.near -> b / raise go", "on go -> d", "", ""),
        ("when door.near -> b / raise go after 1 s", "on go -> d", "", ""),
    ],
)
def test_a_region_that_another_depends_on_is_kept(tmp_path, first, second, around, variables):
    model = shared(tmp_path, "property never_d : never in(d)", first, second, around=around, variables=variables)
    (only,) = slices(model, model.properties)
    assert only.model is model
    (verdict,) = check(model, only={"never_d"})
    assert verdict.violated


@pytest.mark.parametrize(
    ("first", "around"),
    [
        ("on done -> b", "    on done, blocked -> away"),  # what is around hears the outcome
        ("on go -> a", "    on go -> away"),  # the region takes the event from what is around it
        ("on go -> a", "    on * -> away"),
        ("when door.near -> away", ""),  # it ends the others
        ("when door.near -> both", ""),
    ],
)
def test_a_region_that_what_is_around_depends_on_is_kept(tmp_path, first, around):
    model = shared(tmp_path, "property calm : never in(d) and in(c)", first, "when door.open -> d", around=around)
    for one in slices(model, model.properties):
        states = {state.name: state for state in one.model.states}
        assert states["a"].transitions


@pytest.mark.parametrize("seed", [3, 45, 55, 79])
def test_verdicts_are_those_of_the_whole(seed, monkeypatch):
    machine = drawn_machine(seed)
    found = check(machine, seconds=6)
    monkeypatch.setattr(proving, "slices", lambda model, stated: [Slice(model, stated)])
    for one, whole in zip(found, check(machine, seconds=6), strict=True):
        assert (one.name, one.proved, one.violated) == (whole.name, whole.proved, whole.violated)
