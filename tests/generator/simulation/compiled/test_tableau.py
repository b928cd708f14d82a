"""The coefficients of the methods against SciPy's, and the conditions of their orders."""

import numpy as np
import pytest
from scipy.integrate import RK23
from scipy.integrate._ivp import dop853_coefficients as scipy_tableau

from generator.simulation.compiled.tableau import BS23, DOP853, Method


def test_the_coefficients_of_dop853_are_scipy_s():
    assert np.array_equal(DOP853.nodes, scipy_tableau.C)
    assert np.array_equal(DOP853.weights, scipy_tableau.A)
    assert np.array_equal(DOP853.weights[12, :12], scipy_tableau.B)  # the solution
    assert np.array_equal(DOP853.continuous, scipy_tableau.D)
    assert np.array_equal(DOP853.errors, [scipy_tableau.E5, scipy_tableau.E3])


def test_the_coefficients_of_bs23_are_scipy_s():
    assert np.array_equal(BS23.nodes[:3], RK23.C)
    assert np.array_equal(BS23.weights[:3, :3], RK23.A)
    assert np.array_equal(BS23.weights[3, :3], RK23.B)
    assert np.array_equal(BS23.errors[0], RK23.E)
    assert not BS23.continuous.any()  # the cubic by both ends


@pytest.mark.parametrize(("method", "order"), [(DOP853, 8), (BS23, 3)])
def test_the_coefficients_have_their_order(method: Method, order: int):
    """Sums b c^k = 1/(k + 1) up to the order; rows of the stages sum to their nodes."""
    end = method.end_stage
    weights, nodes = method.weights[end, :end], method.nodes[:end]
    for power in range(order):
        assert abs(weights @ nodes**power - 1.0 / (power + 1)) < 1e-14
    assert abs(weights @ nodes**order - 1.0 / (order + 1)) > 1e-6
    assert np.max(np.abs(method.weights.sum(axis=1) - method.nodes)) < 1e-13
    assert np.max(np.abs(method.errors.sum(axis=1))) < 1e-14
