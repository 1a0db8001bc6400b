"""Overlaps and gaps of `when` lines, and states that no step ends in, decided on the graph of the whole machine."""

from hsm.dsl import check_text
from hsm.testing.proofs.proving import examine
from hsm.testing.proofs.tables import tables
from tests.trust.library import make_library

LIBRARY = make_library()


def notes(text):
    """The codes and lines of notes about tables: those of the checks, and those that some step confirms."""
    checked = check_text(text, LIBRARY)
    found = [one for one in checked.diagnostics if one.code in ("N0701", "N0702")]
    kept = list(tables(checked.model).confirmed(found, checked.model))
    return [{(one.code, one.place.line) for one in some} for some in (found, kept)]


def test_conditions_about_another_region_never_hold_together():
    text = """machine m
parallel both
    state one
        initial a
        state a
            when in(x) and space.front -> b
            when in(y) and space.front -> c
            when in(x) and not space.front -> c
            when in(y) and not space.front -> b
        state b
            on go -> a
        state c
            on go -> a
    state two
        initial x
        state x
            on back -> y
        state y
            on back -> x
event go, back
"""
    found, kept = notes(text)
    assert {code for code, _ in found} == {"N0701", "N0702"}
    assert not kept


VALUES = """machine m
event go
var n : int = {first}
initial a
state a
    when n > 0 and space.left -> b
    when n < 5 and space.left -> c
    on go -> a / n = 3
state b
    when n < 1 -> a
    when n > 1 -> c
state c
    on go -> a
"""


def test_values_of_variables_decide():
    found, kept = notes(VALUES.format(first=0))
    assert {("N0701", 7), ("N0702", 9)} <= found
    assert kept == {("N0702", 5)}  # with 0 and 3 the second line is more general, and b is never without a line
    found, kept = notes(VALUES.format(first=0).replace("n = 3", "n = steps"))
    assert {("N0701", 7), ("N0702", 9)} <= kept


def test_states_that_no_step_ends_in():
    checked = check_text(VALUES.format(first=0), LIBRARY)
    assert list(examine(checked.model).passing) == ["b"]
    checked = check_text(VALUES.format(first=1), LIBRARY)
    assert list(examine(checked.model).passing) == []
