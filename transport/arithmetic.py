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
