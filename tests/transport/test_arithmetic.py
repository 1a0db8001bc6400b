"""Arithmetic that is the same everywhere agrees with the mathematics."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.special import ndtri

from transport.arithmetic import (
    atan2,
    chord_over_arc,
    cos,
    cos_sin,
    cosines_and_sines,
    directions,
    exp,
    halfway,
    logs,
    normals,
    power,
    sin,
    tan,
)  # fmt: skip

LENGTHS = st.floats(-1e6, 1e6, allow_subnormal=False)


@given(LENGTHS, LENGTHS)
def test_a_direction_is_that_of_the_vector(x, y):
    assume(x != 0 or y != 0)
    (found,) = directions(np.array([x]), np.array([y]))
    assert found == pytest.approx(math.atan2(y, x), abs=3e-8) or math.isclose(abs(found), math.pi, abs_tol=3e-8)


def test_directions_have_the_shape_of_both():
    assert directions(np.ones((3, 1)), np.ones((1, 4))).shape == (3, 4)
    assert directions(np.zeros(1), np.zeros(1)).tolist() == [0.0]


ANGLES = (
    st.floats(-1e5, 1e5, exclude_min=True, exclude_max=True)
    | st.floats(-7.0, 7.0)
    | st.integers(-40, 40).map(lambda eighths: eighths * math.pi / 8)
)
"""Those of which the sine is right to a unit in the last place."""


def units(found, right):
    """How many units in the last place a number is off."""
    return abs(found - right) / math.ulp(right)


@given(ANGLES)
def test_sine_and_cosine_are_right_to_a_unit_in_the_last_place(angle):
    for found, right in ((sin(angle), math.sin(angle)), (cos(angle), math.cos(angle))):
        assert units(found, right) <= 1 or abs(found - right) < 1e-20
    assert abs(cos(angle)) < 1e-9 or tan(angle) == pytest.approx(math.tan(angle), rel=1e-15)
    assert (cos(angle), sin(angle)) == cos_sin(angle)
    assert chord_over_arc(angle) == pytest.approx(np.sinc(angle / math.pi), abs=1e-15)


@given(st.lists(ANGLES, min_size=1))
def test_arrays_of_angles_get_the_bits_of_each_angle(angles):
    together = cosines_and_sines(np.array(angles))
    assert list(zip(*(one.tolist() for one in together), strict=True)) == [cos_sin(angle) for angle in angles]


@given(st.floats(1e5, 1e15))
def test_angles_of_many_turns_are_taken_to_the_nearest_full_ones(angle):
    assert sin(angle) == pytest.approx(math.sin(math.fmod(angle, math.tau)), abs=1e-12)


def test_not_a_number_has_no_sine():
    assert all(map(math.isnan, (*cos_sin(math.nan), *np.ravel(cosines_and_sines(np.array([math.nan]))))))


@pytest.mark.parametrize("angle", [math.inf, -math.inf])
def test_what_is_no_angle_has_no_sine(angle):
    with pytest.raises(ValueError, match=r"."):
        cos_sin(angle)


COORDINATES = st.floats(-1e6, 1e6) | st.floats() | st.sampled_from([0.0, -0.0, 5e-324, 1e308, -1e308])


@given(COORDINATES, COORDINATES)
def test_an_arc_tangent_is_right_to_two_units_in_the_last_place(y, x):
    right = math.atan2(y, x)
    if math.isnan(right):
        assert math.isnan(atan2(y, x))
    elif abs(right) > 1e-300:
        assert units(atan2(y, x), right) <= 2
    else:
        assert atan2(y, x) == pytest.approx(right, abs=1e-300)
        assert math.copysign(1.0, atan2(y, x)) == math.copysign(1.0, right)


@given(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6))
def test_half_a_direction(x, y):
    cosine, sine = halfway(x, y)
    half = math.atan2(y, x) / 2
    if math.hypot(x, y) > 1e-150:
        assert cosine == pytest.approx(math.cos(half), abs=1e-15)
        assert sine == pytest.approx(math.sin(half), abs=1e-15)
    assert halfway(0.0, 0.0) == (1.0, 0.0)


@given(st.floats(-700.0, 700.0))
def test_the_exponential_function_is_right_to_a_unit_in_the_last_place(x):
    assert units(exp(x), math.exp(x)) <= 1


@given(st.floats(min_value=1e-300, max_value=1e300) | st.floats(0.5, 2.0))
def test_a_logarithm_is_right_to_a_unit_in_the_last_place(x):
    assert units(float(logs(np.array([x]))[0]), math.log(x)) <= 1


@given(st.floats(-100.0, 100.0), st.integers(0, 4))
def test_a_whole_power(x, exponent):
    assert power(x, exponent) == pytest.approx(x**exponent, rel=1e-14)


def test_normal_draws_are_the_quantiles_of_uniform_ones():
    drawn = normals(np.random.default_rng(5), 100_000)
    assert drawn == pytest.approx(ndtri(np.random.default_rng(5).random(100_000) + 2.0**-54), abs=1e-11)
    assert len(normals(np.random.default_rng(5), 0)) == 0


class Lowest:
    """A generator that draws what is farthest out."""

    def __init__(self, share):
        self.share = share

    def random(self, count):
        return np.full(count, self.share)


@pytest.mark.parametrize("share", [0.0, 1.0 - 2.0**-53])
def test_the_farthest_draws_are_finite(share):
    assert np.abs(normals(Lowest(share), 2)) == pytest.approx(8.2, abs=0.3)
