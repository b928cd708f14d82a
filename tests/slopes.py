"""Exact slopes for the tests of laws: the complex step, which has no difference to cancel."""

import numpy as np

STEP = 1e-30


def slope(function, angle):
    """Derivative of an analytic (or piecewise analytic) function at a real angle."""
    return function(np.complex128(complex(angle, STEP))).imag / STEP


def gradient(function, angles):
    """Partial derivatives of a function of several angles."""
    return [
        function([*angles[:i], np.complex128(complex(angles[i], STEP)), *angles[i + 1 :]]).imag
        / STEP
        for i in range(len(angles))
    ]
