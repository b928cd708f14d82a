"""Uncertainty of linear models, where it is known."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.identification.uncertainty import (
    compute_profile,
    gauss_newton_move,
    linear_uncertainty,
)

NO_BOUNDS = np.full(3, -np.inf)


def model(seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """A Jacobian (40, 3), and residuals."""
    rng = np.random.default_rng(seed)
    return rng.standard_normal((40, 3)) * (1.0, 50.0, 1e-3), rng.standard_normal(40)


@given(st.integers(0, 20), st.tuples(*[st.floats(-6.0, 6.0)] * 3))
def test_units_change_neither_condition_nor_correlations(seed: int, powers):
    jacobian, _ = model(seed)
    factors = 10.0 ** np.array(powers)
    one, other = linear_uncertainty(jacobian), linear_uncertainty(jacobian * factors)
    assert other.condition == pytest.approx(one.condition)
    np.testing.assert_allclose(other.correlations, one.correlations, atol=1e-9)
    np.testing.assert_allclose(other.sd * factors, one.sd, rtol=1e-9)


def test_the_covariance_is_that_of_the_normal_equations():
    jacobian, _ = model()
    expected = np.linalg.inv(jacobian.T @ jacobian)
    np.testing.assert_allclose(linear_uncertainty(jacobian).covariance, expected, rtol=1e-9)


def test_the_undetermined_direction_is_found():
    jacobian, _ = model()
    jacobian[:, 2] = -(2.0 * jacobian[:, 0] + 0.5 * jacobian[:, 1])
    found = linear_uncertainty(jacobian)
    assert found.condition > 1e12
    direction = found.null_direction / found.null_direction[2]
    np.testing.assert_allclose(direction, [2.0, 0.5, 1.0], rtol=1e-6)


def test_a_step_reaches_the_minimum_of_linear_residuals():
    jacobian, residuals = model()
    moved = residuals + jacobian @ gauss_newton_move(jacobian, residuals)
    np.testing.assert_allclose(jacobian.T @ moved, 0.0, atol=1e-10)


def profile_of(function, jacobian, index=0, lower=NO_BOUNDS, estimate=None):
    """Profile for noise of variance 1 at the origin, or at another estimate."""
    at = np.zeros(3) if estimate is None else estimate
    sd = linear_uncertainty(jacobian).sd
    return sd, compute_profile(index, at, sd, 1.0, 1.96, lower, jacobian, function)


def test_the_profile_of_a_linear_model_is_its_parabola():
    jacobian, residuals = model()
    least = residuals + jacobian @ gauss_newton_move(jacobian, residuals)
    for index in range(3):
        sd, profile = profile_of(lambda moved: least + jacobian @ moved, jacobian, index)
        np.testing.assert_allclose(profile.distances, [-3, -2, -1, 0, 1, 2, 3], atol=1e-6)
        np.testing.assert_allclose(profile.values / sd[index], profile.distances, atol=1e-6)
        low, high = profile.interval(1.96)
        assert (low / sd[index], high / sd[index]) == pytest.approx((-1.96, 1.96), abs=1e-3)


def test_a_flat_side_of_a_profile_is_open():
    jacobian = np.diag([1.0, 1.0, 1.0])

    def saturating(moved: np.ndarray) -> np.ndarray:
        return np.array([np.minimum(moved[0], 0.5), moved[1], moved[2]])

    _, profile = profile_of(saturating, jacobian)
    low, high = profile.interval(1.96)
    assert low == pytest.approx(-1.96, abs=1e-3)
    assert high is None


def test_the_others_stay_within_their_bounds():
    jacobian, residuals = model()
    jacobian[:, 1] = 50.0 * jacobian[:, 0] + 0.1 * jacobian[:, 1]  # correlated
    least = residuals + jacobian @ gauss_newton_move(jacobian, residuals)
    lower = np.array([-np.inf, 0.0, -np.inf])
    visited: list[float] = []

    def function(moved: np.ndarray) -> np.ndarray:
        visited.append(float(moved[1]))
        return least + jacobian @ moved

    sd, profile = profile_of(function, jacobian, 0, lower)
    assert min(visited) >= 0.0
    # Where the bound holds, the profile is that of the two other unknowns.
    alone = linear_uncertainty(jacobian[:, [0, 2]]).sd[0]
    bounded = profile.distances[-1] if jacobian[:, 0] @ jacobian[:, 1] > 0 else profile.distances[0]
    assert abs(bounded) == pytest.approx(3.0 * sd[0] / alone, rel=1e-6)


def test_a_profile_ends_at_the_bound_of_its_unknown():
    jacobian, residuals = model()
    least = residuals + jacobian @ gauss_newton_move(jacobian, residuals)
    _, profile = profile_of(lambda moved: least + jacobian @ moved, jacobian, 0, np.zeros(3))
    assert profile.values[0] == 0.0
    assert profile.interval(1.96)[0] is None


def test_a_profile_reaches_a_large_quantile_of_few_samples():
    jacobian, residuals = model()
    least = residuals + jacobian @ gauss_newton_move(jacobian, residuals)
    sd = linear_uncertainty(jacobian).sd
    quantile = 12.706  # of Student's distribution with one degree of freedom

    def function(moved: np.ndarray) -> np.ndarray:
        return least + jacobian @ moved

    profile = compute_profile(0, np.zeros(3), sd, 1.0, quantile, NO_BOUNDS, jacobian, function)
    low, high = profile.interval(quantile)
    assert (low / sd[0], high / sd[0]) == pytest.approx((-quantile, quantile), rel=1e-3)
