"""The lowest and highest values, some passed over."""

from __future__ import annotations

import math

import numpy as np
import pytest

from perception.extremes import highest, lowest


def test_of_no_values_something_else_is_said():
    nothing = np.empty(0)
    assert lowest(nothing) == math.inf
    assert highest(nothing) == -math.inf
    assert lowest(nothing, 3.0) == highest(nothing, 3.0) == 3.0


@pytest.mark.parametrize("passed_over", [0, 1, 2, 5])
def test_some_are_passed_over(passed_over):
    values = np.random.default_rng(1).permutation(20.0 + np.arange(6))
    before = values.copy()
    assert lowest(values) == 20.0
    assert highest(values, passed_over=passed_over) == 25.0 - passed_over
    assert (values == before).all()


def test_too_few_to_pass_over():
    assert highest(np.array([1.0, 2.0]), passed_over=2) == -math.inf
    assert highest(np.array([1.0, 2.0]), 7.0, passed_over=2) == 7.0


def test_equal_values_count_each():
    assert highest(np.array([1.0, 2.0, 2.0]), passed_over=1) == 2.0
