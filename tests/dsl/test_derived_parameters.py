"""Parameters that are made of others: what follows from given ones in a machine, an instance, a proof and SCXML."""

import pytest

import hsm
from hsm.dsl import check_text
from hsm.interchange.scxml.writer import write_text
from hsm.model.types import Length
from hsm.testing.proofs.graph import FREE
from hsm.testing.proofs.verdicts import Assumptions

LIBRARY = hsm.Library("lengths")


@LIBRARY.signal("ahead")
def ahead(facts: float) -> Length:
    """How far the way ahead is free."""
    return facts


DOOR = """machine door
param a : length = 1 m
param b : length = 2 * a
param c : length = b + a
initial shut
state shut
    when ahead > c -> open
final open
"""
HOUSE = """machine house
import door
param width : length = 2 m
initial front
state front = door(a = width)
    on open -> back
state back = door(b = 10 m)
    on open -> over
final over
"""


@pytest.fixture
def loaded(tmp_path):
    (tmp_path / "door.maze-machine").write_text(DOOR)
    (tmp_path / "house.maze-machine").write_text(HOUSE)
    return lambda name: hsm.load(tmp_path / f"{name}.maze-machine", LIBRARY)


@pytest.mark.parametrize(
    ("given", "follows"),
    [({}, (1, 2, 3)), ({"a": 2.0}, (2, 4, 6)), ({"b": 5.0}, (1, 5, 6)), ({"a": 2.0, "c": 1.0}, (2, 4, 1))],
)
def test_what_is_not_given_follows_from_what_is(loaded, given, follows):
    assert tuple(loaded("door").start(given, facts=0.0).variables.values()) == follows


def test_an_instance_derives_from_its_own_arguments(loaded):
    run = loaded("house").start(facts=0.0)
    known = run.variables
    assert [known[f"front.{name}"] for name in "abc"] == [2.0, 4.0, 6.0]
    run.step(1.0, facts=7.0)
    known = run.variables
    assert [known[f"back.{name}"] for name in "abc"] == [1.0, 10.0, 11.0]


def test_what_is_made_of_a_free_parameter_is_free(loaded):
    model = loaded("door").model
    assert Assumptions().values(model) == {"a": 1.0, "b": 2.0, "c": 3.0}
    assert Assumptions(parameters={"a": 4.0}).values(model) == {"a": 4.0, "b": 8.0, "c": 12.0}
    assert Assumptions(free=frozenset({"a"})).values(model) == {"a": FREE, "b": FREE, "c": FREE}
    free = Assumptions(free=frozenset({"a"}), parameters={"b": 4.0}).values(model)
    assert free == {"a": FREE, "b": 4.0, "c": FREE}


def test_a_value_that_it_cannot_hold_is_refused(loaded):
    with pytest.raises(ValueError, match="parameter `b` cannot hold inf"):
        loaded("door").start({"a": 1.5e308}, facts=0.0)


@pytest.mark.parametrize(
    ("lines", "found"),
    [
        ("param a : length = 2 * b\nparam b : length = a", [("E0303", "`a` depends on itself")]),
        ("param a : length = 2 * a", [("E0303", "`a` depends on itself")]),
        (
            "param a : length = 2 * b\nparam b : length = 1 m",
            [("E0303", "`a` depends on `b`, which is declared below it")],
        ),
        ("param b : length\nparam a : length = 2 * b", [("E0303", "`a` depends on `b`, which has no default itself")]),
        ("param b : number = 0\nparam a : length = 1 m / b", [("E0306", "parameter `a` divides by zero")]),
        ("param b : length = 1 m\nparam a : speed = 2 * b", [("E0301", None)]),
        ("param a : length = 2 * ahead", [("E0303", "`a` needs an initial value made of constants and parameters")]),
    ],
)
def test_what_cannot_be_is_said_once(lines, found):
    text = f"machine m\n{lines}\ninitial s\nstate s\n    when ahead > 1 m -> t\nfinal t\n"
    said = [(one.code, one.message) for one in check_text(text, LIBRARY).diagnostics if one.code.startswith("E")]
    assert [code for code, _ in said] == [code for code, _ in found]
    assert all(wanted in (None, message) for (_, message), (_, wanted) in zip(said, found, strict=True))


def test_it_is_written_to_scxml_as_what_it_is_made_of(loaded):
    assert '<data id="b" expr="2 * a"' in write_text(loaded("door").model)
