"""Adds the errors of a real laser range finder to exact ranges."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.settings import LaserNoise
from transport.arithmetic import normals
from transport.messages import ScanGeometry


def disturbed(
    exact: NDArray[np.float64], noise: LaserNoise, geometry: ScanGeometry, generator: np.random.Generator
) -> NDArray[np.float32]:
    """Readings: every beam with its error, in the wire's precision.

    Args:
        exact: exact ranges in metres, infinite where nothing is hit; shape (beams,). Used up.
        noise: the noise model.
        geometry: the beams; a disturbed reading stays within zero and the largest range.
        generator: where the errors are drawn from.

    Returns:
        Metres, shape (beams,); infinity where nothing was hit or nothing came back, NaN where a beam dropped out.
    """
    if noise.model == "uniform":
        errors = generator.random(len(exact))
        errors *= 2.0 * noise.size
        errors -= noise.size
        exact += errors
    elif noise.model == "gaussian":
        exact += noise.size * normals(generator, len(exact))
    np.maximum(exact, 0.0, out=exact)
    exact[exact > geometry.range_max] = np.inf
    if noise.miss:
        exact[generator.random(len(exact)) < noise.miss] = np.inf
    if noise.dropout:
        exact[generator.random(len(exact)) < noise.dropout] = np.nan
    return exact.astype(np.float32)
