"""Arithmetic that is the same everywhere agrees with the mathematics."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from transport.arithmetic import directions

LENGTHS = st.floats(-1e6, 1e6, allow_subnormal=False)


@given(LENGTHS, LENGTHS)
def test_a_direction_is_that_of_the_vector(x, y):
    (found,) = directions(np.array([x]), np.array([y]))
    assert found == pytest.approx(math.atan2(y, x), abs=3e-8) or math.isclose(abs(found), math.pi, abs_tol=3e-8)


def test_directions_have_the_shape_of_both():
    assert directions(np.ones((3, 1)), np.ones((1, 4))).shape == (3, 4)
    assert directions(np.zeros(1), np.zeros(1)).tolist() == [0.0]
