from math import inf

import numpy as np
import pytest

from springs.published.shoulder_rhythm import DigitisedPoints, PiecewiseLinear, Regression

ARM = np.array([-0.1, 0.0, 0.5, 1.0, 2.0, 3.0])


def test_a_regression_adds_plane_elevation_and_rest():
    law = Regression(constant=0.1, plane=-0.2, elevation=0.3, rest_factor=0.5, rest=0.4)
    assert law.angle(1.0, plane=2.0) == pytest.approx(0.1 - 0.4 + 0.3 + 0.2)
    assert law.angle(ARM).shape == ARM.shape


def test_lines_hold_up_to_their_ends():
    law = PiecewiseLinear(((1.0, 0.2, 0.05), (inf, -0.1, 0.4)))
    expected = [np.nan, 0.05, 0.15, 0.25, 0.2, 0.1]
    assert law.angle(ARM) == pytest.approx(expected, nan_ok=True)


def test_readings_are_joined_and_never_extended():
    law = DigitisedPoints(((0.0, 0.1), (1.0, 0.3), (2.0, 0.2)))
    expected = [np.nan, 0.1, 0.2, 0.3, 0.2, np.nan]
    assert law.angle(ARM) == pytest.approx(expected, nan_ok=True)
    assert law.valid_range == (0.0, 2.0)
