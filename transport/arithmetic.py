"""Arithmetic whose last bit depends neither on the processor nor on the interpreter.

A run's trace is the same byte for byte wherever it is made, so nothing that decides may be computed by what chooses its
instructions by processor: BLAS and LAPACK (``@``, ``np.dot``, ``np.linalg``), numpy's vectorised functions beyond
the four operations and the square root (``np.arctan2``, ``np.exp``, ``np.hypot`` ...), a sort that may swap equals.
Nor by what Python versions round differently: ``sum`` of floats, ``math.hypot``, ``math.dist``. The four operations and
the square root are rounded correctly everywhere (IEEE 754).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def norm(x: float, y: float) -> float:
    """The length of a vector in the plane."""
    return math.sqrt(x * x + y * y)


def distance_between(one: tuple[float, float], other: tuple[float, float]) -> float:
    """The distance of two points in the plane."""
    dx, dy = one[0] - other[0], one[1] - other[1]
    return math.sqrt(dx * dx + dy * dy)


def norms(x: Floats, y: Floats) -> Floats:
    """The lengths of vectors in the plane, of the shape that x and y have together."""
    squares: Floats = x * x + y * y
    return np.sqrt(squares, out=squares)


def cosines(angles: Floats) -> Floats:
    """The cosine of each angle in rad, shape (n,), by the C library, one by one."""
    return np.array([math.cos(angle) for angle in angles.tolist()], dtype=np.float64)


def sines(angles: Floats) -> Floats:
    """The sine of each angle in rad, shape (n,), by the C library, one by one."""
    return np.array([math.sin(angle) for angle in angles.tolist()], dtype=np.float64)


_ARCTAN = (0.0028662257, -0.0161657367, 0.0429096138, -0.07528964, 0.1065626393, -0.1420889944, 0.1999355085)
_THIRD = -0.3333314528


def directions(x: Floats, y: Floats) -> Floats:
    """The direction of each vector in the plane in rad, from -pi to pi, of the shape that x and y have together.

    By a polynomial of the four operations alone (Abramowitz and Stegun 1964, 4.4.49), right to 2e-8 rad.
    """
    along, across = np.abs(x), np.abs(y)
    larger = np.maximum(along, across)
    ratio = np.minimum(along, across) / np.where(larger > 0, larger, 1.0)
    square = ratio * ratio
    series = np.zeros_like(square)
    for coefficient in (*_ARCTAN, _THIRD, 1.0):
        series = series * square + coefficient
    angle = ratio * series
    angle = np.where(across > along, math.pi / 2 - angle, angle)
    angle = np.where(x < 0, math.pi - angle, angle)
    return np.copysign(angle, y)
