"""Adds the errors of a real laser range finder to exact ranges."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.settings import LaserNoise
from transport.arithmetic import normals
from transport.compiled import compiled
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
        disturb(exact, generator.random(len(exact)), noise.size, geometry.range_max)
    else:
        if noise.model == "gaussian":
            exact += noise.size * normals(generator, len(exact))
        _cut(exact, geometry.range_max)
    if noise.miss:
        exact[generator.random(len(exact)) < noise.miss] = np.inf
    if noise.dropout:
        exact[generator.random(len(exact)) < noise.dropout] = np.nan
    return exact.astype(np.float32)


@compiled
def disturb(exact: NDArray[np.float64], draws: NDArray[np.float64], size: float, range_max: float) -> None:
    """Add errors of a uniform distribution to ranges, which stay within zero and the largest range, in place.

    Args:
        exact: m, shape (beams,).
        draws: between 0 and 1, the same shape; used up.
        size: half the width of the distribution, m.
        range_max: a larger range counts as infinite, m.
    """
    draws *= 2.0 * size
    draws -= size
    exact += draws
    _cut(exact, range_max)


def _cut(ranges: NDArray[np.float64], range_max: float) -> None:
    """Keep ranges within zero and the largest range, in place; a larger one is infinite."""
    np.maximum(ranges, 0.0, out=ranges)
    ranges[ranges > range_max] = np.inf
