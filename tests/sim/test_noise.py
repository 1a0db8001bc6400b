"""The laser's noise models."""

import numpy as np
import pytest

from sim.noise import disturbed
from sim.settings import LaserNoise
from transport.messages import ScanGeometry

GEOMETRY = ScanGeometry(100_000, -2.0, 4 / 99_999, 0.01, 10.0)


def errors(noise, distance=3.0):
    generator = np.random.Generator(np.random.PCG64(1))
    return disturbed(np.full(GEOMETRY.beams, distance), noise, GEOMETRY, generator).astype(float) - distance


def test_uniform_noise_fills_its_interval_evenly():
    found = errors(LaserNoise(size=0.02))
    assert np.abs(found).max() <= 0.02 + 1e-6
    assert found.std() == pytest.approx(0.02 / np.sqrt(3), rel=0.02)
    assert abs(found.mean()) < 2e-4


def test_gaussian_noise_has_its_standard_deviation():
    found = errors(LaserNoise(model="gaussian", size=0.03))
    assert found.std() == pytest.approx(0.03, rel=0.02)
    assert (np.abs(found) > 0.06).mean() == pytest.approx(0.0455, rel=0.1)


def test_without_noise_readings_are_exact_to_single_precision():
    assert np.abs(errors(LaserNoise(model="none"), 3.1)).max() < 1e-6


def test_beams_drop_out_and_miss_as_often_as_told():
    found = errors(LaserNoise(dropout=0.1, miss=0.2))
    assert np.isnan(found).mean() == pytest.approx(0.1, rel=0.05)
    assert np.isinf(found).mean() == pytest.approx(0.2 * 0.9, rel=0.05)


def test_readings_stay_within_zero_and_the_largest_range():
    generator = np.random.Generator(np.random.PCG64(2))
    exact = np.concatenate([np.full(50_000, 0.001), np.full(49_000, 9.999), np.full(1000, np.inf)])
    found = disturbed(exact, LaserNoise(), GEOMETRY, generator)
    assert found.min() >= 0.0
    assert found[np.isfinite(found)].max() <= 10.0
    assert np.isinf(found[50_000:99_000]).any()
    assert np.isinf(found[99_000:]).all()
