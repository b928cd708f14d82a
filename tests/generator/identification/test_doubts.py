"""Doubts about fits whose model is wrong, or whose data say too little."""

from dataclasses import replace

import numpy as np
import pytest

from generator.identification.doubts import fit_doubts
from generator.identification.fit import Fit, fit_springs
from generator.identification.residual_tests import check_residuals
from tests.swings import (
    ALONE,
    COULOMB,
    NOISE,
    OFFSET,
    SCALE,
    TRUTH,
    VISCOUS,
    coarse_fit,
    leg_case,
    paths,
    standard_fit,
    swing,
)


def with_stated_noise(fit: Fit, sd: float) -> Fit:
    """The fit with another stated noise, whose residuals are the same."""
    tests = check_residuals(fit.residuals, len(fit.estimates), sd)
    return replace(fit, options=replace(fit.options, sd=sd), tests=tests)


def test_a_good_fit_has_none():
    assert fit_doubts(standard_fit()) == ()
    assert fit_doubts(with_stated_noise(standard_fit(), NOISE)) == ()


def test_a_noise_that_is_too_small_or_too_large_is_named():
    (small,) = fit_doubts(with_stated_noise(standard_fit(), 0.5 * NOISE))
    (large,) = fit_doubts(with_stated_noise(standard_fit(), 2.0 * NOISE))
    assert "the residuals are 1." in small or "the residuals are 2." in small
    assert "the model does not explain the data" in small
    assert "which is too large" in large


def test_a_law_that_is_missing_shows_in_the_residuals():
    data = swing({**TRUTH, COULOMB: 0.3})
    found = fit_doubts(fit_springs(leg_case(), data, paths(SCALE, VISCOUS), ALONE))
    assert "successive residuals are alike" in found[0]
    assert "the intervals are too narrow, by a factor of" in found[0]


def test_a_coarse_step_is_named_with_its_bias():
    found = fit_doubts(coarse_fit())
    assert "of its standard deviations by the step of 0.02 s, which is too long" in found[0]


def test_damping_and_friction_from_one_swing_are_named():
    data = swing({**TRUTH, COULOMB: 0.1}, stop=1.0)
    found = fit_doubts(fit_springs(leg_case(), data, paths(VISCOUS, COULOMB), ALONE))
    assert "one swing hardly separates damping from friction" in "".join(found)


def test_an_estimate_at_its_bound_is_named():
    fit = standard_fit()
    at_bound = tuple(replace(one, at_bound=one.path == VISCOUS) for one in fit.estimates)
    (found,) = fit_doubts(replace(fit, estimates=at_bound))
    assert found.startswith(f"{VISCOUS} is at its smallest value")


def test_exact_data_are_not_called_wrong():
    data = swing(noise=0.0)
    fit = fit_springs(leg_case(), data, paths(SCALE, VISCOUS, OFFSET), ALONE)
    assert fit_doubts(fit) == ()
    (found,) = fit_doubts(with_stated_noise(fit, NOISE))
    assert "which is too large" in found


@pytest.mark.parametrize("rms", [None, 0.1])
def test_a_start_that_ends_elsewhere_is_named(rms: float | None):
    fit = standard_fit()
    starts = (fit.starts[0], replace(fit.starts[1], rms=rms, is_best=False))
    (found,) = fit_doubts(replace(fit, starts=starts))
    assert found.startswith("1 of 2 starts found the least sum of squares")


def with_residuals(fit: Fit, residuals: np.ndarray) -> Fit:
    """The fit with other residuals, shape (n, k)."""
    tests = check_residuals(residuals, len(fit.estimates), None)
    return replace(fit, simulated=fit.data.angles + residuals, tests=tests)


def test_residuals_as_large_as_the_motion_are_the_first_doubt():
    fit = standard_fit()
    found = fit_doubts(with_residuals(fit, fit.data.angles.mean() - fit.data.angles))
    assert found[0].startswith("the model explains hardly any of the motion: rms residual ")
    assert "successive residuals are alike" in found[1]


def test_residuals_that_alternate_are_a_doubt():
    fit = standard_fit()
    signs = np.where(np.arange(len(fit.residuals)) % 2, 1.0, -1.0)[:, None]
    (found,) = fit_doubts(with_residuals(fit, fit.residuals + NOISE * signs))
    assert "successive residuals are not independent (autocorrelation -0." in found
    assert "the intervals are wrong" in found


def test_a_step_longer_than_a_frame_is_that_of_the_frame():
    fit = coarse_fit()
    (found, *_) = fit_doubts(replace(fit, accuracy=replace(fit.accuracy, step=5.0)))
    assert "by the step of 0.02 s, which is too long" in found
