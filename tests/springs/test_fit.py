"""Least-squares cubics: known ones come back, noise stays within its covariance, bounds hold."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.polynomial import Polynomial

from springs import Cubic, NotRestoringError, restoring_sense
from springs.cubic import Coefficients, polynomial
from springs.fit import CubicFit, fit_cubic

HIP_FLEXION = (33.180672, -144.6, 188.2, -82.76)
HIP_ABDUCTION = (-0.131, 136.0, 8.42, -218.0)
ELBOW = (1.014, 29.224, -6.13885, 214.423)
ANGLES = np.radians(np.arange(-50.0, 56.0, 5.0))

# To a billionth of a newton metre: the squares of much smaller ones are no longer numbers.
MOMENT = st.floats(-100.0, 100.0).map(lambda moment: round(moment, 9))
MOMENTS = st.lists(MOMENT, min_size=4, max_size=12)
STARTS = st.floats(-3.0, 3.0)
WIDTHS = st.floats(0.1, 4.0)


def spread(count: int, start: float, width: float) -> np.ndarray:
    """Angles [rad] that are not quite evenly spaced."""
    even = np.linspace(0.0, 1.0, count)
    return start + width * even * (0.7 + 0.3 * even)


@pytest.mark.parametrize("coefficients", [HIP_FLEXION, HIP_ABDUCTION, ELBOW])
@pytest.mark.parametrize("passive", [False, True])
def test_a_known_cubic_comes_back(coefficients: Coefficients, passive: bool):
    fit = fit_cubic(ANGLES, polynomial(coefficients, ANGLES), passive=passive)
    assert fit.coefficients == pytest.approx(coefficients, rel=1e-10, abs=1e-10)
    assert fit.r_squared == pytest.approx(1.0, abs=1e-12)
    assert fit.rms < 1e-10
    assert not fit.bounds_active
    assert fit.law.sense == restoring_sense(coefficients)


def test_data_far_from_zero_are_no_harder():
    angles = np.radians(np.linspace(160.0, 170.0, 12))
    fit = fit_cubic(angles, polynomial(HIP_FLEXION, angles))
    assert fit.fitted_moments == pytest.approx(polynomial(HIP_FLEXION, angles), rel=1e-12)


def test_the_standard_errors_are_those_of_the_normal_equations():
    rng = np.random.default_rng(1)
    fit = fit_cubic(ANGLES, polynomial(ELBOW, ANGLES) + rng.normal(0.0, 1.0, len(ANGLES)))
    design = np.vander(ANGLES, 4, increasing=True)
    variance = np.sum(fit.residuals**2) / (len(ANGLES) - 4)
    expected = variance * np.linalg.inv(design.T @ design)
    assert fit.covariance == pytest.approx(expected, rel=1e-9, abs=1e-9)
    assert fit.standard_errors == pytest.approx(np.sqrt(np.diag(expected)).tolist(), rel=1e-9)


def restoring_signs(fit: CubicFit) -> list[float]:
    """The six values that the bounds keep from being negative, in parts of the largest moment."""
    first, last = fit.angles.min(), fit.angles.max()
    half, middle = 0.5 * (last - first), 0.5 * (last + first)
    curve = Polynomial(fit.coefficients)(Polynomial([middle, half])) * fit.law.sense
    slope, bend = curve.deriv(1), curve.deriv(2)
    values = [curve(-1), -curve(1), -slope(-1), -slope(1), bend(-1), -bend(1)]
    size = np.abs(fit.moments).max() * (1.0 + np.abs(middle / half)) ** 3 + 1e-300
    return [float(value / size) for value in values]


@given(MOMENTS, STARTS, WIDTHS)
def test_passive_bounds_hold(moments: list[float], start: float, width: float):
    fit = fit_cubic(spread(len(moments), start, width), moments, passive=True)
    assert min(restoring_signs(fit)) > -1e-9


@given(MOMENTS, STARTS, WIDTHS)
def test_a_bound_cubic_is_never_nearer_than_the_free_one(
    moments: list[float], start: float, width: float
):
    angles = spread(len(moments), start, width)
    free, bound = (fit_cubic(angles, moments, passive=passive) for passive in (False, True))
    powers = np.abs(angles).max() ** np.arange(4)
    rounding = 1e-14 * float(np.abs(free.coefficients) @ powers)
    assert bound.rms >= free.rms - rounding


def test_the_bound_cubic_is_the_nearest_of_those_that_restore():
    """Small steps within the bounds never come nearer to the data."""
    rng, tried = np.random.default_rng(3), 0
    for _ in range(6):
        angles = spread(9, -1.0, 2.0)
        fit = fit_cubic(angles, rng.normal(0.0, 10.0, 9), passive=True)
        for _ in range(60):
            step = rng.normal(0.0, 0.05, 4)
            c0, c1, c2, c3 = (c + s for c, s in zip(fit.coefficients, step, strict=True))
            other = CubicFit(fit.angles, fit.moments, (c0, c1, c2, c3), None)
            if restoring_sense(other.coefficients) != fit.law.sense:
                continue
            if min(restoring_signs(other)) >= 0.0:
                assert other.rms > fit.rms
                tried += 1
    assert tried > 100


def test_a_cubic_that_runs_away_is_bound():
    """A resistance that gives way at one end: unbound its dead zone swallows the data."""
    angles = np.radians([0.0, 20.0, 40.0, 60.0, 80.0, 100.0])
    moments = [5.0, 1.0, 0.0, -1.0, -4.0, -3.0]
    fit = fit_cubic(angles, moments, passive=True)
    assert fit.bounds_active
    assert fit.covariance is None
    assert any("bounds hold" in doubt for doubt in fit.doubts)
    assert fit.law.torque(angles[0]) > 0.0 > fit.law.torque(angles[-1])


@pytest.mark.parametrize("slope", [10.0, -10.0])
def test_a_line_stays_a_line(slope: float):
    """Rounding in c3 must not choose the sense, nor put a dead zone over everything."""
    for passive in (False, True):
        law = fit_cubic(ANGLES, slope * ANGLES, passive=passive).law
        assert law == Cubic(law.coefficients, 1 if slope < 0.0 else -1)
        assert law.coefficients == pytest.approx((0.0, slope, 0.0, 0.0), abs=1e-12)
        assert law.coefficients[2:] == (0.0, 0.0)


def test_equal_moments_are_no_law():
    fit = fit_cubic(ANGLES, np.full(len(ANGLES), 3.0))
    assert fit.r_squared is None
    assert "no sense" in fit.doubts[0]
    with pytest.raises(NotRestoringError):
        _ = fit.law


def test_no_moments_are_no_torque():
    fit = fit_cubic(ANGLES, 0.0 * ANGLES, passive=True)
    assert fit.coefficients == (0.0, 0.0, 0.0, 0.0)
    assert np.asarray(fit.law.torque(ANGLES)).tolist() == [0.0] * len(ANGLES)


def test_four_points_have_no_errors():
    fit = fit_cubic([0.0, 1.0, 2.0, 3.0], [0.0, 1.0, 8.0, 27.0])
    assert fit.coefficients == pytest.approx((0.0, 0.0, 0.0, 1.0), abs=1e-12)
    assert fit.standard_errors is None


def test_the_sense_of_noise_is_doubted():
    rng = np.random.default_rng(5)
    fit = fit_cubic(ANGLES, -20.0 * ANGLES + rng.normal(0.0, 3.0, len(ANGLES)))
    assert any("hangs on noise" in doubt for doubt in fit.doubts)


def test_what_the_dead_zone_leaves_out_is_told():
    fit = fit_cubic(ANGLES, polynomial(HIP_ABDUCTION, ANGLES))
    assert any("leaves out a fitted moment of 42" in doubt for doubt in fit.doubts)


def test_a_dead_zone_over_all_the_data_is_doubted():
    angles = np.radians(np.arange(-30.0, 31.0, 5.0))
    fit = fit_cubic(angles, polynomial(HIP_ABDUCTION, angles))
    assert any("covers all the data" in doubt for doubt in fit.doubts)


def test_an_edge_beyond_the_data_is_doubted():
    angles = np.radians(np.arange(-60.0, 41.0, 5.0))
    (edge, left_out) = fit_cubic(angles, polynomial(HIP_ABDUCTION, angles)).doubts
    assert "an edge of the dead zone lies beyond the data" in edge
    assert "leaves out" in left_out


@pytest.mark.parametrize(
    ("angles", "moments", "message"),
    [
        ([0.0, 1.0, 2.0], [1.0, 2.0, 3.0], "four different angles"),
        ([0.0, 1.0, 1.0, 2.0], [1.0, 2.0, 3.0, 4.0], "four different angles"),
        ([0.0, 1.0, 2.0, 3.0], [1.0, 2.0, 3.0], "a moment for each angle"),
        ([0.0, 1.0, 2.0, np.nan], [1.0, 2.0, 3.0, 4.0], "finite"),
    ],
)
def test_what_cannot_be_fitted(angles: list[float], moments: list[float], message: str):
    with pytest.raises(ValueError, match=message):
        fit_cubic(angles, moments)
