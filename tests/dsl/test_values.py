"""What numbers mean: exact literals, bounded variables, durations at any epoch."""

import json
from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import hsm
from hsm.dsl import check_text
from hsm.model.types import BOOLEAN, UNITS, Quantity, si_value
from hsm.model.unparse import shown_text, value_text

LIBRARY = hsm.Library("numbers")


@LIBRARY.signal("far")
def far(facts: object) -> float:
    """Infinite, like a beam that meets nothing."""
    return float("inf")


def machine(text):
    checked = check_text(text, LIBRARY)
    assert checked.model is not None, checked.diagnostics
    return hsm.build(checked.model)


def codes(text):
    return [one.code for one in check_text(text, LIBRARY, remarks=False).diagnostics]


@settings(deadline=None)
@given(st.decimals(-9999, 9999, allow_nan=False, places=4), st.sampled_from(sorted(UNITS)))
def test_a_literal_is_the_float_nearest_to_its_exact_value(number, unit):
    digits, kind = f"{abs(number):f}", UNITS[unit]
    name = str(kind.quantity)
    text = f"machine m\nvar x : {name} = {digits} {unit}\nstate a\n    stay"
    exact = float(Fraction(digits) * kind.scale)
    assert machine(text).start().variables["x"] == exact == si_value(digits, kind)


@pytest.mark.parametrize("centimetres", range(301))
def test_whole_centimetres_are_the_metres_that_they_are(centimetres):
    assert si_value(str(centimetres), UNITS["cm"]) == si_value(f"{Fraction(centimetres, 100).__float__():.2f}")


def test_guards_at_one_place_agree_whatever_their_unit():
    text = "machine m\nvar gap : length = 0.7 m\nstate a\n    when gap < 70 cm -> b\n    when gap == 700 mm -> c\n"
    run = machine(text + "final b\nfinal c").start()
    run.step(0.1)
    assert run.outcome == "c"


@given(st.floats(-1e6, 1e6), st.sampled_from([Quantity(), Quantity(length=1), Quantity(angle=1), Quantity(time=-1)]))
def test_a_value_in_a_message_reads_back_as_itself(value, kind):
    written, _, unit = value_text(value, kind).partition(" ")
    assert si_value(written, UNITS.get(unit)) == value


@pytest.mark.parametrize("number", ["1e400", "1e-400", "9" * 5000, "0", "1e99999999"])
def test_numbers_far_outside_take_no_time(number):
    assert si_value(number, UNITS["cm"]) in (0.0, float("inf"))


def grow(run):
    for tick in range(1, 50):
        run.step(tick / 10, ["go"])


@pytest.mark.parametrize(
    ("kind", "first", "action"),
    [("int", "2", "n *= n"), ("int", "9", "n -= n * n * n"), ("number", "2.0", "n *= n"), ("number", "1.0", "n = far")],
)
def test_a_variable_beyond_its_limits_is_a_fault(kind, first, action):
    run = machine(f"machine m\nvar n : {kind} = {first}\nevent go\nstate a\n    on go / {action}\n").start()
    with pytest.raises(hsm.MachineFault, match=r"63 bits|cannot hold inf"):
        grow(run)
    json.dumps(run.snapshot(), allow_nan=False)
    repr(run.step(9.0).considered)


def test_the_largest_whole_number_is_held_and_written_down():
    run = machine("machine m\nvar n : int = 999999999999999999\nevent go\nstate a\n    on go / n = n * 9\n").start()
    run.step(0.1, ["go"])
    assert json.loads(json.dumps(run.snapshot()))["variables"]["n"] == 999999999999999999 * 9


def test_constants_that_are_too_large_are_found_when_reading():
    assert "E0306" in codes("machine m\nvar n : int = 999999999999999999 * 999\nstate a\n    stay")


@pytest.mark.parametrize("value", [float("inf"), float("nan"), 1e999])
def test_parameters_are_finite(value):
    with pytest.raises(ValueError, match="cannot hold"):
        machine("machine m\nparam p : number = 1.0\nstate a\n    when p > 2.0 -> b\nfinal b").start({"p": value})


@pytest.mark.parametrize("line", ["after -5 s -> b", "after 1 s - 2 s -> b", "after -(5 s) -> b"])
def test_a_negative_duration_is_found(line):
    assert codes(f"machine m\nstate a\n    {line}\nfinal b") == ["E0307"]


@pytest.mark.parametrize("claim", ["always eventually in(a) within -1 s", "after in(a), in(b) within -1 s"])
def test_a_negative_duration_of_a_property_is_found(claim):
    assert codes(f"machine m\nproperty p : {claim}\nstate a\n    after 1 s -> b\nfinal b") == ["E0307"]


def test_a_duration_that_turns_out_negative_is_a_fault():
    text = "machine m\nparam p : time = 1 s\nstate a\n    after p - 2 s -> b\nfinal b"
    with pytest.raises(hsm.MachineFault, match="a duration cannot be -1 s"):
        machine(text).start()
    assert machine(text).start({"p": 3.0}).configuration == {"a"}


EPOCHS = (0.0, 1e6, 1732740000.0, 1732740000.123456, 1.7e12, 4e15)


@given(
    st.sampled_from(EPOCHS[:4]) | st.floats(1.6e9, 2.0e9),
    st.integers(1, 400),
    st.sampled_from([10, 20, 30, 50, 60, 100]),
)
def test_a_duration_is_the_same_number_of_ticks_at_any_epoch(epoch, ticks, rate):
    text = "machine m\nparam p : time = 1 s\nstate a\n    after p -> b\nfinal b"
    run = machine(text).start({"p": ticks / rate}, time=epoch)
    for tick in range(1, ticks):
        assert not run.step(epoch + tick / rate), tick
    assert run.step(epoch + ticks / rate)


@pytest.mark.parametrize("epoch", EPOCHS)
def test_durations_of_seconds_hold_however_coarse_the_stamps_are(epoch):
    run = machine("machine m\nstate a\n    after 5 s -> b\nfinal b").start(time=epoch)
    assert not run.step(epoch + 3)
    assert run.step(epoch + 5)


def test_conditions_are_still_conditions():
    assert value_text(True, BOOLEAN) == "true"


def test_a_person_reads_six_digits_and_a_file_all():
    length = UNITS["m"].quantity
    assert value_text(0.223606797749979, length) == "0.223606797749979 m"
    assert shown_text(0.223606797749979, length) == "0.223607 m"
    assert (shown_text(3, None), shown_text(True, BOOLEAN)) == ("3", "true")


@pytest.mark.parametrize("value", ["4611686018427387904", "9223372036854775807", "000000000000000000000000000000012"])
def test_whole_numbers_have_63_bits(library, value):
    checked = check_text(f"machine m\nvar n : int = {value}\nstate a\n    when n > 3 -> a / n = 0\n", library)
    assert checked.model is not None
    assert checked.model.variables[0].initial.value == int(value)


@pytest.mark.parametrize("value", ["9223372036854775808", "9" * 5000])
def test_a_whole_number_beyond_is_named(library, value):
    found = check_text(f"machine m\nvar n : int = {value}\nstate a\n    when n > 3 -> a / n = 0\n", library).diagnostics
    assert ("E0306", "this whole number is too large") in [(one.code, one.message) for one in found]
    assert any("an `int` goes to 9223372036854775807" in one.suggestion for one in found)


@pytest.mark.parametrize(
    ("wrong", "reason"), [("1 / (n - n)", "division by zero"), ("1.5 / (x - x)", "division by zero")]
)
def test_a_fault_has_the_same_words_in_every_python(library, wrong, reason):
    text = f"machine m\nevent go\nvar n : int = 1\nvar x : number = 1.5\nstate a\n    on go / x = {wrong}, n = 2\n"
    run = hsm.build(check_text(text, library).model).start()
    with pytest.raises(hsm.MachineFault, match=f"an action failed: {reason}"):
        run.step(0.1, ["go"])


@pytest.mark.parametrize(
    ("number", "value"),
    [("1e3" + "9" * 30, float("inf")), ("-1e3" + "9" * 30, -float("inf")), ("1e-3" + "9" * 30, 0.0)],
)
def test_an_exponent_that_no_decimal_number_holds(number, value):
    assert si_value(number, UNITS["cm"]) == value
