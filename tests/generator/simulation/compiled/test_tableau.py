"""The coefficients of DOP853 against SciPy's, and the conditions of its order."""

import numpy as np
from scipy.integrate._ivp import dop853_coefficients as scipy_tableau

from generator.simulation.compiled import tableau


def test_the_coefficients_are_scipy_s():
    assert np.array_equal(tableau.NODES, scipy_tableau.C)
    assert np.array_equal(tableau.STAGES, scipy_tableau.A)
    assert np.array_equal(tableau.STAGES[12, :12], scipy_tableau.B)  # the solution
    assert np.array_equal(tableau.CONTINUOUS, scipy_tableau.D)
    assert np.array_equal(tableau.ERROR_3, scipy_tableau.E3)
    assert np.array_equal(tableau.ERROR_5, scipy_tableau.E5)


def test_the_coefficients_have_their_order():
    """Sums b c^k = 1/(k + 1) up to order 8; rows of the stages sum to their nodes."""
    weights, nodes = tableau.STAGES[12, :12], tableau.NODES[:12]
    for power in range(8):
        assert abs(weights @ nodes**power - 1.0 / (power + 1)) < 1e-14
    assert abs(weights @ nodes**8 - 1.0 / 9.0) > 1e-6
    assert np.max(np.abs(tableau.STAGES.sum(axis=1) - tableau.NODES)) < 1e-13
