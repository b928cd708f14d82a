"""Tests of residuals on series whose properties are known."""

import numpy as np
import pytest

from generator.identification.whiteness import autocorrelations, check_residuals


def decaying_series(rho: float, seed: int, count: int = 300) -> np.ndarray:
    """A series whose autocorrelation at a lag is `rho` to its power."""
    rng = np.random.default_rng(seed)
    series = [rng.standard_normal()]
    for _ in range(count - 1):
        series.append(rho * series[-1] + np.sqrt(1.0 - rho**2) * rng.standard_normal())
    return np.array(series)[:, None]


def test_independent_residuals_are_rarely_called_alike():
    tests = [check_residuals(decaying_series(0.0, seed), 3, None) for seed in range(200)]
    probabilities = np.array([one.whiteness for one in tests])
    assert 3 <= np.count_nonzero(probabilities < 0.05) <= 22
    assert sum(one.are_autocorrelated for one in tests) <= 1


@pytest.mark.parametrize("rho", [0.4, 0.8])
def test_alike_residuals_are_called_so(rho: float):
    tests = [check_residuals(decaying_series(rho, seed), 3, None) for seed in range(50)]
    assert sum(one.are_autocorrelated for one in tests) >= 45
    assert np.mean([one.lag_one for one in tests]) == pytest.approx(rho, abs=0.05)
    widening = np.median([one.widening for one in tests])
    assert widening == pytest.approx(np.sqrt((1.0 + rho) / (1.0 - rho)), rel=0.1)


def test_columns_are_series_of_their_own():
    steps = np.hstack([decaying_series(0.0, 1) + 5.0, decaying_series(0.0, 2) - 5.0])
    assert check_residuals(steps, 3, None).lag_one == pytest.approx(0.0, abs=0.15)


def test_the_size_is_compared_with_the_stated_noise():
    series = decaying_series(0.0, 3)
    assert check_residuals(series, 3, None).misfit is None
    assert 0.01 < check_residuals(series, 3, 1.0).misfit < 0.99
    assert check_residuals(series, 3, 0.7).misfit < 1e-6
    assert check_residuals(series, 3, 1.4).misfit > 1.0 - 1e-6


def test_few_or_vanishing_residuals_have_no_test():
    assert check_residuals(np.ones((4, 1)), 1, None).whiteness is None
    assert check_residuals(np.zeros((40, 1)), 1, None).whiteness is None


def test_the_autocorrelations_of_a_wave():
    wave = np.cos(2.0 * np.pi * np.arange(1000) / 10.0)
    assert autocorrelations(wave, 10)[[4, 9]] == pytest.approx([-1.0, 1.0], abs=0.02)


def test_residuals_that_alternate_are_not_independent():
    found = check_residuals(decaying_series(-0.8, 1), 3, None)
    assert found.are_autocorrelated
    assert found.lag_one == pytest.approx(-0.8, abs=0.1)
    assert found.widening == 1.0
