"""Parameters as a person writes them."""

from enum import StrEnum
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hsm.model.chart import Adjustable, Model
from hsm.model.registry import Parameter
from hsm.model.types import BOOLEAN, INTEGER, NUMBER, UNITS, Enumeration, Quantity
from maze_machine.arguments.parameters import parameter_values, split_setting
from maze_machine.errors import UsageError


class Side(StrEnum):
    LEFT = "left"
    RIGHT = "right"


PARAMETERS = (
    Parameter("cruise", Quantity(length=1, time=-1), 0.5),
    Parameter("angle", Quantity(angle=1), 0.0),
    Parameter("gain", NUMBER, 1.0),
    Parameter("count", INTEGER, 0),
    Parameter("eager", BOOLEAN, False),
    Parameter("side", Enumeration("Side", ("left", "right")), Side.LEFT),
)


def model(*parameters, **others):
    return Model("m", (), parameters=parameters, **others)


def read(name, text):
    return parameter_values(model(*PARAMETERS), {name: text}, {"Side": Side})[name]


@pytest.mark.parametrize(
    ("name", "text", "value"),
    [
        ("cruise", "0.3 m/s", 0.3),
        ("cruise", "30cm/s", 0.3),
        ("cruise", "0.3", 0.3),
        ("cruise", ".3", 0.3),
        ("angle", "180 deg", 3.141592653589793),
        ("angle", "-1e-1 rad", -0.1),
        ("gain", "2", 2.0),
        ("count", "-3", -3),
        ("eager", "True", True),
        ("eager", "false", False),
        ("side", "left", Side.LEFT),
    ],
)
def test_a_value_is_read_with_its_unit(name, text, value):
    read_value = read(name, text)
    assert (
        read_value == pytest.approx(value) if isinstance(value, float) else read_value is value or read_value == value
    )
    assert type(read_value) is type(value)


@pytest.mark.parametrize(
    ("name", "text", "way_out"),
    [
        ("cruise", "0.3 m", "m/s, cm/s"),
        ("cruise", "fast", "m/s, cm/s"),
        ("cruise", "", "m/s, cm/s"),
        ("gain", "2 m", "plain number"),
        ("count", "1.5", "whole number"),
        ("eager", "yes", "true or false"),
        ("side", "up", "left, right"),
        ("cruse", "1", "did you mean `cruise`?"),
        ("zzz", "1", "it has cruise, angle"),
    ],
)
def test_a_wrong_value_is_told_with_a_way_out(name, text, way_out):
    with pytest.raises(UsageError) as caught:
        read(name, text)
    assert way_out in caught.value.way_out
    assert name in str(caught.value)


@given(st.floats(-1e6, 1e6), st.sampled_from(sorted(UNITS)))
def test_every_unit_of_the_language_is_read(number, unit):
    parameter = Parameter("x", UNITS[unit].quantity)
    assert parameter_values(model(parameter), {"x": f"{number!r} {unit}"}, {}) == {
        "x": float(Fraction(repr(number)) * UNITS[unit].scale)
    }


@pytest.mark.parametrize("text", ["0.05 m/s", "0.7 m/s"])
def test_a_value_beyond_the_bounds_of_an_adjustable_parameter_is_refused(text):
    bounded = model(*PARAMETERS, adjustable=(Adjustable("cruise", 0.1, 0.5),))
    assert parameter_values(bounded, {"cruise": "0.5 m/s"}, {}) == {"cruise": 0.5}
    with pytest.raises(UsageError, match=f"parameter `cruise` of machine m takes 0.1 m/s to 0.5 m/s, not {text}"):
        parameter_values(bounded, {"cruise": text}, {})


def test_a_setting_without_a_value_is_told():
    assert split_setting("cruise = 0.3 m/s") == ("cruise", "0.3 m/s")
    with pytest.raises(UsageError, match="no value"):
        split_setting("cruise")


def test_a_parameter_without_a_default_must_be_given():
    needed = model(Parameter("angle", Quantity(angle=1)))
    assert parameter_values(needed, {"angle": "1"}, {}) == {"angle": 1.0}
    with pytest.raises(UsageError, match="needs a value for its parameter `angle`"):
        parameter_values(needed, {}, {})
